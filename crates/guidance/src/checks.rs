//! What advice has to pass before a vehicle may follow it.
//!
//! [`advise`](crate::advise) is the bare search; [`advise_checked`](crate::advice::advise_checked) asks first whether
//! the network knows such a place at all, and whether moving is worth it:
//!
//! 1. The picture shows more than noise, and is not clipped.
//! 2. Every input lies in the range that the network was trained on, widened by a small share of it.
//! 3. For no change at all the network predicts the contrast that the picture has. This residual costs nothing, and
//!    shows at once a sun, a texture or a lamp that training did not know.
//! 4. Only places inside the trained range are suggested.
//! 5. The gain is worth a move.

use uw_calib::detail::MAX_SATURATED;
use uw_calib::json::{FieldError, Object};
use uw_calib::stats::contrast_misfit;

use crate::mlp::Model;
use crate::observation::Quality;
use crate::reason::Reason;

/// What is done about something that does not fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strictness {
    /// The advice is not valid.
    Refuse,
    /// The advice stays valid and carries a warning.
    Warn,
    /// Nothing.
    Ignore,
}

/// Limits of advice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checks {
    /// What is done about inputs outside the range that the model was trained on; "refuse" also keeps suggestions inside.
    pub training: Strictness,
    /// How far an input may lie outside its trained range, as a share of that range, >= 0.
    pub training_margin: f64,
    /// Largest [`Residual::misfit`] at the present place, > 0.
    pub max_misfit: f64,
    /// What is done beyond it. A model that does not state its own residuals only warns, as nobody knows what is
    /// normal for it.
    pub misfit: Strictness,
    /// Score that a suggestion has to gain over staying, else the advice is to hold.
    pub min_gain: f64,
    /// What is done about pictures, profiles and models of different cameras or lamps.
    pub other_camera: Strictness,
    /// What is done at depths other than that of the profile's contrast, where the profile tells it: the water may be
    /// another.
    pub other_depth: Strictness,
    /// How far from it a depth may lie, m, >= 0.
    pub depth_margin_m: f64,
    /// What is done where a channel's contrast is at the noise floor. Where all channels are, the picture shows nothing: that is
    /// refused unless this is [`Strictness::Ignore`].
    pub noise_floor: Strictness,
    /// What is done where a channel is clipped.
    pub saturation: Strictness,
    /// Largest share of a channel's pixels at full scale, in [0, 1].
    pub max_saturated: f64,
    /// What is done under a sun that model or water file do not know, where a request tells its sun.
    pub other_sun: Strictness,
    /// What is done before a target that is seen obliquely, where beams tell.
    pub oblique: Strictness,
    /// Largest angle between the optical axis and the target's normal, degrees, in [0, 90].
    pub max_obliqueness_deg: f64,
    /// What is done about a picture that was compressed or denoised before it was stored, or does not state its exposure where that is asked for.
    pub processing: Strictness,
    /// Whether suggestions lie on whole centimetres and tenths of a percent, as far as the bounds allow.
    pub round: bool,
}

impl Default for Checks {
    /// See `docs/daemon.md` for the reasons.
    fn default() -> Self {
        Self {
            training: Strictness::Refuse,
            training_margin: 0.05,
            max_misfit: 1.0,
            misfit: Strictness::Refuse,
            min_gain: 0.02,
            other_camera: Strictness::Refuse,
            other_depth: Strictness::Warn,
            depth_margin_m: 0.5,
            noise_floor: Strictness::Warn,
            saturation: Strictness::Warn,
            max_saturated: MAX_SATURATED,
            other_sun: Strictness::Warn,
            oblique: Strictness::Warn,
            max_obliqueness_deg: 35.0,
            processing: Strictness::Warn,
            round: true,
        }
    }
}

impl Checks {
    /// No checks: the bare search.
    pub fn none() -> Self {
        Self {
            training: Strictness::Ignore,
            training_margin: 0.0,
            max_misfit: f64::INFINITY,
            misfit: Strictness::Ignore,
            min_gain: f64::NEG_INFINITY,
            other_camera: Strictness::Ignore,
            other_depth: Strictness::Ignore,
            depth_margin_m: 0.0,
            noise_floor: Strictness::Ignore,
            saturation: Strictness::Ignore,
            max_saturated: 1.0,
            other_sun: Strictness::Ignore,
            oblique: Strictness::Ignore,
            max_obliqueness_deg: 90.0,
            processing: Strictness::Ignore,
            round: false,
        }
    }

    /// These checks with the fields of `overrides` over them.
    pub fn with(&self, overrides: &Object) -> Result<Self, FieldError> {
        overrides.only(&[
            "training",
            "training_margin",
            "max_misfit",
            "misfit",
            "min_gain",
            "other_camera",
            "other_depth",
            "depth_margin_m",
            "noise_floor",
            "saturation",
            "max_saturated",
            "other_sun",
            "oblique",
            "max_obliqueness_deg",
            "processing",
        ])?;
        let mut checks = *self;
        let number = |name: &str, zero_allowed: bool, value: &mut f64| {
            if overrides.get(name).is_none() {
                return Ok(());
            }
            let given = overrides.number(name)?;
            if given < 0.0 || (given == 0.0 && !zero_allowed) {
                let expected = if zero_allowed { ">= 0" } else { "> 0" };
                return Err(FieldError::out_of_range(
                    overrides.path_of(name),
                    expected,
                    given,
                ));
            }
            *value = given;
            Ok(())
        };
        number("training_margin", true, &mut checks.training_margin)?;
        number("max_misfit", false, &mut checks.max_misfit)?;
        number("min_gain", true, &mut checks.min_gain)?;
        number("depth_margin_m", true, &mut checks.depth_margin_m)?;
        let limits = [
            (
                "max_saturated",
                (1.0, "from 0 to 1, a share of the pixels"),
                &mut checks.max_saturated,
            ),
            (
                "max_obliqueness_deg",
                (90.0, "from 0 to 90 degrees"),
                &mut checks.max_obliqueness_deg,
            ),
        ];
        for (name, (most, expected), value) in limits {
            number(name, true, value)?;
            if *value > most {
                let path = overrides.path_of(name);
                return Err(FieldError::out_of_range(path, expected, *value));
            }
        }
        for (name, value) in [
            ("training", &mut checks.training),
            ("misfit", &mut checks.misfit),
            ("other_camera", &mut checks.other_camera),
            ("other_depth", &mut checks.other_depth),
            ("noise_floor", &mut checks.noise_floor),
            ("saturation", &mut checks.saturation),
            ("other_sun", &mut checks.other_sun),
            ("oblique", &mut checks.oblique),
            ("processing", &mut checks.processing),
        ] {
            if overrides.get(name).is_some() {
                *value = Strictness::read(overrides, name)?;
            }
        }
        Ok(checks)
    }

    /// Why a target that is seen at `obliqueness_deg` from its normal, where that is known, is not what predictions are made for.
    pub(crate) fn oblique(&self, obliqueness_deg: Option<f64>) -> Option<Reason> {
        let limit_deg = self.max_obliqueness_deg;
        let angle_deg = obliqueness_deg.filter(|angle_deg| *angle_deg > limit_deg)?;
        Some(Reason::Oblique {
            angle_deg,
            limit_deg,
        })
    }

    /// What is wrong with a picture, and what is done about it.
    pub(crate) fn doubts(&self, quality: &Quality) -> Vec<(Strictness, Reason)> {
        let mut doubts = Vec::new();
        let at_floor = quality.at_floor();
        if self.noise_floor != Strictness::Ignore && at_floor.contains(&true) {
            let strictness = match at_floor.contains(&false) {
                true => self.noise_floor,
                false => Strictness::Refuse,
            };
            doubts.push((strictness, Reason::NoiseFloor(Box::new(*quality))));
        }
        let limit = self.max_saturated;
        if self.saturation != Strictness::Ignore && quality.saturated.iter().any(|&s| s > limit) {
            let share = quality.saturated;
            doubts.push((self.saturation, Reason::Saturated { share, limit }));
        }
        if self.processing != Strictness::Ignore {
            let compressed = quality.processing.compressed().map(Reason::Compressed);
            let denoised = quality.processing.denoised().map(Reason::Denoised);
            let unknown = quality.processing.unknown_exposure;
            let unknown = unknown.then_some(Reason::UnknownExposure);
            let found = compressed.into_iter().chain(denoised).chain(unknown);
            doubts.extend(found.map(|reason| (self.processing, reason)));
        }
        doubts
    }

    /// What is done when `model` misses the picture by more than allowed.
    pub(crate) fn misfit_of(&self, model: &Model) -> Strictness {
        match (self.misfit, model.card().training.residual_here) {
            (Strictness::Refuse, None) => Strictness::Warn,
            (strictness, _) => strictness,
        }
    }
}

impl Strictness {
    const NAMES: [(&str, Self); 3] = [
        ("refuse", Self::Refuse),
        ("warn", Self::Warn),
        ("ignore", Self::Ignore),
    ];

    /// The stricter of two.
    pub(crate) fn stricter(self, other: Self) -> Self {
        match (self, other) {
            (Self::Refuse, _) | (_, Self::Refuse) => Self::Refuse,
            (Self::Warn, _) | (_, Self::Warn) => Self::Warn,
            (Self::Ignore, Self::Ignore) => Self::Ignore,
        }
    }

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Refuse => "refuse",
            Self::Warn => "warn",
            Self::Ignore => "ignore",
        }
    }

    fn read(object: &Object, name: &str) -> Result<Self, FieldError> {
        let given = object.text(name)?;
        let known = Self::NAMES.iter().find(|(known, _)| *known == given);
        known.map(|&(_, strictness)| strictness).ok_or_else(|| {
            let expected = "one of refuse, warn, ignore";
            FieldError::invalid(object.path_of(name), expected, format!("{given:?}"))
        })
    }
}

/// What the network predicts for no change, less what the picture has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    /// Per channel, 8-bit counts.
    pub counts: [f64; 3],
    /// The largest of the channels in units of what is allowed, 0.5 counts and 10 % of the picture's contrast: above 1
    /// the network does not know this place.
    pub misfit: f64,
}

impl Residual {
    /// Of a prediction for no change against the measured contrast, both 8-bit counts. The misfit is NaN where the
    /// prediction is.
    pub fn new(predicted: [f64; 3], measured: [f64; 3]) -> Self {
        Self {
            counts: std::array::from_fn(|k| predicted[k] - measured[k]),
            misfit: contrast_misfit(predicted, measured),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn the_worst_channel_counts() {
        let residual = Residual::new([4.0, 9.6, 11.1], [3.4, 6.2, 7.1]);
        assert!((residual.misfit - 4.0 / 1.21).abs() < 1e-9, "{residual:?}");
        assert_eq!(Residual::new([5.0; 3], [5.0; 3]).misfit, 0.0);
        assert!(
            Residual::new([5.0, f64::NAN, 5.0], [5.0; 3])
                .misfit
                .is_nan()
        );
    }

    #[test]
    fn fields_lie_over_the_defaults_and_wrong_ones_are_named() {
        let read = |value: serde_json::Value| {
            Checks::default().with(&Object::new(&value, "checks").unwrap())
        };
        let checks = read(json!({"misfit": "warn", "min_gain": 0})).unwrap();
        assert_eq!(
            (checks.misfit, checks.min_gain, checks.max_misfit),
            (Strictness::Warn, 0.0, 1.0)
        );
        for (value, field) in [
            (json!({"misfit": "loud"}), "checks.misfit"),
            (json!({"min_gain": -1}), "checks.min_gain"),
            (json!({"max_misfit": 0}), "checks.max_misfit"),
            (json!({"max_saturated": 2}), "checks.max_saturated"),
            (json!({"margin": 0}), "checks.margin"),
        ] {
            assert_eq!(read(value).unwrap_err().field, field);
        }
    }
}
