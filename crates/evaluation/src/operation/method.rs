//! How the methods choose distance and lamp level at a place.

use std::sync::Arc;

use uw_calib::picture::Counts as Picture;
use uw_calib::{ImageStats, Profile};
use uw_guidance::advice::{By, Physical, advise_by};
use uw_guidance::features::Candidate;
use uw_guidance::objective::{Criterion, Objective};
use uw_guidance::physics::{Earlier, Present, Water};
use uw_guidance::{Advice, Checks, Model, Observation, Reason, advise};
use uw_render::image::{Counts, Frame};

use super::config::PUBLISHED_PATTERNS;
use super::truth::Truth;
use super::twin::WaterFrom;
use crate::error::EvalError;
use crate::niqe::{NiqeError, Pristine, niqe};
use crate::vision::GreyImage;
use crate::vision::sobel::mean_gradient_y;

/// A method.
#[derive(Clone, Debug, PartialEq)]
pub enum Method {
    /// The guidance with a preset of its objective, by name.
    Guidance(String, Objective),
    /// The twin: physics from a water file, with a preset of the objective, by name.
    Twin(WaterFrom, String, Objective),
    /// Tries every candidate on the true images with the objective of a preset.
    Oracle(String, Objective),
    /// Holds a value of an image metric.
    Hold(Metric),
    /// A set distance and lamp level.
    Pattern(Candidate),
}

/// A metric that a method holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Metric {
    /// NIQE.
    Niqe,
    /// Mean vertical Sobel gradient.
    MeanGradient,
}

impl Method {
    /// Name in tables.
    pub fn name(&self) -> String {
        match self {
            Self::Guidance(preset, _) => format!("proposed ({preset})"),
            Self::Twin(WaterFrom::Fit, preset, _) => format!("twin ({preset})"),
            Self::Twin(WaterFrom::File, preset, _) => format!("twin, water file ({preset})"),
            Self::Oracle(preset, _) => format!("oracle ({preset})"),
            Self::Hold(Metric::Niqe) => "NIQE".into(),
            Self::Hold(Metric::MeanGradient) => "gradient".into(),
            Self::Pattern(set) if PUBLISHED_PATTERNS.contains(set) => {
                format!("{} m pattern", set.distance_m)
            }
            Self::Pattern(set) => format!("{} m, {} % pattern", set.distance_m, set.light_pct),
        }
    }

    /// Whether it advises, by network or physics.
    pub fn is_guidance(&self) -> bool {
        matches!(self, Self::Guidance(..) | Self::Twin(..))
    }

    /// All methods of an evaluation with these presets, waters of the twin and set pairs.
    pub fn all(
        presets: &[(String, Objective)],
        twins: &[WaterFrom],
        patterns: &[Candidate],
    ) -> Vec<Self> {
        let guided = presets
            .iter()
            .map(|(name, objective)| Self::Guidance(name.clone(), *objective));
        let twins = twins.iter().flat_map(|from| {
            let of = |(name, objective): &(String, Objective)| {
                Self::Twin(*from, name.clone(), *objective)
            };
            presets.iter().map(of)
        });
        let oracles = presets
            .iter()
            .map(|(name, objective)| Self::Oracle(name.clone(), *objective));
        let held = [Metric::Niqe, Metric::MeanGradient].map(Self::Hold);
        let patterns = patterns.iter().map(|pair| Self::Pattern(*pair));
        (guided.chain(twins).chain(held).chain(patterns))
            .chain(oracles)
            .collect()
    }
}

impl Metric {
    /// The metric of an image.
    pub fn of(
        self,
        image: &GreyImage,
        pristine: &Pristine,
        niqe_block_px: usize,
    ) -> Result<f64, NiqeError> {
        match self {
            Self::MeanGradient => Ok(mean_gradient_y(image)),
            Self::Niqe => {
                let (width, height) = (image.width(), image.height());
                niqe(pristine, width, height, &image.numbers(), niqe_block_px)
            }
        }
    }
}

/// What the guidance advises at `depth_m` for what `frame` shows from `current`.
pub fn guided(
    frame: &Frame,
    depth_m: f64,
    current: Candidate,
    (profile, model, objective): (&Profile, &Model, &Objective),
) -> Result<Candidate, EvalError> {
    let observation = observed(frame, depth_m, current)?;
    followed(advise(&observation, profile, model, objective), depth_m)
}

/// What the twin advises at `depth_m` for what `frame` shows from `current`, and what it saw on its way: what the daemon does with `--water`, without its
/// checks, as [`guided`] is without them.
pub fn twinned(
    frame: &Frame,
    depth_m: f64,
    current: Candidate,
    (profile, water, objective): (&Profile, &Arc<Water>, &Objective),
    (earlier, now_s): (&mut Earlier, f64),
) -> Result<Candidate, EvalError> {
    let observation = observed(frame, depth_m, current)?;
    let picture = Picture::stored(
        frame.width as usize,
        frame.height as usize,
        frame.in_8_bit_counts(),
    );
    let place = (&current, depth_m);
    let (water, seen) = (Arc::clone(water), earlier.sights(now_s));
    let present = Present::new(water, &picture, place, observation.std, &seen);
    earlier.keep(&present, now_s);
    // How far an earlier picture's prediction is off matters to the checks alone.
    let by = By::Physics(Physical {
        present: &present,
        residual: None,
    });
    let advice = advise_by(&observation, profile, by, objective, &Checks::none());
    followed(advice, depth_m)
}

fn observed(frame: &Frame, depth_m: f64, current: Candidate) -> Result<Observation, EvalError> {
    let stats = statistics(frame)?;
    Ok(Observation {
        depth_m,
        distance_m: current.distance_m,
        light_pct: current.light_pct,
        mean: stats.mean,
        std: stats.contrast,
        quality: None,
    })
}

/// Where a vehicle goes that follows the advice. Before a picture that tells nothing it holds.
fn followed(advice: Advice, depth_m: f64) -> Result<Candidate, EvalError> {
    match advice.reason {
        Some(reason) if !reason.is_valid() && !matches!(reason, Reason::Untold(_)) => {
            let reason = reason.to_string();
            Err(EvalError::NoAdvice { depth_m, reason })
        }
        _ => Ok(Candidate {
            distance_m: advice.distance_m,
            light_pct: advice.light_pct,
        }),
    }
}

fn statistics(frame: &Frame) -> Result<ImageStats, EvalError> {
    let (width, height) = (frame.width as usize, frame.height as usize);
    let stats = match &frame.counts {
        Counts::Bits8(counts) => ImageStats::from_rgb8(width, height, counts),
        Counts::Bits16(counts) => ImageStats::from_rgb16(width, height, counts),
    };
    stats.map_err(|e| EvalError::Input(e.to_string()))
}

/// What a method that knows the true images chooses.
pub fn oracle(
    truth: &Truth,
    criterion: &Criterion,
    objective: &Objective,
    current: Candidate,
) -> Candidate {
    truth
        .best(criterion, objective.light_pct, current)
        .map_or(current, |(candidate, _)| candidate)
}

/// The candidate whose metric is nearest to the value held; of candidates equally near the first. Candidates without a
/// value (NaN) are passed over; without any the vehicle stays.
pub fn nearest_to(held: f64, candidates: &[(Candidate, f64)], current: Candidate) -> Candidate {
    candidates
        .iter()
        .filter(|(_, value)| value.is_finite())
        .min_by(|(_, x), (_, y)| (x - held).abs().total_cmp(&(y - held).abs()))
        .map_or(current, |(candidate, _)| *candidate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_patterns_are_told_from_the_published_ones() {
        let pair = |distance_m, light_pct| Candidate {
            distance_m,
            light_pct,
        };
        let methods = Method::all(&[], &[], &[pair(1.0, 50.0), pair(1.0, 100.0)]);
        let names: Vec<_> = methods.iter().map(Method::name).collect();
        assert_eq!(
            names,
            ["NIQE", "gradient", "1 m pattern", "1 m, 100 % pattern"]
        );
    }

    #[test]
    fn the_value_held_is_met_as_nearly_as_can_be() {
        let at = |distance_m, light_pct| Candidate {
            distance_m,
            light_pct,
        };
        let candidates = [
            (at(1.0, 0.0), 4.0),
            (at(2.0, 0.0), f64::NAN),
            (at(3.0, 50.0), 2.5),
            (at(3.0, 75.0), 1.0),
        ];
        assert_eq!(nearest_to(2.0, &candidates, at(9.0, 9.0)), at(3.0, 50.0));
        assert_eq!(
            nearest_to(2.0, &candidates[1..2], at(9.0, 9.0)),
            at(9.0, 9.0)
        );
    }
}
