//! One exposure for the pictures of a kind: by what a manifest states of each, else by EXIF.
//!
//! Pictures are brought to the shortest exposure among them, or to one that is asked for, in linear light ([`crate::even`]): to the counts that they would have had. What was at
//! full scale stays there.

use std::fmt::Display;
use std::path::Path;

use super::exif::{Shot, Stated};
use super::frames;
use crate::manifest::{Manifest, Row, RowKind};

/// Exposures closer than this are one, as a share: EXIF rounds.
const SAME: f64 = 0.01;
/// Names that are told at most.
const MOST_NAMES: usize = 6;

/// What became of the exposures of a manifest's pictures.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OneExposure {
    /// What of the pictures is not measured as it was taken, for a profile's note.
    pub approximate: Vec<String>,
    /// What should be known besides, a sentence each.
    pub warnings: Vec<String>,
    /// What the pictures of the target are brought to, time (s) · ISO / f-number²; `None` where no file states all three or the manifest has a unit of its own.
    pub exposure: Option<f64>,
    /// The sensitivity (ISO) of the pictures of the target; `None` where none states it, or they differ.
    pub iso: Option<f64>,
}

/// How a picture was exposed beside others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposed {
    /// Time · ISO / f-number² over theirs, finite and > 0.
    pub over: f64,
    /// Its sensitivity (ISO) over theirs, finite and > 0; 1 where that is not known.
    pub gain: f64,
}

impl Exposed {
    /// As they were.
    pub const ALIKE: Self = Self {
        over: 1.0,
        gain: 1.0,
    };
}

/// What is known of a row's exposure.
struct Known {
    row: usize,
    name: String,
    shots: Vec<Shot>,
    exposure: Option<f64>,
    is_given: bool,
}

pub(crate) fn one_exposure(manifest: &mut Manifest, asked: Option<f64>) -> OneExposure {
    let mut told = OneExposure::default();
    let is_depth = |row: &Row| matches!(row.kind, RowKind::Depth { .. });
    for (kind, depth) in [("that look up", true), ("of the target", false)] {
        let rows = (0..manifest.rows.len()).filter(|i| is_depth(&manifest.rows[*i]) == depth);
        let known = known(rows.map(|i| (i, &manifest.rows[i])).collect());
        told.tell_of_files(&known);
        let asked = asked.filter(|_| !depth);
        let reference = asked.or_else(|| shortest(&known));
        told.tell_of_none(&known, asked);
        told.tell_of_exposures(kind, &known, reference);
        if !depth {
            let by_files = !known.iter().any(|of| of.is_given);
            let mut shots = known.iter().flat_map(|of| &of.shots);
            let is_stated = shots.any(|shot| shot.whole_exposure().is_some());
            told.exposure = reference.filter(|_| by_files && is_stated);
            told.iso = one_iso(known.iter().flat_map(|of| &of.shots));
        }
        for of in &known {
            let over = of.exposure.zip(reference).map_or(1.0, |(own, to)| own / to);
            manifest.rows[of.row].over = if is_same(over, 1.0) { 1.0 } else { over };
        }
    }
    let file = manifest.path.display().to_string();
    let of_file = |what: &mut String| *what = format!("{file}: {what}");
    told.warnings.iter_mut().for_each(of_file);
    told
}

fn known(rows: Vec<(usize, &Row)>) -> Vec<Known> {
    let mut known: Vec<Known> = (rows.into_iter())
        .map(|(i, row)| Known {
            row: i,
            name: format!(
                "{} (line {})",
                row.image.file_name().unwrap_or_default().to_string_lossy(),
                row.line
            ),
            shots: shots(&row.image),
            exposure: row.exposure,
            is_given: row.exposure.is_some(),
        })
        .collect();
    let any = |of: &dyn Fn(&Shot) -> bool| known.iter().flat_map(|k| &k.shots).any(of);
    let stated = Stated {
        iso: any(&|shot| shot.iso.is_some()),
        f_number: any(&|shot| shot.f_number.is_some()),
    };
    for of in &mut known {
        let by_file = of.shots.first().and_then(|shot| shot.exposure(&stated));
        of.exposure = of.exposure.or(by_file);
    }
    known
}

/// Of a file, or of all frames of a folder.
fn shots(path: &Path) -> Vec<Shot> {
    // A folder that cannot be read is refused where its frames are.
    let files = frames::files(path).unwrap_or_default();
    files.iter().map(|file| Shot::of_file(file)).collect()
}

/// How a picture that states time, ISO and f-number was exposed beside others of an exposure and a sensitivity; 1 where they are the same.
pub fn exposed(shot: &Shot, to: Option<f64>, iso: Option<f64>) -> Option<Exposed> {
    let one = |over: f64| if is_same(over, 1.0) { 1.0 } else { over };
    Some(Exposed {
        over: one(shot.whole_exposure()? / to?),
        gain: one(shot.iso.zip(iso).map_or(1.0, |(own, theirs)| own / theirs)),
    })
}

/// The sensitivity that all pictures which state one have.
fn one_iso<'a>(shots: impl Iterator<Item = &'a Shot>) -> Option<f64> {
    let mut stated = shots.filter_map(|shot| shot.iso);
    let first = stated.next()?;
    stated.all(|iso| is_same(iso, first)).then_some(first)
}

fn is_same(one: f64, other: f64) -> bool {
    (one / other - 1.0).abs() <= SAME
}

/// The shortest, at which no pixel is brought beyond full scale.
fn shortest(known: &[Known]) -> Option<f64> {
    known.iter().filter_map(|of| of.exposure).reduce(f64::min)
}

impl OneExposure {
    /// What files say that makes pictures hard to compare.
    fn tell_of_files(&mut self, known: &[Known]) {
        let mut tell = |names: Vec<String>, what: &str| {
            if !names.is_empty() {
                self.warnings.push(format!("{what}: {}", listed(&names)));
            }
        };
        let shown = |of: &dyn Fn(&Shot) -> bool| {
            let with = known.iter().filter(|k| k.shots.iter().any(of));
            with.map(|k| k.name.clone()).collect::<Vec<_>>()
        };
        for of in known {
            let wrong = of.shots.iter().find_map(|shot| shot.wrong.as_deref());
            if let Some(wrong) = wrong.filter(|_| !of.is_given) {
                tell(
                    vec![of.name.clone()],
                    &format!("{wrong}; the column exposure can say it"),
                );
            }
        }
        tell(
            shown(&|shot| shot.auto_white_balance == Some(true)),
            "the white balance was automatic, so that colours drift from picture to picture, which is not taken out; fix it",
        );
        tell(
            shown(&|shot| shot.auto_exposure == Some(true)),
            "the exposure was automatic; fix it, as the numbers in EXIF are rounded and a camera's tone curve may go with the scene",
        );
        let frames = known.iter().filter(|k| {
            let times = k.shots.iter().filter_map(|shot| shot.time_s);
            let (least, most) = times.fold((f64::MAX, 0.0f64), |(l, m), t| (l.min(t), m.max(t)));
            most > 0.0 && !is_same(least, most)
        });
        tell(
            frames.map(|k| k.name.clone()).collect(),
            "the frames of a folder were exposed differently, and their mean is taken as if they were not",
        );
        let turned = shown(&|shot| shot.turned);
        if turned.len() < known.len() {
            tell(
                turned,
                "EXIF turns some of the pictures, which are measured as they are shown, and others not: a camera that guesses how it is held; fix it",
            );
        }
        let isos = known
            .iter()
            .flat_map(|k| k.shots.iter().filter_map(|shot| shot.iso));
        let (least, most) = isos.fold((f64::MAX, 0.0f64), |(l, m), iso| (l.min(iso), m.max(iso)));
        if most > 0.0 && !is_same(least, most) {
            self.warnings.push(format!(
                "the pictures were taken at ISO {least} to {most}: noise that is known of the camera (noise_a, noise_b) is that of one; fix the ISO, or leave the numbers out, so that \
                 noise is found in each picture"
            ));
        }
    }

    /// Where an exposure is asked for and those of the pictures are not known.
    fn tell_of_none(&mut self, known: &[Known], asked: Option<f64>) {
        if asked.is_some() && !known.is_empty() && known.iter().all(|of| of.exposure.is_none()) {
            self.warnings.push(
                "no picture of the target tells its exposure, by EXIF or a column exposure: they are left as they are".to_owned(),
            );
        }
    }

    fn tell_of_exposures(&mut self, kind: &str, known: &[Known], reference: Option<f64>) {
        let Some(to) = reference else {
            return;
        };
        let off: Vec<f64> = (known.iter().filter_map(|of| of.exposure))
            .map(|exposure| exposure / to)
            .filter(|over| !is_same(*over, 1.0))
            .collect();
        let unknown = known.iter().filter(|of| of.exposure.is_none());
        let unknown: Vec<String> = unknown.map(|of| of.name.clone()).collect();
        let given = known.iter().filter(|of| of.is_given).count();
        if given > 0 && given + unknown.len() < known.len() {
            self.warnings.push(format!(
                "of the pictures {kind} {given} have their exposure from the column exposure and {} from EXIF: the column has to be in the unit of EXIF, time (s) · ISO / f-number²",
                known.len() - given - unknown.len()
            ));
        }
        if !unknown.is_empty() && unknown.len() < known.len() {
            let whether = match off.is_empty() {
                true => "those of the others are one, which these are taken to have",
                false => {
                    "the others' exposures differ, and these are taken to have that which all are brought to"
                }
            };
            self.warnings.push(format!(
                "the exposure of pictures {kind} is not known ({whether}; the column exposure can say it): {}",
                listed(&unknown)
            ));
        }
        if !off.is_empty() {
            let (least, most) = off
                .iter()
                .fold((f64::MAX, 0.0f64), |(l, m), o| (l.min(*o), m.max(*o)));
            let alike = known
                .iter()
                .find(|of| of.exposure.is_some_and(|own| is_same(own, to)));
            let to = alike.map_or_else(
                || rounded(to).to_string(),
                |of| format!("that of {}", of.name),
            );
            self.approximate.push(format!(
                "{} of {} pictures {kind} were exposed {} to {} times as long as what they are brought to in linear light, {to}",
                off.len(),
                known.len(),
                rounded(least),
                rounded(most)
            ));
        }
    }
}

fn rounded(value: f64) -> impl Display {
    (value * 1000.0).round() / 1000.0
}

fn listed(names: &[String]) -> String {
    let shown = names.len().min(MOST_NAMES);
    let more = match names.len() - shown {
        0 => String::new(),
        n => format!("; and {n} more"),
    };
    format!("{}{more}", names[..shown].join("; "))
}

#[cfg(test)]
mod tests {
    use exif::Tag;

    use super::*;
    use crate::photo::exif::tests::{ratio, short, with_exif};

    /// A manifest of pictures of the target with these exposure times, 1/s, and what the column states.
    fn told(of: &[(Option<u32>, Option<f64>)], asked: Option<f64>) -> (Vec<f64>, OneExposure) {
        told_of(of, asked, true)
    }

    /// The same; `is_whole` says whether files state their f-number, 1.
    fn told_of(
        of: &[(Option<u32>, Option<f64>)],
        asked: Option<f64>,
        is_whole: bool,
    ) -> (Vec<f64>, OneExposure) {
        let folder = tempfile::tempdir().unwrap();
        let mut text = "file,kind,depth_m,distance_m,light_pct,exposure\n".to_owned();
        for (i, (time, given)) in of.iter().enumerate() {
            let fields = time.map(|time| {
                let mut fields = vec![
                    ratio(Tag::ExposureTime, 1, time),
                    short(Tag::PhotographicSensitivity, 100),
                ];
                fields.extend(is_whole.then(|| ratio(Tag::FNumber, 1, 1)));
                fields
            });
            let plain = [0xff, 0xd8, 0xff, 0xd9];
            let bytes = fields.map_or(plain.to_vec(), |fields| with_exif(&plain, &fields));
            std::fs::write(folder.path().join(format!("p{i}.jpg")), bytes).unwrap();
            let given = given.map_or(String::new(), |given| given.to_string());
            text += &format!("p{i}.jpg,contrast,1,{},0,{given}\n", i + 1);
        }
        let path = folder.path().join("m.csv");
        std::fs::write(&path, text).unwrap();
        let mut manifest = Manifest::read(&path, None).unwrap();
        let told = manifest.one_exposure(asked);
        (manifest.rows.iter().map(|row| row.over).collect(), told)
    }

    #[test]
    fn pictures_are_brought_to_the_shortest_exposure_or_to_one_asked_for() {
        let three = [(Some(60), None), (Some(240), None), (Some(120), None)];
        let (over, of) = told(&three, None);
        assert_eq!(over, [4.0, 1.0, 2.0]);
        let words = &of.approximate[0];
        assert!(
            words.starts_with("2 of 3 pictures of the target were exposed 2 to 4 times"),
            "{words}"
        );
        assert!(words.contains("that of p1.jpg (line 3)"), "{words}");
        assert_eq!(of.exposure, Some(100.0 / 240.0));
        // Comparable among themselves alone.
        let (over, of) = told_of(&three, None, false);
        assert_eq!((over, of.exposure), (vec![4.0, 1.0, 2.0], None));
        let (over, of) = told(&three, Some(100.0 / 480.0));
        assert_eq!(over, [8.0, 2.0, 4.0]);
        assert!(
            of.approximate[0].ends_with("in linear light, 0.208"),
            "{of:?}"
        );
        assert_eq!(of.exposure, Some(100.0 / 480.0));
        let (over, of) = told(&[(Some(60), None), (Some(60), None)], None);
        let one = OneExposure {
            exposure: Some(100.0 / 60.0),
            iso: Some(100.0),
            ..OneExposure::default()
        };
        assert_eq!((over, of), (vec![1.0, 1.0], one));
        let (over, of) = told(&[(None, None), (None, None)], None);
        assert_eq!((over, of), (vec![1.0, 1.0], OneExposure::default()));
        let (over, of) = told(&[(None, None), (None, None)], Some(1.0));
        assert_eq!(over, [1.0, 1.0]);
        assert!(
            of.warnings[0].contains("no picture of the target tells"),
            "{of:?}"
        );
        assert_eq!(of.exposure, None);
    }

    #[test]
    fn the_column_stands_in_for_exif_and_what_is_missing_is_told() {
        let (over, of) = told(&[(None, Some(3.0)), (None, Some(1.0))], None);
        assert_eq!(over, [3.0, 1.0]);
        assert_eq!(of.warnings, Vec::<String>::new());
        // Of a unit that only the manifest knows.
        assert_eq!(of.exposure, None);
        // Of a picture with both the column counts.
        let (over, of) = told(&[(Some(100), Some(2.0)), (Some(100), None)], None);
        assert_eq!(over, [2.0, 1.0]);
        assert!(
            of.warnings[0]
                .contains("1 have their exposure from the column exposure and 1 from EXIF"),
            "{of:?}"
        );
        let (over, of) = told(&[(Some(100), None), (None, None), (Some(50), None)], None);
        assert_eq!(over, [1.0, 1.0, 2.0]);
        assert!(
            of.warnings[0].contains("p1.jpg (line 3)") && of.warnings[0].contains("differ"),
            "{of:?}"
        );
        let (_, of) = told(&[(Some(100), None), (None, None)], None);
        assert!(
            of.warnings[0].contains("not known (those of the others are one"),
            "{of:?}"
        );
    }
}
