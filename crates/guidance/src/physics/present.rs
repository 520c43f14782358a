//! The present picture, made ready for suggestions.

use std::sync::Arc;

use uw_calib::picture::Counts;
use uw_calib::response::{CountResponse, LinearNoise};
use uw_calib::stats::contrast_misfit;
use uw_calib::{Even, NoiseModel, SensorNoise};

use super::blocks::Blocks;
use super::brightness::{self, Brightness, Look, Sensor};
use super::cleared::LinearPicture;
use super::file::WaterFile;
use super::memory::by_distance;
use super::predict::{Contrast, Known, Predictor, Sights, Unknown};
use super::sheet::Sheet;
use super::target::Sight;
use crate::features::Candidate;

/// Standard errors by which a prediction may miss a picture.
const MOST_ERRORS: f64 = 3.0;
/// How much the contrast of one part of a target differs from that of another which is before the camera later, as a share.
const OTHER_PART: f64 = 0.1;
/// Patches of a picture whose detail is independent: neighbours have much of it in common.
const INDEPENDENT_PATCHES: f64 = 15.0;
/// Two pictures are from different places where the logarithm of their distances differs by more ...
const ELSEWHERE_LOG: f64 = 0.05;
/// ... or their lamp levels, percent.
const ELSEWHERE_PCT: f64 = 5.0;
/// Pictures whose depths differ by more have another daylight, m.
const SAME_DEPTH_M: f64 = 0.25;

/// A water file, made ready for predictions.
#[derive(Debug)]
pub struct Water {
    file: WaterFile,
    response: CountResponse,
    noise: NoiseModel,
    even: Option<Even>,
    sights: Arc<[Sight]>,
}

impl Water {
    /// Of a file.
    pub fn new(file: WaterFile) -> Self {
        Self {
            response: file.sensor.response(),
            noise: SensorNoise::new(file.sensor.encoding, file.sensor.noise())
                .map_or(NoiseModel::Picture, NoiseModel::Sensor),
            even: file.sensor.even(),
            sights: by_distance(&file.sights),
            file,
        }
    }

    /// The file.
    pub fn file(&self) -> &WaterFile {
        &self.file
    }

    /// The noise of its camera's pictures.
    pub fn noise(&self) -> &NoiseModel {
        &self.noise
    }

    /// What takes the lens out of its camera's pictures, where that is to be done.
    pub fn even(&self) -> Option<&Even> {
        self.even.as_ref()
    }

    /// Width and height of its camera's pictures, pixels.
    pub fn size_px(&self) -> [usize; 2] {
        [self.file.sensor.width_px, self.file.sensor.height_px]
    }
}

/// What a picture tells of the contrast at other places, made once when it arrives.
#[derive(Debug)]
pub struct Present {
    water: Arc<Water>,
    depth_m: f64,
    here: Candidate,
    measured: [f64; 3],
    known: Arc<Known>,
    /// Signals of its blocks, with the light of its place.
    blocks: Blocks,
    /// The share of its light that the stored picture has.
    stored_share: f64,
    correction: [f64; 3],
    unknown: [Option<Unknown>; 3],
    /// Predicted for no change, 8-bit counts.
    predicted: [f64; 3],
    sheet: Sheet,
}

/// What a prediction from elsewhere gives for a picture, less what the picture has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    /// Per channel, 8-bit counts; `None` where the prediction does not tell the channel.
    pub counts: [Option<f64>; 3],
    /// Its standard error, 8-bit counts: that of the prediction, and that another part of the target may be before the camera.
    pub error_counts: [f64; 3],
    /// The same of mean counts, where an earlier picture and the present one are compared.
    pub brightness: Option<Brightness>,
    /// The largest of the channels, of contrast and of mean counts, in units of three standard errors: above 1 the water file does
    /// not fit this place.
    pub misfit: f64,
    /// What the prediction is from.
    pub from: ResidualFrom,
}

/// Where a prediction for the present place is from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResidualFrom {
    /// An earlier picture, from another distance or with other lamps.
    Picture,
    /// The sights of the water file.
    Sights,
}

impl ResidualFrom {
    /// Its name in replies.
    pub fn name(self) -> &'static str {
        match self {
            Self::Picture => "picture",
            Self::Sights => "sights",
        }
    }
}

impl Present {
    /// Of a picture of the water's camera without what its lens does, taken at `here` at `depth_m`, with its published contrast, 8-bit counts, and
    /// what the vehicle saw earlier on its way.
    pub fn new(
        water: Arc<Water>,
        picture: &Counts,
        (here, depth_m): (&Candidate, f64),
        measured: [f64; 3],
        earlier: &[Sight],
    ) -> Self {
        let linear = LinearPicture::of_counts(picture, water.file.sensor.encoding);
        let measured = linear.own_contrast(measured, &water.response);
        let place = water.file.place(&water.response, depth_m);
        let sights = Sights {
            earlier: by_distance(earlier),
            filed: Arc::clone(&water.sights),
        };
        let predictor = Predictor::remembering(place, &linear, (here, measured), sights);
        let (known, correction) = predictor.known();
        let unknown = predictor.unknown();
        let blocks = predictor.blocks(&linear, here);
        let sheet = Sheet::new(&predictor, water.file.tables.distance_range_m());
        let mut present = Self {
            water,
            depth_m,
            here: *here,
            measured,
            known,
            blocks,
            stored_share: linear.stored_share(),
            correction,
            unknown,
            predicted: [0.0; 3],
            sheet,
        };
        present.predicted = present.contrast(here).counts;
        present
    }

    fn predictor(&self) -> Predictor<'_> {
        let place = self.water.file.place(&self.water.response, self.depth_m);
        Predictor::of_known(place, Arc::clone(&self.known), self.correction)
    }

    /// The water that it was taken in.
    pub fn water(&self) -> &WaterFile {
        &self.water.file
    }

    /// What it shows of the target.
    pub fn sight(&self) -> &Sight {
        self.known.sight()
    }

    /// From where the earlier pictures are that it has in mind, rising, m.
    pub fn earlier_m(&self) -> Vec<f64> {
        self.known.earlier_m()
    }

    /// Where it was taken.
    pub fn here(&self) -> Candidate {
        self.here
    }

    /// How deep it was taken, m.
    pub fn depth_m(&self) -> f64 {
        self.depth_m
    }

    /// Its published contrast, 8-bit counts, as it would be with the noise of the water file's pictures.
    pub fn measured(&self) -> [f64; 3] {
        self.measured
    }

    /// Per channel why nothing can be said of the target, if so.
    pub fn unknown(&self) -> [Option<Unknown>; 3] {
        self.unknown
    }

    /// Which channels are told.
    pub fn told(&self) -> [bool; 3] {
        self.unknown.map(|unknown| unknown.is_none())
    }

    /// Contrast at a candidate with its standard error. Channels that are not told have the picture's contrast everywhere, so that
    /// they prefer no place.
    pub fn contrast(&self, candidate: &Candidate) -> Contrast {
        let mut found = self.predictor().contrast(candidate);
        found.counts = self.filled(found.counts);
        found
    }

    /// The same to some hundredths of a count and without the error, in a fraction of a microsecond.
    pub fn quick_contrast(&self, candidate: &Candidate) -> [f64; 3] {
        self.filled(self.sheet.at(candidate))
    }

    fn filled(&self, counts: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|k| match self.unknown[k] {
            None => counts[k],
            Some(_) => self.measured[k],
        })
    }

    /// Whether it was taken at another place than `at`, under the same daylight.
    pub fn is_elsewhere(&self, at: &Candidate, depth_m: f64) -> bool {
        let other = (self.here.distance_m / at.distance_m).ln().abs() > ELSEWHERE_LOG
            || (self.here.light_pct - at.light_pct).abs() > ELSEWHERE_PCT;
        other && (self.depth_m - depth_m).abs() <= SAME_DEPTH_M
    }

    /// What this picture predicts for a place, less what was measured there; `None` where no channel tells.
    pub fn residual_at(&self, at: &Candidate, measured: [f64; 3]) -> Option<Residual> {
        // What was seen from there comes back as it was, whatever the water.
        let found = self.predictor().without_earlier().contrast(at);
        let told = self.told();
        let uneven = self.known.unevenness();
        let part = share_of_part(self.here.distance_m, at.distance_m);
        let predicted = |k: usize| {
            let (counts, error) = (found.counts[k], found.error_counts[k]);
            told[k].then_some((counts, error.hypot(part * uneven[k] * counts)))
        };
        residual([0, 1, 2].map(predicted), measured, ResidualFrom::Picture)
    }

    /// The mean counts that this picture predicts for `present`, less those that it has: of the part of the target that both show, else of
    /// the whole picture. `None` where no channel of both tells.
    pub fn brightness_at(&self, present: &Self) -> Option<Brightness> {
        let sensor = &self.water.file.sensor;
        let sensor = Sensor {
            encoding: sensor.encoding,
            half_view: self.water.file.tables.half_view[0],
        };
        let (earlier, now) = (self.predictor(), present.predictor());
        brightness::brightness(&self.look(&earlier), &present.look(&now), &sensor)
    }

    /// This picture as its brightness is compared.
    fn look<'p>(&self, predictor: &'p Predictor) -> Look<'p> {
        let farther_m = self.here.distance_m * (1.0 + brightness::STEP);
        let noise = self.water.file.sensor.noise();
        Look {
            blocks: self.blocks.clone(),
            distance_m: self.here.distance_m,
            seen: [self.here.distance_m, farther_m]
                .map(|distance_m| predictor.seen(distance_m, self.here.light_pct)),
            useless: predictor.without_mean(),
            spread: predictor.spread(),
            noise: LinearNoise {
                a: noise.a / self.stored_share,
                b: noise.b / (self.stored_share * self.stored_share),
            },
        }
    }

    /// What the sights of the water file alone predict for this picture, less what it has; `None` where they tell no channel.
    pub fn residual_of_sights(&self) -> Option<Residual> {
        let found = self.predictor().of_sights(&self.here);
        residual(found, self.measured, ResidualFrom::Sights)
    }

    /// The contrast that is predicted for the very place of the picture, 8-bit counts, where that is not the picture's: the sensor is not
    /// the water file's.
    pub fn unexplained(&self) -> Option<[f64; 3]> {
        (contrast_misfit(self.predicted, self.measured) > 1.0).then_some(self.predicted)
    }
}

/// How much of the unevenness of a target's detail from patch to patch is left in the mean over a part of it that is seen from one
/// of two distances alone.
fn share_of_part(one_m: f64, other_m: f64) -> f64 {
    let share = (one_m / other_m).min(other_m / one_m).powi(2);
    let patches = INDEPENDENT_PATCHES * share;
    (1.0 - share * share).max(0.0).sqrt() / patches.max(1.0).sqrt()
}

/// The residual of predictions and their errors, per channel that is told.
fn residual(
    predicted: [Option<(f64, f64)>; 3],
    measured: [f64; 3],
    from: ResidualFrom,
) -> Option<Residual> {
    let errors =
        predicted.map(|told| told.map_or(0.0, |(counts, error)| error.hypot(OTHER_PART * counts)));
    let counts: [Option<f64>; 3] =
        std::array::from_fn(|k| predicted[k].map(|(counts, _)| counts - measured[k]));
    let misfits = (0..3).filter_map(|k| Some(counts[k]?.abs() / (MOST_ERRORS * errors[k])));
    let misfit = misfits.reduce(f64::max)?;
    Some(Residual {
        counts,
        error_counts: errors,
        brightness: None,
        misfit,
        from,
    })
}

impl Residual {
    /// With the comparison of mean counts, whose misfit counts as well.
    #[must_use]
    pub fn and(self, brightness: Option<Brightness>) -> Self {
        Self {
            brightness,
            misfit: brightness.map_or(self.misfit, |found| self.misfit.max(found.misfit())),
            ..self
        }
    }
}

impl Brightness {
    /// The largest of the channels in units of three standard errors.
    pub fn misfit(&self) -> f64 {
        let of = |k: usize| Some(self.counts[k]?.abs() / (MOST_ERRORS * self.error_counts[k]));
        (0..3).filter_map(of).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests;
