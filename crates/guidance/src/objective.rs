//! One score for a candidate: predicted contrast against coverage.
//!
//! score = lambda_c · m_c + lambda_d · m_d. m_c is the predicted contrast in units of `contrast_scale`, as
//! the sum or the mean over the channels. m_d = exp(-(d - b)² / (2 c²)) prefers the distance d = b, where
//!
//! - b(d) = sqrt(Σ K_c(d)) · kappa_b / (z or 1 + z/2), in m, with K_c the lights-off profile at the
//!   candidate's distance d in units of `contrast_scale` and z the depth in m;
//! - c = mean(K_z(z))² / kappa_c, in m.
//!
//! The form "overlap" replaces it: score = visibility · overlap, for surveys whose consecutive views have to be matched.
//! Visibility m_c^p/(m_c^p + h^p) is the share of features that are found again: noise drowns what has little contrast,
//! and more contrast than needed gains nothing. Overlap 1 - d_0/d is the share of a view that the next one shows, with
//! d_0 the distance at which consecutive views only touch: step / (2 tan(half the field of view along the track)).
//!
//! Three presets: "release" with the constants and forms of the published method's released script, and
//! "paper" with the sum over channels and the plain z of its text, "tracking" with the form "overlap". (The script looks K_c up by truncation,
//! which makes b a step function; here it is interpolated.)

use uw_calib::json::{FieldError, Object};
use uw_calib::{ContrastSample, Profile};

/// m_c: how the channels' contrasts become one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContrastTerm {
    /// Their sum.
    Sum,
    /// Their mean.
    Mean,
}

/// Denominator of b.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthTerm {
    /// z: b is infinite at the surface, where the distance term is therefore 0.
    Z,
    /// 1 + z/2.
    OnePlusHalfZ,
}

/// How contrast and distance become one score.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// The weighted sum of contrast term and distance term.
    Sum,
    /// Visibility times overlap of consecutive views.
    Overlap,
}

/// Weights, forms and bounds of the score.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Objective {
    /// Weight of the contrast term, >= 0.
    pub lambda_c: f64,
    /// Weight of the distance term, >= 0.
    pub lambda_d: f64,
    /// Factor of the preferred distance b, m, > 0.
    pub kappa_b: f64,
    /// Divisor of the width c, 1/m, > 0.
    pub kappa_c: f64,
    /// Form of the contrast term.
    pub contrast: ContrastTerm,
    /// Unit of contrast in both terms, 8-bit counts, > 0.
    pub contrast_scale: f64,
    /// Form of the denominator of b.
    pub depth_term: DepthTerm,
    /// How the terms become one score.
    pub form: Form,
    /// h of the form [`Form::Overlap`]: m_c at which half of the features are found again, > 0.
    pub half_contrast: f64,
    /// p of the form [`Form::Overlap`]: how sharply features drown below h, > 0.
    pub sharpness: f64,
    /// d_0 of the form [`Form::Overlap`]: distance at which consecutive views only touch, m, >= 0.
    pub touch_distance_m: f64,
    /// Smallest and largest distance of a candidate, m.
    pub distance_m: [f64; 2],
    /// Smallest and largest lamp level of a candidate, percent.
    pub light_pct: [f64; 2],
}

/// Fields of an objective in a request or a configuration.
const FIELDS: [&str; 14] = [
    "preset",
    "lambda_c",
    "lambda_d",
    "kappa_b",
    "kappa_c",
    "contrast",
    "contrast_scale",
    "depth_term",
    "form",
    "half_contrast",
    "sharpness",
    "touch_distance_m",
    "distance_m",
    "light_pct",
];

impl Default for Objective {
    fn default() -> Self {
        Self::release()
    }
}

impl Objective {
    /// Preset "release", the default.
    pub fn release() -> Self {
        Self {
            lambda_c: 0.65,
            lambda_d: 1.0,
            kappa_b: 3.5,
            kappa_c: 1.5,
            contrast: ContrastTerm::Mean,
            contrast_scale: 15.0,
            depth_term: DepthTerm::OnePlusHalfZ,
            form: Form::Sum,
            half_contrast: 0.4,
            sharpness: 3.0,
            touch_distance_m: 0.433,
            distance_m: [0.5, 3.0],
            light_pct: [0.0, 100.0],
        }
    }

    /// Preset "paper": the same constants, with the sum weighted so that it equals the mean's 0.65.
    pub fn paper() -> Self {
        Self {
            lambda_c: 0.65 / 3.0,
            contrast: ContrastTerm::Sum,
            depth_term: DepthTerm::Z,
            ..Self::release()
        }
    }

    /// Preset "tracking": views that can be matched with the next one, half a metre on with a field of view of 60°.
    pub fn tracking() -> Self {
        Self {
            form: Form::Overlap,
            ..Self::release()
        }
    }

    /// This objective with the fields of `overrides` over it; a `preset` among them is taken first.
    pub fn with(&self, overrides: &Object) -> Result<Self, FieldError> {
        overrides.only(&FIELDS)?;
        let mut o = match choice(overrides, "preset", &["release", "paper", "tracking"])? {
            Some(0) => Self::release(),
            Some(1) => Self::paper(),
            Some(_) => Self::tracking(),
            None => *self,
        };
        set(overrides, "lambda_c", &mut o.lambda_c)?;
        set(overrides, "lambda_d", &mut o.lambda_d)?;
        set(overrides, "kappa_b", &mut o.kappa_b)?;
        set(overrides, "kappa_c", &mut o.kappa_c)?;
        set(overrides, "contrast_scale", &mut o.contrast_scale)?;
        if let Some(k) = choice(overrides, "contrast", &["sum", "mean"])? {
            o.contrast = [ContrastTerm::Sum, ContrastTerm::Mean][k];
        }
        if let Some(k) = choice(overrides, "depth_term", &["z", "1+z/2"])? {
            o.depth_term = [DepthTerm::Z, DepthTerm::OnePlusHalfZ][k];
        }
        if let Some(k) = choice(overrides, "form", &["sum", "overlap"])? {
            o.form = [Form::Sum, Form::Overlap][k];
        }
        set(overrides, "half_contrast", &mut o.half_contrast)?;
        set(overrides, "sharpness", &mut o.sharpness)?;
        set(overrides, "touch_distance_m", &mut o.touch_distance_m)?;
        if overrides.get("distance_m").is_some() {
            o.distance_m = overrides.numbers("distance_m")?;
        }
        if overrides.get("light_pct").is_some() {
            o.light_pct = overrides.numbers("light_pct")?;
        }
        o.check(overrides)?;
        Ok(o)
    }

    fn check(&self, named: &Object) -> Result<(), FieldError> {
        let not_negative = [
            ("lambda_c", self.lambda_c),
            ("lambda_d", self.lambda_d),
            ("touch_distance_m", self.touch_distance_m),
        ];
        for (name, value) in not_negative {
            if value < 0.0 {
                return Err(FieldError::out_of_range(named.path_of(name), ">= 0", value));
            }
        }
        let positive = [
            ("kappa_b", self.kappa_b),
            ("kappa_c", self.kappa_c),
            ("contrast_scale", self.contrast_scale),
            ("half_contrast", self.half_contrast),
            ("sharpness", self.sharpness),
        ];
        for (name, value) in positive {
            if value <= 0.0 {
                return Err(FieldError::out_of_range(named.path_of(name), "> 0", value));
            }
        }
        let [near, far] = self.distance_m;
        if !(0.0 < near && near <= far) {
            let got = format!("[{near}, {far}]");
            let expected = "[smallest, largest] in m with 0 < smallest <= largest";
            return Err(FieldError::out_of_range(
                named.path_of("distance_m"),
                expected,
                got,
            ));
        }
        let [dim, bright] = self.light_pct;
        if !(0.0 <= dim && dim <= bright && bright <= 100.0) {
            let got = format!("[{dim}, {bright}]");
            let expected = "[smallest, largest] in percent with 0 <= smallest <= largest <= 100";
            return Err(FieldError::out_of_range(
                named.path_of("light_pct"),
                expected,
                got,
            ));
        }
        Ok(())
    }
}

fn set(overrides: &Object, name: &str, field: &mut f64) -> Result<(), FieldError> {
    if overrides.get(name).is_some() {
        *field = overrides.number(name)?;
    }
    Ok(())
}

fn choice(overrides: &Object, name: &str, known: &[&str]) -> Result<Option<usize>, FieldError> {
    if overrides.get(name).is_none() {
        return Ok(None);
    }
    let got = overrides.text(name)?;
    match known.iter().position(|&k| k == got) {
        Some(k) => Ok(Some(k)),
        None => {
            let expected = format!("one of {}", known.join(", "));
            Err(FieldError::invalid(
                overrides.path_of(name),
                expected,
                format!("{got:?}"),
            ))
        }
    }
}

/// What a score is made of: of the form "sum" the two weighted terms, which add up to it, of the form "overlap"
/// visibility and overlap, whose product it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms {
    /// lambda_c · m_c, or the visibility.
    pub contrast: f64,
    /// lambda_d · m_d, or the overlap.
    pub distance: f64,
}

/// The objective at one depth in one water, ready for many candidates.
#[derive(Clone, Copy, Debug)]
pub struct Criterion<'a> {
    objective: &'a Objective,
    contrast_off: &'a [ContrastSample],
    /// b = `factor_m` · sqrt(Σ K_c / contrast_scale); infinite at the surface with [`DepthTerm::Z`].
    factor_m: f64,
    /// c.
    width_m: f64,
}

impl<'a> Criterion<'a> {
    /// The objective for a depth and the K_z there. Without a profile the distance term of [`Form::Sum`] has no meaning; [`Form::Overlap`] asks for
    /// neither.
    pub fn new(
        objective: &'a Objective,
        profile: impl Into<Option<&'a Profile>>,
        depth_m: f64,
        k_z: [f64; 3],
    ) -> Self {
        let denominator = match objective.depth_term {
            DepthTerm::Z => depth_m,
            DepthTerm::OnePlusHalfZ => 1.0 + 0.5 * depth_m,
        };
        let mean_k_z = k_z.iter().sum::<f64>() / 3.0;
        Self {
            objective,
            contrast_off: profile.into().map_or(&[], Profile::contrast_off),
            factor_m: objective.kappa_b / denominator,
            width_m: mean_k_z * mean_k_z / objective.kappa_c,
        }
    }

    /// lambda_c · m_c + lambda_d · m_d, or visibility · overlap; NaN where the contrast is.
    pub fn score(&self, contrast: [f64; 3], distance_m: f64) -> f64 {
        let terms = self.terms(contrast, distance_m);
        match self.objective.form {
            Form::Sum => terms.contrast + terms.distance,
            Form::Overlap => terms.contrast * terms.distance,
        }
    }

    /// What the score is made of.
    pub fn terms(&self, contrast: [f64; 3], distance_m: f64) -> Terms {
        let sum = contrast.iter().sum::<f64>() / self.objective.contrast_scale;
        let m_c = match self.objective.contrast {
            ContrastTerm::Sum => sum,
            ContrastTerm::Mean => sum / 3.0,
        };
        let m_d = self.distance_term(distance_m);
        match self.objective.form {
            Form::Sum => Terms {
                contrast: self.objective.lambda_c * m_c,
                distance: self.objective.lambda_d * m_d,
            },
            Form::Overlap => Terms {
                contrast: self.visibility(m_c),
                distance: m_d,
            },
        }
    }

    /// Share of features that are found again, in [0, 1); NaN where the contrast is.
    fn visibility(&self, m_c: f64) -> f64 {
        // A predicted contrast below 0 is none.
        let ratio = if m_c < 0.0 { 0.0 } else { m_c } / self.objective.half_contrast;
        // 1 - 1/(1 + ratio^p), which also a ratio to the power of infinity takes to 1.
        1.0 - 1.0 / (1.0 + ratio.powf(self.objective.sharpness))
    }

    /// m_d or the overlap, in [0, 1]; m_d is 0 where b is infinite or the width c is 0.
    pub fn distance_term(&self, distance_m: f64) -> f64 {
        if self.objective.form == Form::Overlap {
            return (1.0 - self.objective.touch_distance_m / distance_m).max(0.0);
        }
        let offset_m = distance_m - self.preferred_distance_m(distance_m);
        if offset_m.is_finite() && self.width_m > 0.0 {
            (-0.5 * (offset_m / self.width_m).powi(2)).exp()
        } else {
            0.0
        }
    }

    /// b at a candidate's distance, m.
    pub fn preferred_distance_m(&self, distance_m: f64) -> f64 {
        let (alpha, beta) = self.line_at(distance_m);
        self.factor_m * (alpha + beta * distance_m).max(0.0).sqrt()
    }

    /// c, m; 0 of the form [`Form::Overlap`], which has no ridge.
    pub fn width_m(&self) -> f64 {
        match self.objective.form {
            Form::Sum => self.width_m,
            Form::Overlap => 0.0,
        }
    }

    /// Distances in [min, max] where the distance term has a peak or a kink: solutions of d = b(d), points
    /// of least |d - b(d)| and samples of the profile. Between two samples Σ K_c is linear in d, so these
    /// follow from quadratic equations.
    pub fn peaks_m(&self, min_m: f64, max_m: f64) -> Vec<f64> {
        let mut peaks: Vec<f64> = Vec::new();
        if !self.factor_m.is_finite() || self.objective.form == Form::Overlap {
            return peaks;
        }
        for pair in self.contrast_off.windows(2) {
            let (from, to) = (pair[0].distance_m.max(min_m), pair[1].distance_m.min(max_m));
            if from > to {
                continue;
            }
            let (alpha, beta) = self.line(pair);
            let slope = self.factor_m * self.factor_m * beta;
            let root = (slope * slope + 4.0 * self.factor_m * self.factor_m * alpha).sqrt();
            let steepest = ((self.factor_m * beta / 2.0).powi(2) - alpha) / beta;
            let candidates = [
                0.5 * (slope + root),
                0.5 * (slope - root),
                steepest,
                from,
                to,
            ];
            peaks.extend(candidates.into_iter().filter(|d| (from..=to).contains(d)));
        }
        peaks.sort_by(f64::total_cmp);
        peaks.dedup();
        peaks
    }

    /// Σ K_c / contrast_scale = alpha + beta · d between the two samples around a distance.
    fn line_at(&self, distance_m: f64) -> (f64, f64) {
        let after = self
            .contrast_off
            .partition_point(|s| s.distance_m <= distance_m);
        match self.contrast_off.len() {
            0 => (0.0, 0.0),
            1 => (self.level(&self.contrast_off[0]), 0.0),
            n => {
                let first = after.clamp(1, n - 1) - 1;
                self.line(&self.contrast_off[first..first + 2])
            }
        }
    }

    fn line(&self, pair: &[ContrastSample]) -> (f64, f64) {
        let (y0, y1) = (self.level(&pair[0]), self.level(&pair[1]));
        let beta = (y1 - y0) / (pair[1].distance_m - pair[0].distance_m);
        (y0 - beta * pair[0].distance_m, beta)
    }

    fn level(&self, sample: &ContrastSample) -> f64 {
        sample.k_c.iter().sum::<f64>() / self.objective.contrast_scale
    }
}

#[cfg(test)]
mod tests;
