//! The pictures of a calibration that a fit uses: the target from several distances, with more and with less of the lamps.
//!
//! Of two pictures from one place the difference is light of the lamps alone, whatever the daylight. The picture with the lamps
//! off is daylight alone; what that is at the target and in the water before it is left open, so that it tells only how
//! detail is lost with distance.

use std::path::Path;

use uw_calib::manifest::{self, Manifest, RowKind};
use uw_calib::response::LinearNoise;
use uw_calib::{DepthMeasurement, Encoding, Treatment, View};

use super::blocks::{Block, Grid, Sensor, Stored};
use super::{FitError, Options, suited};
use uw_calib::vehicle::Vehicle;

/// Distances and depths closer than this are one, m.
pub(super) const SAME_M: f64 = 1e-3;

/// The same blocks of the target from a distance, in light of one kind.
#[derive(Clone, Debug)]
pub(super) struct Shown {
    pub(super) distance_m: f64,
    pub(super) depth_m: Option<f64>,
    /// What the light is.
    pub(super) light: Light,
    /// The blocks that it shows.
    pub(super) shown: Vec<usize>,
    /// Their light, in the same order.
    pub(super) blocks: Vec<Block>,
}

impl Shown {
    /// Block `i` of the grid, where it shows it and the channel's light is known.
    pub(super) fn known(&self, i: usize, k: usize) -> Option<&Block> {
        let place = self.shown.binary_search(&i).ok()?;
        Some(&self.blocks[place]).filter(|block| block.variance[k].is_finite())
    }
}

/// Light of a picture, or of the difference of two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Light {
    /// Of the lamps, at a level in (0, 1].
    Lamps(f64),
    /// Daylight.
    Daylight,
}

/// What the pictures show.
#[derive(Clone, Debug)]
pub(super) struct Pictures {
    pub(super) grid: Grid,
    /// Distance of the nearest, m: the blocks divide what it shows.
    pub(super) nearest_m: f64,
    pub(super) shown: Vec<Shown>,
    /// All pictures of the target by place, by rising distance, of each by rising lamp level.
    pub(super) places: Vec<Vec<Row>>,
    /// Places whose lamps have no picture to be compared with, so that daylight cannot be taken off.
    pub(super) single: usize,
    /// Mean counts of the pictures that look up.
    pub(super) up: Vec<DepthMeasurement>,
    /// What should be known of the pictures, a sentence each.
    pub(super) told: Vec<String>,
    /// What they are brought to, where files state it ([`super::Fit::exposure_s`]).
    pub(super) exposure_s: Option<f64>,
    /// [`super::Fit::iso`].
    pub(super) iso: Option<f64>,
}

/// A picture of the target that the manifest lists.
#[derive(Clone, Debug)]
pub(super) struct Row {
    pub(super) listed: manifest::Row,
    pub(super) distance_m: f64,
    pub(super) depth_m: Option<f64>,
    pub(super) light_pct: f64,
}

impl Row {
    /// Its picture, at the exposure that all are brought to.
    pub(super) fn view(&self) -> View<'_> {
        self.listed.view()
    }
}

impl Pictures {
    /// Reads the pictures of the manifest at `path`, taken by `vehicle`.
    pub(super) fn read(
        path: &Path,
        vehicle: &Vehicle,
        options: &Options,
    ) -> Result<Self, FitError> {
        let mut manifest = Manifest::read(path, vehicle.level_curve.as_ref())?;
        let exposures = manifest.one_exposure(options.exposure);
        let told = [exposures.approximate, exposures.warnings].concat();
        let rows: Vec<Row> = manifest.rows.iter().filter_map(of_target).collect();
        let places = places(rows);
        suited::check(path, &places, options)?;
        let distance = |place: &Vec<Row>| place[0].distance_m;
        let (nearest_m, farthest_m) = places
            .iter()
            .map(distance)
            .fold((f64::INFINITY, 0f64), |(near, far), d| {
                (near.min(d), far.max(d))
            });
        let treatment = options.treatment(vehicle);
        let size_px = [vehicle.width as usize, vehicle.height as usize];
        let share = nearest_m / farthest_m;
        let grid = Grid::new(size_px, share).ok_or_else(|| FitError::TooFar {
            manifest: path.display().to_string(),
            nearest_m,
            farthest_m,
        })?;
        let mut pictures = Self {
            grid,
            nearest_m,
            shown: Vec::new(),
            places: Vec::new(),
            single: 0,
            up: looking_up(&manifest, options, &treatment)?,
            told,
            exposure_s: exposures.exposure,
            iso: exposures.iso,
        };
        let sensor = Sensor {
            encoding: options.encoding,
            noise: LinearNoise {
                a: vehicle.noise_a,
                b: vehicle.noise_b,
            },
        };
        for place in &places {
            pictures.add(path, place, size_px, (&sensor, &treatment), options)?;
        }
        pictures.places = places;
        match options.jerlov && suited::are_grey(&pictures.shown) {
            true => Err(FitError::Grey {
                manifest: path.display().to_string(),
            }),
            false => Ok(pictures),
        }
    }

    /// Adds what the pictures of a place show, by rising lamp level.
    fn add(
        &mut self,
        path: &Path,
        place: &[Row],
        size_px: [usize; 2],
        (sensor, treatment): (&Sensor, &Treatment),
        options: &Options,
    ) -> Result<(), FitError> {
        let share = self.nearest_m / place[0].distance_m;
        let shown_blocks = self.grid.shown(share);
        let mut told = Vec::new();
        let mut read = |row: &Row| -> Result<Vec<Block>, FitError> {
            let opened = treatment.open(&row.view())?;
            let name = row.listed.image.display();
            told.extend(opened.told().iter().map(|what| format!("{name}: {what}")));
            let picture = opened.counts();
            if [picture.width, picture.height] != size_px {
                return Err(FitError::Size {
                    manifest: path.display().to_string(),
                    line: row.listed.line,
                    image: name.to_string(),
                    expected: size_px,
                    got: [picture.width, picture.height],
                });
            }
            let stored = |at: [f64; 2]| Stored {
                share: opened.stored_share(at),
                pixels: opened.pixels_behind(at),
            };
            let block = |i: &usize| self.grid.measure(*i, &picture, share, (sensor, &stored));
            Ok(shown_blocks.iter().map(block).collect())
        };
        let least = read(&place[0])?;
        let mut shown = Vec::new();
        let of = |light: Light, blocks: Vec<Block>| Shown {
            distance_m: place[0].distance_m,
            depth_m: place[0].depth_m,
            light,
            shown: shown_blocks.clone(),
            blocks,
        };
        for row in &place[1..] {
            let level = 0.01 * (row.light_pct - place[0].light_pct);
            let more = read(row)?;
            let pairs = more.iter().zip(&least);
            let difference = pairs.map(|(more, less)| Block {
                signal: [0, 1, 2].map(|k| more.signal[k] - less.signal[k]),
                variance: [0, 1, 2].map(|k| more.variance[k] + less.variance[k]),
            });
            shown.push(of(Light::Lamps(level), difference.collect()));
        }
        match (place[0].light_pct > 0.0, options.dark) {
            (true, true) => shown.push(of(Light::Lamps(0.01 * place[0].light_pct), least)),
            (true, false) => self.single += usize::from(place.len() == 1),
            (false, true) => told.extend(suited::lit_in_the_dark(
                (&place[0], sensor),
                &least,
                shown.last(),
            )),
            (false, false) => shown.push(of(Light::Daylight, least)),
        }
        self.shown.append(&mut shown);
        self.told.append(&mut told);
        Ok(())
    }
}

/// Mean counts of the pictures that look up, as a camera with sRGB's curve would have them.
fn looking_up(
    manifest: &Manifest,
    options: &Options,
    treatment: &Treatment,
) -> Result<Vec<DepthMeasurement>, FitError> {
    let up = manifest.rows.iter().filter_map(|row| match row.kind {
        RowKind::Depth { depth_m } => Some((depth_m, row)),
        RowKind::Contrast { .. } => None,
    });
    let measured = up.map(|(depth_m, row)| {
        let as_srgb = |counts: f64| match counts {
            unknown if unknown.is_nan() => unknown,
            counts => Encoding::Srgb.counts(options.encoding.light(counts)),
        };
        let mean = treatment.open(&row.view())?.measure_as(as_srgb)?.stats.mean;
        Ok(DepthMeasurement { depth_m, mean })
    });
    measured.collect()
}

fn of_target(row: &manifest::Row) -> Option<Row> {
    match row.kind {
        RowKind::Depth { .. } => None,
        RowKind::Contrast {
            distance_m,
            light_pct,
            depth_m,
        } => Some(Row {
            listed: row.clone(),
            distance_m,
            depth_m,
            light_pct,
        }),
    }
}

/// Rows by place, each place by rising lamp level; of equal levels the first counts.
fn places(rows: Vec<Row>) -> Vec<Vec<Row>> {
    let mut places: Vec<Vec<Row>> = Vec::new();
    for row in rows {
        let same = |place: &&mut Vec<Row>| {
            let depth = |d: Option<f64>| d.unwrap_or(f64::MAX);
            (place[0].distance_m - row.distance_m).abs() < SAME_M
                && (depth(place[0].depth_m) - depth(row.depth_m)).abs() < SAME_M
        };
        match places.iter_mut().find(same) {
            Some(place) => place.push(row),
            None => places.push(vec![row]),
        }
    }
    for place in &mut places {
        place.sort_by(|a, b| a.light_pct.total_cmp(&b.light_pct));
        place.dedup_by(|a, b| a.light_pct == b.light_pct);
    }
    places.sort_by(|a, b| a[0].distance_m.total_cmp(&b[0].distance_m));
    places
}

#[cfg(test)]
mod tests {
    use image::{Rgb, RgbImage};
    use uw_calib::Mask;

    use super::*;

    const SIZE: [u32; 2] = [160, 90];
    /// Light of the pictures at one exposure, with the lamps off and on, from each distance.
    const LIGHTS: [(f64, [f64; 2]); 3] =
        [(0.5, [0.05, 0.4]), (1.0, [0.04, 0.2]), (2.0, [0.03, 0.08])];

    /// The pictures of a wall that fades to the right, with the lamps off exposed `over` times as long.
    fn read(over: f64, options: &Options) -> Result<Pictures, FitError> {
        read_lights(&LIGHTS, over, options)
    }

    /// The same in other light.
    fn read_lights(
        lights: &[(f64, [f64; 2])],
        over: f64,
        options: &Options,
    ) -> Result<Pictures, FitError> {
        let folder = tempfile::tempdir().expect("a folder");
        let mut manifest = "file,kind,depth_m,distance_m,light_pct,exposure\n".to_owned();
        for (distance_m, lights) in lights {
            for (light_pct, light) in [0, 100].into_iter().zip(*lights) {
                let over = if light_pct == 0 { over } else { 1.0 };
                let picture = RgbImage::from_fn(SIZE[0], SIZE[1], |x, _| {
                    let light = over * light * (1.0 - 0.5 * f64::from(x) / f64::from(SIZE[0]));
                    Rgb([Encoding::Srgb.counts(light).round() as u8; 3])
                });
                let name = format!("{distance_m}_{light_pct}.png");
                picture.save(folder.path().join(&name)).expect("written");
                manifest += &format!("{name},contrast,3,{distance_m},{light_pct},{over}\n");
            }
        }
        let path = folder.path().join("m.csv");
        std::fs::write(&path, manifest).expect("written");
        let vehicle = Vehicle {
            width: SIZE[0],
            height: SIZE[1],
            ..Vehicle::default()
        };
        Pictures::read(&path, &vehicle, options)
    }

    #[test]
    fn pictures_that_were_exposed_longer_show_the_same_light() {
        let one = read(1.0, &Options::default()).expect("pictures");
        let longer = read(4.0, &Options::default()).expect("pictures");
        assert!(
            one.told.is_empty() && longer.told[0].contains("3 of 6 pictures"),
            "{:?}",
            longer.told
        );
        for (a, b) in one.shown.iter().zip(&longer.shown) {
            for (a, b) in a.blocks.iter().zip(&b.blocks) {
                assert!(
                    (a.signal[0] / b.signal[0] - 1.0).abs() < 0.05,
                    "{a:?} {b:?}"
                );
                // Of light that was there four times the noise is less.
                assert!(b.variance[0] < a.variance[0], "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn grey_pictures_have_no_place_on_jerlovs_scale() {
        let jerlov = Options {
            jerlov: true,
            ..Options::default()
        };
        let told = read(1.0, &jerlov)
            .map(|_| ())
            .expect_err("grey")
            .to_string();
        assert!(told.contains("m.csv: the pictures are grey"), "{told}");
        assert!(read(1.0, &Options::default()).is_ok());
    }

    #[test]
    fn daylight_in_what_is_said_to_be_dark_is_told() {
        let dark = Options {
            dark: true,
            ..Options::default()
        };
        // Light with the lamps off, and from which distances it is told: three of 255 counts are what noise leaves in a black picture, and a
        // hundredth of the lamps' light has no say.
        for (off, expected) in [
            (0.05, &["0.5", "1", "2"][..]),
            (0.003, &["1", "2"]),
            (0.0009, &[]),
        ] {
            let lights = LIGHTS.map(|(distance_m, [_, on])| (distance_m, [off, on]));
            let told = read_lights(&lights, 1.0, &dark).expect("pictures").told;
            let names = expected.iter().zip(&told);
            let right = names.fold(true, |right, (distance_m, told)| {
                right && told.contains(&format!("/{distance_m}_0.png: shows light"))
            });
            assert!(right && told.len() == expected.len(), "{off}: {told:?}");
        }
    }

    #[test]
    fn blocks_that_a_mask_covers_are_not_known() {
        let mask = "format = \"uw-mask/1\"\nwidth = 160\nheight = 90\n[[polygon]]\npoints = [[0, 0], [60, 0], [60, 90], [0, 90]]\n";
        let masked = Options {
            mask: Some(Mask::parse(mask, "mask.toml").expect("a mask")),
            ..Options::default()
        };
        let pictures = read(1.0, &masked).expect("pictures");
        let nearest = &pictures.shown[0];
        let known = |k: usize| {
            nearest
                .shown
                .iter()
                .filter(|i| nearest.known(**i, k).is_some())
                .count()
        };
        let all = nearest.shown.len();
        assert!(
            known(0) > all / 2 && known(0) < all,
            "{} of {all}",
            known(0)
        );
        let other = Options {
            mask: Some(
                Mask::parse(&mask.replace("height = 90", "height = 96"), "mask.toml")
                    .expect("a mask"),
            ),
            ..Options::default()
        };
        let error = read(1.0, &other)
            .map(|_| ())
            .expect_err("another size")
            .to_string();
        assert!(
            error.contains("160 x 96") && error.contains("0.5_0.png"),
            "{error}"
        );
    }
}
