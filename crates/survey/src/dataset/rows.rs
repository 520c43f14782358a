//! Tables of images: a file per group, a line per image, every line ending with the checksum of all before it.

use std::fmt::Write;

use uw_calib::ImageStats;

use super::plan::Group;
use super::seal::{Found, checksum};
use super::{DatasetConfig, DatasetError, ExposureMode, Workshop, store};
use uw_twin::estimate::statistics::StandardErrors;

/// One image: where it was taken, its statistics and their errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ImageRow {
    pub(super) depth_m: f64,
    pub(super) light_pct: f64,
    pub(super) exposure: f64,
    pub(super) stats: ImageStats,
    pub(super) errors: StandardErrors,
    pub(super) daylight_paths: u32,
    pub(super) lamp_paths: u32,
}

/// Numbers of a line, without the checksum.
const NUMBERS: usize = 17;

/// The rows as text that keeps every digit, for the file `name`.
pub(super) fn to_text(name: &str, rows: &[ImageRow]) -> String {
    let mut text = String::new();
    for row in rows {
        let numbers = [row.depth_m, row.light_pct, row.exposure]
            .into_iter()
            .chain(row.stats.mean)
            .chain(row.stats.contrast)
            .chain(row.errors.mean)
            .chain(row.errors.contrast);
        for number in numbers {
            // Writing to a string cannot fail.
            let _ = write!(text, "{number},");
        }
        let _ = write!(text, "{},{},", row.daylight_paths, row.lamp_paths);
        let sum = checksum(name, text.as_bytes());
        let _ = writeln!(text, "{sum}");
    }
    text
}

/// Reads what [`to_text`] wrote.
pub(super) fn from_text(name: &str, text: &[u8]) -> Found<Vec<ImageRow>> {
    const REASON: &str = "it is not a table of images";
    let Ok(text) = std::str::from_utf8(text) else {
        return Found::Damaged(REASON.into());
    };
    let have = |numbers: usize| text.lines().all(|l| l.split(',').count() == numbers);
    let sealed = have(NUMBERS + 1);
    let found = match text.ends_with('\n') {
        true if sealed => Found::Sealed(text),
        true if have(NUMBERS) => Found::Unsealed(text),
        _ => return Found::Damaged(REASON.into()),
    };
    let mut end = 0;
    for line in text.split_inclusive('\n') {
        end += line.len();
        let Some((_, sum)) = line.rsplit_once(',') else {
            return Found::Damaged(REASON.into());
        };
        let before = &text.as_bytes()[..end - sum.len()];
        if sealed && sum != format!("{}\n", checksum(name, before)) {
            return Found::changed();
        }
    }
    found.and_then(REASON, |text| text.lines().map(parse_row).collect())
}

fn parse_row(line: &str) -> Option<ImageRow> {
    let mut words = line.split(',');
    let mut number = || -> Option<f64> { words.next()?.parse().ok() };
    let (depth_m, light_pct, exposure) = (number()?, number()?, number()?);
    let mut triple = || Some([number()?, number()?, number()?]);
    let (mean, contrast) = (triple()?, triple()?);
    let errors = StandardErrors {
        mean: triple()?,
        contrast: triple()?,
    };
    Some(ImageRow {
        depth_m,
        light_pct,
        exposure,
        stats: ImageStats { mean, contrast },
        errors,
        daylight_paths: words.next()?.parse().ok()?,
        lamp_paths: words.next()?.parse().ok()?,
    })
}

/// Whether the rows are those of the images that the configuration asks of a group, in their order.
pub(super) fn fit(config: &DatasetConfig, rows: &[ImageRow]) -> bool {
    let light_pct = &config.light_pct;
    let asked = config
        .depths_m
        .iter()
        .flat_map(|&z| light_pct.iter().map(move |&l| (z, l)));
    rows.iter().map(|r| (r.depth_m, r.light_pct)).eq(asked)
}

/// The rows of a group's images on disk, and whether they can be believed.
pub(super) fn inspect(
    workshop: &Workshop,
    group: &Group,
) -> Result<Found<Vec<ImageRow>>, DatasetError> {
    let (config, path) = (workshop.config, group.images_path(workshop.folder));
    let Some(bytes) = store::read_bytes(&path)? else {
        return Ok(Found::Absent);
    };
    let found = from_text(&workshop.watch.name(&path), &bytes);
    let found = found.and_then("its images are not those of the grid", |rows| {
        fit(config, &rows).then_some(rows)
    });
    let one_exposure = config.exposure != ExposureMode::Auto;
    Ok(
        found.and_then("its exposure is not that of the dataset", |rows| {
            let same = rows.iter().all(|r| r.exposure == workshop.exposure);
            (same || !one_exposure).then_some(rows)
        }),
    )
}

/// Reads back what was made.
pub(super) fn read(workshop: &Workshop, group: &Group) -> Result<Vec<ImageRow>, DatasetError> {
    let path = group.images_path(workshop.folder);
    let rows = workshop.watch.accept(&path, inspect(workshop, group)?);
    rows.ok_or_else(|| {
        DatasetError::Inconsistent(format!(
            "{} is missing or was damaged since it was made; give the same command again",
            path.display()
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows() -> Vec<ImageRow> {
        let row = |depth_m: f64| ImageRow {
            depth_m,
            light_pct: 50.0,
            exposure: 8.61,
            stats: ImageStats {
                mean: [101.5, 90.25, 1.0 / 3.0],
                contrast: [4.5, 3.25, 1e-9],
            },
            errors: StandardErrors {
                mean: [0.1, 0.2, 0.3],
                contrast: [0.01, 0.02, 0.03],
            },
            daylight_paths: 4096,
            lamp_paths: 8192,
        };
        vec![row(1.0), row(3.0)]
    }

    #[test]
    fn every_changed_character_of_a_table_is_found() {
        let text = to_text("images/a.csv", &rows());
        assert_eq!(
            from_text("images/a.csv", text.as_bytes()),
            Found::Sealed(rows())
        );
        assert!(
            from_text("images/b.csv", text.as_bytes())
                .damage()
                .is_some()
        );
        for at in 0..text.len() {
            for other in [b'7', b',', b'\n', 0xff] {
                let mut bytes = text.clone().into_bytes();
                if bytes[at] == other {
                    continue;
                }
                bytes[at] = other;
                let found = from_text("images/a.csv", &bytes);
                assert!(found.damage().is_some(), "{at} {other}: {found:?}");
            }
        }
    }

    #[test]
    fn a_table_without_checksums_is_of_an_earlier_version() {
        let text: String = to_text("a", &rows())
            .lines()
            .filter_map(|line| Some(format!("{}\n", line.rsplit_once(',')?.0)))
            .collect();
        assert_eq!(from_text("a", text.as_bytes()), Found::Unsealed(rows()));
    }
}
