//! Water and lamps from a calibration's pictures (`uw fit`).
//!
//! A picture of a flat target is V + E (T ρ + S (s ∗ ρ)) (see [`uw_twin::estimate`]). One set of paths gives V, E, T, S and s for
//! any water ([`uw_twin::estimate::every_water`], by way of [`views`]). What all pictures of a calibration show of the target is
//! measured in blocks ([`pictures`], [`blocks`]); water, backscatter fraction, gain of the lamps and the target itself are those that come
//! closest to all blocks ([`problem`], [`least_squares`]), with their covariance. Nothing of the target is known before but that it is flat and gives back
//! less light than falls on it.

mod blocks;
mod channel;
mod daylight;
mod layout;
mod least_squares;
mod mixture;
mod mosaic;
mod pictures;
mod priors;
mod problem;
mod report;
mod suited;
mod told;
mod upward;
mod views;
mod water;

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use uw_calib::{
    DepthMeasurement, Encoding, Even, ManifestError, Mask, StatsError, Treatment, Undistortion,
};
use uw_media::WaterType;

use layout::{LN_BACKSCATTER, PLACE};
use least_squares::{Solution, minimise};
use pictures::{Light, Pictures};
use priors::Prior;
use problem::Problem;
pub use report::{ReportError, report};
pub use suited::{FEWEST_DISTANCES, LEAST_RATIO};
use told::told;
pub use upward::{FittedDepth, depths};
use uw_calib::vehicle::Vehicle;
use uw_twin::environment::{EnvironmentError, JerlovWater, WATER_INDEX};
use uw_twin::estimate::every_water::EveryWaterError;
use views::{BACKSCATTER, Views};
pub use water::{WaterError, water_file};

/// Waters from which the search begins.
const STARTS: [WaterType; 4] = [WaterType::I, WaterType::III, WaterType::C3, WaterType::C7];
/// Sets of paths at most: over the whole range of backscatter fractions, and about the one that is found.
const STAGES: usize = 4;
/// By how much fewer paths the first set has, and how many it has at least.
const FEWER: usize = 4;
const LEAST_PATHS: usize = 4096;
/// The other kind of target is told where it leaves less of the squared residuals than this share, and less by this number at least.
const OTHER_SHARE: f64 = 0.7;
const OTHER_LESS: f64 = 20.0;
/// Iterations from each of them before the best is gone on with.
const FIRST_ITERATIONS: usize = 8;
/// Standard errors that a channel's light must have in the brightest blocks to be used at all.
const LEAST_SIGNAL: f64 = 10.0;

/// Depths that a water file may be for, m.
const DEPTHS_M: std::ops::RangeInclusive<f64> = 0.1..=60.0;
/// Least and greatest backscatter fraction that a fit finds.
pub const BACKSCATTER_RANGE: [f64; 2] = [BACKSCATTER[0], BACKSCATTER[BACKSCATTER.len() - 1]];

/// What a fit is made with.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// How the pictures' counts stand for light.
    pub encoding: Encoding,
    /// Exposure that the pictures are brought to ([`Treatment::exposure`]).
    pub exposure: Option<f64>,
    /// What is left out of the pictures as they are stored.
    pub mask: Option<Mask>,
    /// From the pictures as they are stored to those of the vehicle's ideal camera.
    pub undistortion: Option<Undistortion>,
    /// There is no daylight: a picture with the lamps on needs none without, and the water file has none, whatever the depth.
    pub dark: bool,
    /// The vehicle looks down at the bottom rather than ahead at a wall.
    pub down: bool,
    /// Backscatter fraction before the pictures.
    pub backscatter_fraction: f64,
    /// Its error, of the logarithm.
    pub backscatter_error: f64,
    /// Error of the lamps' intensity times the exposure of the vehicle's file, of the logarithm.
    pub gain_error: f64,
    /// The water is taken to be between two neighbouring ones of Jerlov's types.
    pub jerlov: bool,
    /// Depths that the water file is for besides those of the pictures, m.
    pub depths_m: Vec<f64>,
    /// Paths per distance and backscatter fraction.
    pub paths: usize,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl Options {
    /// What is done to the pictures of a vehicle before they are measured.
    fn treatment(&self, vehicle: &Vehicle) -> Treatment {
        Treatment {
            encoding: self.encoding,
            exposure: self.exposure,
            even: Even::of_vehicle(vehicle, self.encoding),
            mask: self.mask.clone(),
            undistortion: self.undistortion.clone(),
        }
    }

    /// The first field that has no usable value, with what would be right.
    pub fn wrong(&self) -> Option<(&'static str, String)> {
        let errors = [
            ("backscatter_error", self.backscatter_error),
            ("gain_error", self.gain_error),
        ];
        for (field, value) in errors {
            if !(value > 0.0 && value <= 3.0) {
                let wrong = format!("must be above 0 and at most 3 (relative), got {value}");
                return Some((field, wrong));
            }
        }
        if let Some(got) = self.depths_m.iter().find(|z| !DEPTHS_M.contains(*z)) {
            let (least, most) = (DEPTHS_M.start(), DEPTHS_M.end());
            return Some((
                "depths_m",
                format!("must be from {least} to {most} (m), got {got}"),
            ));
        }
        if self.dark && !self.depths_m.is_empty() {
            let wrong = "must be left out in the dark: the water file then holds at any depth";
            return Some(("depths_m", wrong.to_owned()));
        }
        let ([least, most], got) = (BACKSCATTER_RANGE, self.backscatter_fraction);
        let wrong = || format!("must be from {least} to {most}, got {got}");
        (!(least..=most).contains(&got)).then(|| ("backscatter_fraction", wrong()))
    }
}

impl Default for Options {
    fn default() -> Self {
        Self {
            encoding: Encoding::Srgb,
            exposure: None,
            mask: None,
            undistortion: None,
            dark: false,
            down: false,
            backscatter_fraction: 0.0183,
            backscatter_error: 0.6,
            gain_error: 0.5,
            jerlov: false,
            depths_m: Vec::new(),
            paths: 65_536,
            seed: 1,
        }
    }
}

/// No water can be fitted.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// The manifest cannot be used.
    #[error(transparent)]
    Manifest(#[from] ManifestError),
    /// A picture cannot be read.
    #[error(transparent)]
    Picture(#[from] StatsError),
    /// A picture is not of the vehicle's camera.
    #[error(
        "{manifest}:{line}: {image} must have {} x {} pixels as the vehicle's camera has, got {} x {}", expected[0], expected[1], got[0], got[1]
    )]
    Size {
        /// The manifest.
        manifest: String,
        /// Its line.
        line: u64,
        /// File.
        image: String,
        /// Width and height of the vehicle's pictures, pixels.
        expected: [usize; 2],
        /// Those of the picture.
        got: [usize; 2],
    },
    /// Too few distances tell lamps from daylight.
    #[error(
        "{manifest}: lamp light must be told from daylight at {FEWEST_DISTANCES} distances or more, the farthest at least {LEAST_RATIO} times \
         as far as the nearest: of each a picture with the lamps on and one with the lamps off (or dimmed), or --dark where there is no daylight; \
         got {} ({distances_m:?} m)", distances_m.len()
    )]
    TooFew {
        /// File.
        manifest: String,
        /// Distances with both, m.
        distances_m: Vec<f64>,
    },
    /// No daylight is known so deep.
    #[error(
        "{manifest}:{line}: depth_m must be at most {} m, of which daylight can be told, got {depth_m}; say --dark where there is none", DEPTHS_M.end()
    )]
    TooDeep {
        /// File.
        manifest: String,
        /// Its line.
        line: u64,
        /// The depth, m.
        depth_m: f64,
    },
    /// The farthest picture shows the common part too small.
    #[error(
        "{manifest}: pictures from {farthest_m} m show what the one from {nearest_m} m shows in too few pixels; leave the nearest or the farthest out"
    )]
    TooFar {
        /// File.
        manifest: String,
        /// Nearest distance, m.
        nearest_m: f64,
        /// Farthest distance, m.
        farthest_m: f64,
    },
    /// A view shows more than a wall.
    #[error("distance_m = {distance_m}: the vehicle's camera would see past a target of 24 m")]
    Beyond {
        /// The distance, m.
        distance_m: f64,
    },
    /// Grey pictures have one response, and the types are known for those of red, green and blue.
    #[error(
        "{manifest}: the pictures are grey: their camera sees all colours in one channel, of which Jerlov's types say nothing; leave --jerlov out"
    )]
    Grey {
        /// File.
        manifest: String,
    },
    /// No channel has light enough.
    #[error(
        "{manifest}: the lamps' light is told from noise in no channel: take the pictures with brighter lamps, longer exposure or from nearer"
    )]
    NoSignal {
        /// File.
        manifest: String,
    },
    /// The scene cannot be made.
    #[error(transparent)]
    Environment(#[from] EnvironmentError),
    /// Paths cannot be drawn.
    #[error(transparent)]
    Paths(#[from] EveryWaterError),
    /// The search found no end.
    #[error(
        "{manifest}: no water comes close to the pictures: check distances, lamp levels, encoding and the vehicle's file"
    )]
    NoSolution {
        /// File.
        manifest: String,
    },
    /// It was interrupted.
    #[error("interrupted")]
    Interrupted,
}

/// A number and the standard error of its logarithm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fitted {
    /// The number.
    pub value: f64,
    /// Relative standard error.
    pub relative_error: f64,
}

/// A water between two of Jerlov's types.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedMixture {
    /// The water.
    pub water: JerlovWater,
    /// Standard error of its place on the scale, types.
    pub error: f64,
}

/// A fitted water.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Absorption per channel, 1/m.
    pub a_per_m: [Fitted; 3],
    /// Scattering per channel, 1/m.
    pub b_per_m: [Fitted; 3],
    /// Backscatter fraction.
    pub backscatter_fraction: Fitted,
    /// The place on Jerlov's scale, where the water was taken to be on it.
    pub jerlov: Option<FittedMixture>,
    /// Lamps' light and exposure per channel, over those of the vehicle's file.
    pub lamp_gain: [Fitted; 3],
    /// Correlation of the logarithms of all these, in the order of [`Fit::names`], row by row.
    pub correlation: Vec<Vec<f64>>,
    /// Names of what the pictures do not tell, of [`Fit::names`].
    pub not_identified: Vec<String>,
    /// Squares of the residuals over their expectation; errors are scaled with its root where it is above 1.
    pub misfit: f64,
    /// Measured and fitted means of each picture.
    pub pictures: Vec<FittedPicture>,
    /// Mean reflectance of the target per channel, as far as the lamps' gain is known.
    pub reflectance: [f64; 3],
    /// What a user should know, a sentence each.
    pub warnings: Vec<String>,
    /// Exposure that the pictures were brought to, as EXIF states it, where it does: time (s) · ISO / f-number².
    pub exposure_s: Option<f64>,
    /// Sensitivity (ISO) of the pictures, where all that state it have the same.
    pub iso: Option<f64>,
    /// The pictures by place.
    places: Vec<Vec<pictures::Row>>,
    /// Mean counts of the pictures that look up.
    up: Vec<DepthMeasurement>,
}

/// A picture's part of the target, as it was seen and as the fit has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedPicture {
    /// Distance, m.
    pub distance_m: f64,
    /// Lamp level of the light, in (0, 1]; 0 for daylight.
    pub level: f64,
    /// Mean linear signal over the blocks, seen and fitted.
    pub mean: [[f64; 2]; 3],
    /// Root mean square deviation of the blocks from that mean, seen (without the sensor's noise) and fitted.
    pub deviation: [[f64; 2]; 3],
}

impl Fit {
    /// Names of the fitted numbers.
    pub fn names() -> Vec<String> {
        let of = |what: &str| ["r", "g", "b"].map(|k| format!("{what}_{k}"));
        let all = [of("a"), of("b"), of("lamp_gain")].concat();
        [all, vec!["backscatter_fraction".to_owned()]].concat()
    }
}

/// Fits water and lamps to the pictures of the manifest at `path`, taken by `vehicle`. `progress` is told (done, all) and says
/// whether to go on.
///
/// # Errors
/// The manifest or a picture cannot be used, the pictures are too few or too dark, or no water comes close to them.
pub fn fit(
    path: &Path,
    vehicle: &Vehicle,
    options: &Options,
    progress: &(dyn Fn(usize, usize) -> bool + Sync),
) -> Result<Fit, FitError> {
    let pictures = Pictures::read(path, vehicle, options)?;
    let manifest = || path.display().to_string();
    let dark = without_signal(&pictures);
    if dark == [true; 3] {
        return Err(FitError::NoSignal {
            manifest: manifest(),
        });
    }
    let mut distances_m: Vec<f64> = pictures.shown.iter().map(|s| s.distance_m).collect();
    distances_m.dedup();
    let search = Search {
        pictures: &pictures,
        vehicle,
        options,
        steps: STAGES * distances_m.len(),
        distances_m,
        done: AtomicUsize::new(0),
        progress,
    };
    match search.run()? {
        Some((views, prior, found)) => {
            let mut problem = Problem::new(&pictures, &views, vehicle.exposure, prior);
            problem.weigh_pictures(&found.parameters);
            let mut fit = told(&problem, &found, dark);
            fit.warnings.extend(search.other_target(problem, &found));
            fit.warnings.extend_from_slice(&pictures.told);
            Ok(fit)
        }
        None => Err(FitError::NoSolution {
            manifest: manifest(),
        }),
    }
}

/// The way to the water that comes closest.
struct Search<'a> {
    pictures: &'a Pictures,
    vehicle: &'a Vehicle,
    options: &'a Options,
    distances_m: Vec<f64>,
    steps: usize,
    done: AtomicUsize,
    progress: &'a (dyn Fn(usize, usize) -> bool + Sync),
}

impl Search<'_> {
    /// Looks for the backscatter fraction with few paths over its whole range, then with many about it; as long as what is found
    /// lies beyond them about that again.
    fn run(&self) -> Result<Option<(Views, Prior, Solution)>, FitError> {
        let options = self.options;
        let prior = Prior {
            backscatter: options.backscatter_fraction,
            backscatter_error: options.backscatter_error,
            gain_error: options.gain_error,
            jerlov: options.jerlov,
            down: self.daylight_of(options.down),
        };
        let views = self.views(&BACKSCATTER, (options.paths / FEWER).max(LEAST_PATHS))?;
        let mut problem = self.problem(&views, prior);
        let Some(mut found) = self.best_start(&mut problem)? else {
            return Ok(None);
        };
        let mut last = None;
        for _ in 1..STAGES {
            let about = found.parameters[LN_BACKSCATTER].exp();
            let views = self.views(&views::about(about), options.paths)?;
            let mut problem = self.problem(&views, prior);
            problem.weigh_pictures(&found.parameters);
            let start = found.parameters.clone();
            let Some(next) = self.minimise(&problem, start, None) else {
                return Ok(None);
            };
            found = next;
            let settled = views::is_about(found.parameters[LN_BACKSCATTER].exp(), about);
            last = Some(views);
            if settled {
                break;
            }
        }
        Ok(last.map(|views| (views, prior, found)))
    }

    /// What is known of how daylight falls with distance: before a wall it does not, above a bottom by the cosine of its way.
    fn daylight_of(&self, down: bool) -> Option<f64> {
        down.then(|| cosine_in_water(self.vehicle.sun_zenith_deg))
    }

    /// A warning where the pictures come much closer to what a bottom shows than to a wall, or the other way round.
    fn other_target(&self, mut problem: Problem<'_>, found: &Solution) -> Option<String> {
        if self.options.dark {
            return None;
        }
        let residuals = problem.residuals(&found.parameters);
        let own: f64 = residuals.iter().map(|r| r.value * r.value).sum();
        problem.prior.down = self.daylight_of(!self.options.down);
        let other = self.minimise(&problem, found.parameters.clone(), None)?;
        let seems = match self.options.down {
            true => {
                "before a wall rather than above a bottom: leave --bottom out if the vehicle looks ahead"
            }
            false => {
                "above a bottom rather than before a wall: say --bottom if the vehicle looks down"
            }
        };
        (other.sum < OTHER_SHARE * own && own - other.sum > OTHER_LESS).then(|| {
            format!(
                "daylight falls with distance as {seems} (squared residuals {:.0} instead of {own:.0})",
                other.sum
            )
        })
    }

    fn views(&self, backscatter: &[f64], paths: usize) -> Result<Views, FitError> {
        let part = (self.pictures.grid, self.pictures.nearest_m);
        let numbers = (paths, self.options.seed);
        let distances_m = self.distances_m.clone();
        let step = || {
            let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
            (self.progress)(done, self.steps)
        };
        Views::new(self.vehicle, distances_m, part, backscatter, numbers, &step)
    }

    fn problem<'p>(&'p self, views: &'p Views, prior: Prior) -> Problem<'p> {
        Problem::new(self.pictures, views, self.vehicle.exposure, prior)
    }

    fn goes_on(&self) -> bool {
        (self.progress)(self.done.load(Ordering::Relaxed), self.steps)
    }

    fn minimise(
        &self,
        problem: &Problem<'_>,
        start: Vec<f64>,
        most_iterations: Option<usize>,
    ) -> Option<Solution> {
        let residuals = |at: &[f64]| problem.residuals(at);
        let found = minimise(start, residuals, most_iterations, || self.goes_on());
        found.filter(|found| found.sum.is_finite())
    }

    /// The best of what is come to from several waters.
    fn best_start(&self, problem: &mut Problem<'_>) -> Result<Option<Solution>, FitError> {
        let mut best: Option<Solution> = None;
        for water in STARTS {
            let iops = JerlovWater::from(water).iops();
            let iops = iops.map_err(EnvironmentError::from)?;
            let mut start = problem.start(iops.a, iops.b);
            let place = WaterType::ALL.iter().position(|t| *t == water);
            start[PLACE] = place.unwrap_or(0) as f64;
            let found = self.minimise(problem, start, Some(FIRST_ITERATIONS));
            let better = |found: &Solution| best.as_ref().is_none_or(|b| found.sum < b.sum);
            if let Some(found) = found
                && better(&found)
            {
                best = Some(found);
            }
            if !self.goes_on() {
                return Err(FitError::Interrupted);
            }
        }
        let Some(best) = best else {
            return Ok(None);
        };
        problem.weigh_pictures(&best.parameters);
        Ok(self.minimise(problem, best.parameters, None))
    }
}

/// Cosine of the zenith angle in the water of a sun at `zenith_deg` in air.
fn cosine_in_water(zenith_deg: f64) -> f64 {
    (1.0 - (zenith_deg.to_radians().sin() / WATER_INDEX).powi(2)).sqrt()
}

/// Channels in which no block of any lamp picture is told from noise.
fn without_signal(pictures: &Pictures) -> [bool; 3] {
    [0, 1, 2].map(|k| {
        let lit = pictures.shown.iter().filter(|s| s.light != Light::Daylight);
        let blocks = lit.flat_map(|shown| &shown.blocks);
        let mut told = blocks.map(|block| block.signal[k] / block.variance[k].sqrt());
        !told.any(|share| share > LEAST_SIGNAL)
    })
}
