//! Why there is no advice, or why it has limits.

use uw_calib::ProfileError;
use uw_calib::json::FieldError;

use crate::checks::Residual;
use crate::objective::{Form, Objective};
use crate::observation::Quality;
use crate::physics::{Residual as PhysicalResidual, ResidualFrom, Unknown};
use uw_calib::detail::channel_names;

/// Why there is no advice, why it is to stay, or what limits it.
#[derive(Clone, Debug, PartialEq)]
pub enum Reason {
    /// The observation holds an impossible value.
    BadObservation(FieldError),
    /// The observation, or a candidate asked for, is outside the calibrated range.
    OutsideCalibration {
        /// Name of the value, such as `depth_m`.
        field: String,
        /// The value, m.
        value: f64,
        /// Smallest calibrated value, m.
        min: f64,
        /// Largest calibrated value, m.
        max: f64,
    },
    /// An input of the network, or a candidate asked for, is outside what the network was trained on.
    OutsideTraining {
        /// Name of the input, or of the candidate's value.
        input: String,
        /// Its unit as model files write it.
        unit: &'static str,
        /// The value.
        value: f64,
        /// Smallest and largest value in training.
        trained: [f64; 2],
        /// How far beyond them is allowed, as a share of their difference.
        margin: f64,
    },
    /// What the network predicts for no change is not what the picture has: it does not know this place.
    ModelMisfit {
        /// Predicted less measured.
        residual: Residual,
        /// Predicted for no change, 8-bit counts.
        predicted: [f64; 3],
        /// Measured, 8-bit counts.
        measured: [f64; 3],
        /// Largest misfit allowed.
        limit: f64,
    },
    /// There is no profile, and who needs one.
    NoProfile(NeedsProfile),
    /// The picture, the profile and the model are of different cameras or lamps.
    OtherCamera(String),
    /// The profile's contrasts were measured at another depth, where the water may be another.
    OtherDepth {
        /// Depth of the vehicle, m.
        depth_m: f64,
        /// Least and most depth of the pictures of the contrasts, m.
        calibrated_m: [f64; 2],
        /// How far beyond them is allowed, m.
        margin_m: f64,
    },
    /// Channels of the picture, or all of it, show no more than noise.
    NoiseFloor(Box<Quality>),
    /// More of the picture is at full scale than allowed.
    Saturated {
        /// Share of the pixels per channel, in [0, 1].
        share: [f64; 3],
        /// Largest share allowed.
        limit: f64,
    },
    /// The sun is not that which model or water file were made for.
    OtherSun(String),
    /// The target is seen obliquely.
    Oblique {
        /// Of the optical axis from the target's normal, degrees.
        angle_deg: f64,
        /// Largest angle allowed, degrees.
        limit_deg: f64,
    },
    /// The picture was compressed: what that takes off.
    Compressed(String),
    /// The picture has less noise than its sensor makes.
    Denoised(String),
    /// The picture does not state its exposure, as those of the water file did.
    UnknownExposure,
    /// The objective's distances and the calibrated (and trained) ones have nothing in common.
    NoCandidates {
        /// Distances of the objective, m.
        wanted_m: [f64; 2],
        /// Calibrated distances, m.
        calibrated_m: [f64; 2],
    },
    /// The model's predictions are not numbers anywhere.
    NotFinite,
    /// The vehicle, or a candidate asked for, is outside the tables of the water file.
    OutsideTables {
        /// Name of the value.
        field: String,
        /// The value, m.
        value: f64,
        /// Least and greatest of the tables, m.
        range_m: [f64; 2],
    },
    /// What physics predicts from elsewhere is not what the picture has: the water file does not fit this place.
    PhysicsMisfit {
        /// Predicted less measured.
        residual: Box<PhysicalResidual>,
        /// Largest misfit allowed.
        limit: f64,
    },
    /// The closed form of the sensor does not explain the contrast of the very picture that it is given.
    Unexplained {
        /// Predicted for no change, 8-bit counts.
        predicted: [f64; 3],
        /// Measured, 8-bit counts.
        measured: [f64; 3],
    },
    /// The picture does not tell the target's detail in some channels, or in none: why, per channel.
    Untold([Option<Unknown>; 3]),
    /// The calibration ends where the best distance lies, inside the objective's bounds: the advice is
    /// valid, and beyond the calibration it might be better.
    Clamped {
        /// The end of the calibrated distances, m.
        at_m: f64,
    },
    /// The best place promises too little for a move: the advice is valid, and it is to stay.
    SmallGain {
        /// Distance of the best place, m.
        distance_m: f64,
        /// Its lamp level, percent.
        light_pct: f64,
        /// Its score less that of staying.
        gain: f64,
        /// Gain that is worth a move.
        min_gain: f64,
    },
}

/// What cannot be done without a profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NeedsProfile {
    /// A network, of whose inputs it is.
    Network,
    /// An objective of the form "sum", whose distance term is made of K_z and K_c.
    Sum,
}

impl NeedsProfile {
    /// What needs one; `None` where nothing does.
    pub(crate) fn of(by_physics: bool, objective: &Objective) -> Option<Self> {
        match (by_physics, objective.form) {
            (false, _) => Some(Self::Network),
            (true, Form::Sum) => Some(Self::Sum),
            (true, Form::Overlap) => None,
        }
    }
}

impl Reason {
    /// A short name for programs.
    pub fn name(&self) -> &'static str {
        match self {
            Self::BadObservation(_) => "bad_observation",
            Self::OutsideCalibration { .. } => "outside_calibration",
            Self::OutsideTraining { .. } => "outside_training",
            Self::ModelMisfit { .. } => "model_misfit",
            Self::NoProfile(_) => "no_profile",
            Self::OtherCamera(_) => "other_camera",
            Self::OtherDepth { .. } => "other_depth",
            Self::NoiseFloor(_) => "noise_floor",
            Self::Saturated { .. } => "saturated",
            Self::OtherSun(_) => "other_sun",
            Self::Oblique { .. } => "oblique",
            Self::Compressed(_) => "compressed",
            Self::Denoised(_) => "denoised",
            Self::UnknownExposure => "unknown_exposure",
            Self::NoCandidates { .. } => "no_candidates",
            Self::NotFinite => "not_finite",
            Self::OutsideTables { .. } => "outside_tables",
            Self::PhysicsMisfit { .. } | Self::Unexplained { .. } => "model_misfit",
            Self::Untold(unknown) => match first(unknown) {
                Unknown::Clipped => "saturated",
                Unknown::Noise => "noise_floor",
                Unknown::Light => "other_light",
            },
            Self::Clamped { .. } => "clamped",
            Self::SmallGain { .. } => "small_gain",
        }
    }

    /// Whether advice with this reason is valid all the same.
    pub fn is_valid(&self) -> bool {
        matches!(self, Self::Clamped { .. } | Self::SmallGain { .. })
    }
}

impl std::fmt::Display for Reason {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::BadObservation(error) => error.fmt(f),
            Self::NoProfile(NeedsProfile::Network) => {
                f.write_str("no calibration profile is loaded; send set_profile")
            }
            Self::NoProfile(NeedsProfile::Sum) => f.write_str(
                "no calibration profile is loaded, and an objective of the form \"sum\" is made of its K_z and K_c: send set_profile, or ask for the preset \"tracking\", which by physics needs none",
            ),
            Self::OutsideCalibration {
                field,
                value,
                min,
                max,
            } => {
                write!(
                    f,
                    "{field} must be between {min:?} and {max:?} m (calibrated), got {value}"
                )
            }
            Self::OutsideTraining {
                input,
                unit,
                value,
                trained: [min, max],
                margin,
            } => {
                let unit = match *unit {
                    "8bit_counts" => " 8-bit counts",
                    "1" => "",
                    "m" => " m",
                    other => &format!(" {other}"),
                };
                let beyond = 100.0 * margin;
                write!(
                    f,
                    "{input} must be between {} and {}{unit} (what the model was trained on), and at most {beyond} % of that range beyond, got {}",
                    short(*min),
                    short(*max),
                    short(*value)
                )
            }
            Self::ModelMisfit {
                residual,
                predicted,
                measured,
                limit,
            } => write!(
                f,
                "the model does not fit here: for no change it predicts a contrast of {} where the picture has {} (R G B, 8-bit counts), a misfit of {:.1} where {limit} is allowed",
                counts(predicted),
                counts(measured),
                residual.misfit
            ),
            Self::OtherCamera(difference) | Self::OtherSun(difference) => f.write_str(difference),
            Self::Oblique {
                angle_deg,
                limit_deg,
            } => write!(
                f,
                "the target is seen {angle_deg:.0} degrees from its normal, where predictions are for targets that are seen square on and {limit_deg} degrees are allowed: turn the vehicle towards it"
            ),
            Self::UnknownExposure => f.write_str(
                "the picture does not state time, ISO and f-number of its exposure: taken to be that of the water file's pictures",
            ),
            Self::Compressed(what) | Self::Denoised(what) => {
                write!(f, "the picture: {what}")
            }
            Self::OtherDepth {
                depth_m,
                calibrated_m: [least, most],
                margin_m,
            } => {
                let at = match least == most {
                    true => format!("{} m", short(*least)),
                    false => format!("{} to {} m", short(*least), short(*most)),
                };
                write!(
                    f,
                    "the contrasts of the profile were measured at a depth of {at}, the vehicle is {} m deep, and {} m beyond is allowed: the advice holds only where the water is the same at both; calibrate at this depth",
                    short(*depth_m),
                    short(*margin_m)
                )
            }
            Self::NoiseFloor(quality) => {
                let at_floor = quality.at_floor();
                let of = match channel_names(at_floor).filter(|_| at_floor.contains(&false)) {
                    Some(names) => format!("{names} of the picture"),
                    None => "the picture".to_owned(),
                };
                write!(
                    f,
                    "{of} shows no more than noise: the contrast without noise is {} where noise alone makes up to {} (R G B, 8-bit counts); go nearer, light more or expose longer",
                    counts(&quality.std_corrected),
                    counts(&quality.noise_floor)
                )
            }
            Self::Saturated { share, limit } => write!(
                f,
                "{} of the pixels (R G B) are at full scale where {} is allowed: contrast and mean are too small; expose less or dim the lamps",
                percent(share),
                format_args!("{} %", short(100.0 * limit))
            ),
            Self::NoCandidates {
                wanted_m: [near, far],
                calibrated_m: [min, max],
            } => write!(
                f,
                "objective.distance_m must overlap with the calibrated {min:?} to {max:?} m, got [{near}, {far}]"
            ),
            Self::NotFinite => f.write_str("the model predicts no finite contrast here"),
            Self::OutsideTables {
                field,
                value,
                range_m: [min, max],
            } => write!(
                f,
                "{field} must be between {} and {} m, which the water file knows, got {}",
                short(*min),
                short(*max),
                short(*value)
            ),
            Self::PhysicsMisfit { residual, limit } => {
                let from = match residual.from {
                    ResidualFrom::Picture => "an earlier picture of this connection",
                    ResidualFrom::Sights => "the sights of the water file",
                };
                write!(
                    f,
                    "the water file does not fit here: {from} predicts a contrast that is off by {} (standard error {}; R G B, 8-bit counts)",
                    off(&residual.counts),
                    counts(&residual.error_counts),
                )?;
                if let Some(mean) = &residual.brightness {
                    write!(
                        f,
                        " and a mean that is off by {} (standard error {})",
                        off(&mean.counts),
                        counts(&mean.error_counts)
                    )?;
                }
                write!(
                    f,
                    ", a misfit of {:.1} in units of three standard errors where {limit} is allowed",
                    residual.misfit
                )
            }
            Self::Unexplained {
                predicted,
                measured,
            } => write!(
                f,
                "the water file's sensor does not explain the picture: for no change it predicts a contrast of {} where the picture has {} (R G B, 8-bit counts)",
                counts(predicted),
                counts(measured)
            ),
            Self::Untold(unknown) => {
                let named = ["red", "green", "blue"].iter().zip(unknown);
                let told =
                    named.filter_map(|(name, reason)| Some(format!("{name}: {}", (*reason)?)));
                let told: Vec<String> = told.collect();
                write!(
                    f,
                    "the picture does not tell the target's detail; {}",
                    told.join("; ")
                )
            }
            Self::Clamped { at_m } => write!(
                f,
                "the best distance lies at the end of the calibrated range, {at_m} m"
            ),
            Self::SmallGain {
                distance_m,
                light_pct,
                gain,
                min_gain,
            } => write!(
                f,
                "staying is as good: going to the best place, {distance_m:.2} m with lamps at {light_pct:.1} %, gains {gain:.4} in score, and a move takes more than {min_gain}"
            ),
        }
    }
}

/// The reason that the others follow from: a clipped picture tells nothing of its light, and another light nothing of noise.
fn first(unknown: &[Option<Unknown>; 3]) -> Unknown {
    [Unknown::Clipped, Unknown::Light]
        .into_iter()
        .find(|reason| unknown.contains(&Some(*reason)))
        .unwrap_or(Unknown::Noise)
}

/// A number as people read it: at most three decimals.
fn short(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn percent(share: &[f64; 3]) -> String {
    let percents = share.map(|s| format!("{:.1}", 100.0 * s));
    format!("{} %", percents.join(" "))
}

fn off(counts: &[Option<f64>; 3]) -> String {
    let off = counts.map(|counts| counts.map_or("?".to_owned(), |counts| format!("{counts:+.1}")));
    off.join(" ")
}

fn counts(contrast: &[f64; 3]) -> String {
    contrast.map(|value| format!("{value:.1}")).join(" ")
}

impl From<ProfileError> for Reason {
    fn from(error: ProfileError) -> Self {
        match error {
            ProfileError::OutsideCalibration {
                what,
                value,
                min,
                max,
            } => Self::OutsideCalibration {
                field: what.to_owned(),
                value,
                min,
                max,
            },
            other => Self::BadObservation(FieldError::invalid("profile", "usable", other)),
        }
    }
}
