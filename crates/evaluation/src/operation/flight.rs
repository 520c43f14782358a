//! One method flown along the track of one repetition.

use std::sync::Arc;

use uw_calib::Profile;
use uw_guidance::Model;
use uw_guidance::features::Candidate;
use uw_guidance::objective::{Criterion, Objective};
use uw_guidance::physics::{Earlier, Water as PhysicalWater};
use uw_render::image::Frame;

use super::config::OperationConfig;
use super::measure::path_m;
use super::method::{Method, Metric, guided, nearest_to, oracle, twinned};
use super::seed_of;
use super::site::{Site, ViewKey};
use super::track::{Place, along_m, places, true_homography};
use super::truth::{Truth, relative_regret};
use super::twin::{TwinWaters, WaterFrom};
use crate::error::EvalError;
use crate::niqe::Pristine;
use crate::vision::{Detector, Features, GreyImage, Matcher, PairMeasure};

/// Separates the sensor noise of the images that decide from those that are kept.
const DECISION: u64 = 1;
const KEPT: u64 = 2;
const METRIC: u64 = 3;
/// Noise of the images kept in the first repetition.
pub const KEPT_FIRST: [u64; 2] = [0, KEPT];

/// What all methods need in one water: complete, nothing is rendered any more.
pub struct Water<'a> {
    /// The configuration.
    pub config: &'a OperationConfig,
    /// The site, with every view that any method may choose.
    pub site: &'a Site<'a>,
    /// The calibration.
    pub profile: &'a Profile,
    /// The network.
    pub model: &'a Model,
    /// Waters of the twin.
    pub twins: &'a TwinWaters,
    /// Presets of the objective, by name.
    pub presets: &'a [(String, Objective)],
    /// NIQE's pristine model.
    pub pristine: &'a Pristine,
}

/// One view of a flight.
#[derive(Clone, Debug)]
pub struct Step {
    /// Where.
    pub place: Place,
    /// Depth, m.
    pub depth_m: f64,
    /// Position along the leg, m.
    pub along_m: f64,
    /// Position across the legs on the target, m: the depth on an upright one, the lane over a bottom.
    pub across_m: f64,
    /// What the method chose.
    pub chosen: Candidate,
    /// Distance of the rendered view that it got, m.
    pub view_distance_m: f64,
    /// Features of the image.
    pub features: usize,
    /// The image against the one before on the same leg.
    pub pair: Option<PairMeasure>,
    /// For every preset: (best true score − true score of the choice)/best true score.
    pub regret: Vec<f64>,
    /// True contrast of the choice, mean over the channels, 8-bit counts.
    pub contrast: f64,
}

/// Metrics of the candidates that a method tries that holds one.
struct Trials {
    candidates: Vec<Candidate>,
    niqe: Vec<f64>,
    gradient: Vec<f64>,
}

/// What a repetition shares between its methods.
pub struct Repetition<'a> {
    water: &'a Water<'a>,
    index: usize,
    places: Vec<Place>,
    truths: Vec<Truth>,
    trials: Vec<Trials>,
    held: [f64; 2],
}

impl<'a> Repetition<'a> {
    /// Takes the images of the methods that try many.
    pub fn new(water: &'a Water<'a>, index: usize) -> Result<Self, EvalError> {
        let places = places(water.config, index);
        let truths = places
            .iter()
            .map(|p| water.truth(p))
            .collect::<Result<_, _>>()?;
        let trials = places
            .iter()
            .map(|p| water.trials(index, p))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            held: [
                water.held(index, Metric::Niqe)?,
                water.held(index, Metric::MeanGradient)?,
            ],
            water,
            index,
            places,
            truths,
            trials,
        })
    }

    /// The values held: of NIQE and of the mean gradient.
    pub fn held(&self) -> [f64; 2] {
        self.held
    }

    /// Flies a method along the track.
    pub fn fly(&self, method: &Method) -> Result<Vec<Step>, EvalError> {
        let config = self.water.config;
        let mut detector = Detector::new()?;
        let matcher = Matcher::new()?;
        let mut current = Candidate {
            distance_m: config.start_distance_m,
            light_pct: config.start_light_pct,
        };
        let mut steps: Vec<Step> = Vec::with_capacity(self.places.len());
        let mut before: Option<Features> = None;
        let remembers = config.twin.is_some_and(|twin| twin.remembers);
        let mut earlier = Earlier::default();
        for (i, place) in self.places.iter().enumerate() {
            let now_s = path_m(&steps) / config.speed_m_per_s;
            if !remembers {
                earlier = Earlier::default();
            }
            let chosen = self.choose(method, i, current, (&mut earlier, now_s))?;
            let view_distance_m = config.distances_m[config.nearest_distance(chosen.distance_m)];
            let frame = self.water.frame(place, chosen, [self.index as u64, KEPT])?;
            let features = detector.extract(&GreyImage::of_frame(&frame))?;
            let depth_m = config.depths_m[place.leg];
            let along_m = along_m(config, depth_m, place.station);
            let last = steps.last().filter(|s| s.place.leg == place.leg);
            let pair = match (last, &before) {
                (Some(last), Some(before)) => {
                    let truth = true_homography(
                        config,
                        (last.along_m, last.view_distance_m),
                        (along_m, view_distance_m),
                    );
                    Some(matcher.compare(before, &features, Some(&truth))?)
                }
                _ => None,
            };
            steps.push(Step {
                place: *place,
                depth_m,
                along_m,
                across_m: self.water.site.across_m(depth_m),
                chosen,
                view_distance_m,
                features: features.count(),
                pair,
                regret: self.regret(i, chosen)?,
                contrast: self.truths[i].contrast(&chosen).iter().sum::<f64>() / 3.0,
            });
            before = Some(features);
            current = Candidate {
                distance_m: view_distance_m,
                ..chosen
            };
        }
        Ok(steps)
    }

    fn choose(
        &self,
        method: &Method,
        i: usize,
        current: Candidate,
        on_the_way: (&mut Earlier, f64),
    ) -> Result<Candidate, EvalError> {
        let (water, place) = (self.water, &self.places[i]);
        let depth_m = water.config.depths_m[place.leg];
        match method {
            Method::Pattern(set) => Ok(*set),
            Method::Guidance(_, objective) => {
                let frame = water.frame(place, current, [self.index as u64, DECISION])?;
                let tools = (water.profile, water.model, objective);
                guided(&frame, depth_m, current, tools)
            }
            Method::Twin(from, _, objective) => {
                let frame = water.frame(place, current, [self.index as u64, DECISION])?;
                let tools = (water.profile, water.twin(*from)?, objective);
                twinned(&frame, depth_m, current, tools, on_the_way)
            }
            Method::Oracle(_, objective) => {
                let criterion = water.criterion(objective, depth_m)?;
                Ok(oracle(&self.truths[i], &criterion, objective, current))
            }
            Method::Hold(metric) => {
                let trials = &self.trials[i];
                let (values, held) = match metric {
                    Metric::Niqe => (&trials.niqe, self.held[0]),
                    Metric::MeanGradient => (&trials.gradient, self.held[1]),
                };
                let tried: Vec<_> = trials
                    .candidates
                    .iter()
                    .copied()
                    .zip(values.iter().copied())
                    .collect();
                Ok(nearest_to(held, &tried, current))
            }
        }
    }

    fn regret(&self, i: usize, chosen: Candidate) -> Result<Vec<f64>, EvalError> {
        let depth_m = self.water.config.depths_m[self.places[i].leg];
        let of_preset = |(_, objective): &(String, Objective)| {
            let criterion = self.water.criterion(objective, depth_m)?;
            let got = self.truths[i].score(&criterion, &chosen);
            let best = self.truths[i].best(&criterion, objective.light_pct, chosen);
            Ok(best.map_or(f64::NAN, |(_, best)| relative_regret(best, got)))
        };
        self.water.presets.iter().map(of_preset).collect()
    }
}

impl Water<'_> {
    fn twin(&self, from: WaterFrom) -> Result<&Arc<PhysicalWater>, EvalError> {
        let found = self.twins.iter().find(|(own, _)| *own == from);
        found
            .map(|(_, water)| water)
            .ok_or_else(|| EvalError::Input(format!("the twin has no water {from:?}")))
    }

    fn criterion<'b>(
        &'b self,
        objective: &'b Objective,
        depth_m: f64,
    ) -> Result<Criterion<'b>, EvalError> {
        let k_z = self.profile.k_z(depth_m)?;
        Ok(Criterion::new(objective, self.profile, depth_m, k_z))
    }

    /// The image at a place; `noise` chooses the noise of the sensor.
    pub fn frame(
        &self,
        place: &Place,
        candidate: Candidate,
        noise: [u64; 2],
    ) -> Result<Frame, EvalError> {
        let config = self.config;
        let nearest = config.distances_m[config.nearest_distance(candidate.distance_m)];
        let view = self.view(place, nearest)?;
        let seed = seed_of(&[
            config.seed,
            noise[0],
            noise[1],
            place.leg as u64,
            place.station as u64,
        ]);
        Ok(self
            .site
            .sensor
            .expose(&view.picture(candidate.light_pct), seed))
    }

    fn view(&self, place: &Place, distance_m: f64) -> Result<&super::view::View, EvalError> {
        let key = ViewKey::new(self.config.depths_m[place.leg], place.station, distance_m);
        let view = self
            .site
            .known(key)
            .ok_or_else(|| EvalError::Input(format!("the view {key:?} has not been rendered")))?;
        Ok(view)
    }

    fn truth(&self, place: &Place) -> Result<Truth, EvalError> {
        let depth_m = self.config.depths_m[place.leg];
        let views = self.config.distances_m.iter().map(|&distance_m| {
            let key = ViewKey::new(depth_m, place.station, distance_m);
            self.site
                .known(key)
                .cloned()
                .ok_or_else(|| EvalError::Input(format!("the view {key:?} has not been rendered")))
        });
        Ok(Truth::new(
            self.config.distances_m.clone(),
            views.collect::<Result<_, _>>()?,
        ))
    }

    fn trials(&self, repetition: usize, place: &Place) -> Result<Trials, EvalError> {
        let config = self.config;
        let mut trials = Trials {
            candidates: Vec::new(),
            niqe: Vec::new(),
            gradient: Vec::new(),
        };
        for &distance_m in &config.distances_m {
            for &light_pct in &config.light_pct {
                let candidate = Candidate {
                    distance_m,
                    light_pct,
                };
                let frame = self.frame(place, candidate, [repetition as u64, METRIC])?;
                let image = GreyImage::of_frame(&frame);
                let value = |metric: Metric| {
                    // An image without contrast has no NIQE and is no candidate for holding one.
                    metric
                        .of(&image, self.pristine, config.niqe_block_px)
                        .unwrap_or(f64::NAN)
                };
                trials.niqe.push(value(Metric::Niqe));
                trials.gradient.push(value(Metric::MeanGradient));
                trials.candidates.push(candidate);
            }
        }
        Ok(trials)
    }

    /// The value to hold: mean of the metric over the first leg from the held distance at the starting lamp level.
    fn held(&self, repetition: usize, metric: Metric) -> Result<f64, EvalError> {
        let config = self.config;
        let candidate = Candidate {
            distance_m: self.site.water.held_distance_m,
            light_pct: config.start_light_pct,
        };
        let places = places(config, repetition);
        let first: Vec<_> = places.iter().filter(|p| p.leg == 0).collect();
        let mut sum = 0.0;
        for place in &first {
            let frame = self.frame(place, candidate, [repetition as u64, METRIC])?;
            let image = GreyImage::of_frame(&frame);
            sum += metric.of(&image, self.pristine, config.niqe_block_px)?;
        }
        Ok(sum / first.len() as f64)
    }
}
