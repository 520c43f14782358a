//! The inspection: several methods fly the same lawnmower track in several waters.
//!
//! [`config`] → [`site`] renders every [`view`] that a method may choose, once, and keeps it on disk → [`twin`] fits a water to
//! the calibration's → [`flight`] flies a [`method`] along the [`track`] of a repetition → [`measure`] → [`summary`] → [`report`].

mod check;
pub mod claim;
pub mod config;
pub mod flight;
pub mod measure;
pub mod method;
pub mod reconstruct;
pub mod render;
pub mod report;
pub mod site;
pub mod summary;
pub mod track;
pub mod truth;
pub mod twin;
pub mod view;

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use cpu_time::ProcessTime;
use rayon::prelude::*;
use uw_calib::Profile;
use uw_calib::json::Object;
use uw_guidance::Model;
use uw_guidance::objective::Objective;
use uw_twin::environment::Target;

use crate::error::EvalError;
use crate::niqe::Pristine;
use config::OperationConfig;
use flight::{Repetition, Step, Water};
use measure::FlightMeasure;
use method::Method;
use site::{Site, ViewKey};
use summary::{Cost, MethodResult, WaterResult};

pub use claim::claim;
pub use track::along_m;

/// What a run reports, and what stops it.
pub struct Observer<'a> {
    /// Called with the share done in [0, 1] and what is being done.
    pub progress: &'a (dyn Fn(f64, &str) + Sync),
    /// Stops the run when set.
    pub cancel: &'a AtomicBool,
}

/// Everything an operation found.
pub struct Operation {
    /// The waters in the order of the configuration.
    pub waters: Vec<WaterResult>,
    /// Processor time.
    pub cost: Cost,
}

/// Flies all methods of `config`; views are kept in `folder`, `assets` holds the textures.
pub fn run(
    config: &OperationConfig,
    folder: &Path,
    assets: &Path,
    threads: Option<usize>,
    observer: &Observer,
) -> Result<Operation, EvalError> {
    let start = ProcessTime::now();
    let presets = presets(config)?;
    let model_path = config
        .model
        .clone()
        .unwrap_or_else(|| uw_assets::DEFAULT_MODEL.into());
    let model = Model::read(&model_path)?;
    let pattern = config.pattern().map_err(EvalError::Input)?;
    let target = Target::read(pattern, assets)?;
    let pristine = Pristine::shipped()?;
    // Before anything is rendered: a file may be wrong.
    let given = config.water.iter().map(|water| twin::given(water, config));
    let mut given = given.collect::<Result<Vec<_>, _>>()?;
    let mut cost = Cost::default();
    let mut waters = Vec::new();
    for (index, water) in config.water.iter().enumerate() {
        let part = |share: f64| (index as f64 + share) / config.water.len() as f64;
        let views = folder.join("views").join(&water.name);
        let mut site = Site::new(config, water, &target, &views, threads)?;
        let profile = prepare(&mut site, config, observer, &|share| part(0.75 * share))?;
        (observer.progress)(part(0.75), &format!("{}: the twin's water", water.name));
        let kept = folder.join("twin").join(&water.name);
        let mut twins = twin::fitted(&mut site, config, &kept, threads, observer.cancel)
            .map_err(|error| error.or_stopped(observer.cancel))?;
        twins.append(&mut given[index]);
        cost.add_site(&site);
        (observer.progress)(part(0.8), &format!("{}: flying", water.name));
        let tools = Water {
            config,
            site: &site,
            profile: &profile,
            model: &model,
            twins: &twins,
            presets: &presets,
            pristine: &pristine,
        };
        let from: Vec<_> = twins.iter().map(|(from, _)| *from).collect();
        let methods = Method::all(&presets, &from, &config.patterns);
        let results = fly_all(&tools, &methods, threads, observer)?;
        let report = report::Pictures::of(&tools, &results)?;
        waters.push(WaterResult {
            water: water.clone(),
            profile,
            methods: results,
            pictures: report,
        });
    }
    cost.finish(start.elapsed().as_secs_f64());
    (observer.progress)(1.0, "done");
    Ok(Operation { waters, cost })
}

/// The presets of the objective that the configuration names.
fn presets(config: &OperationConfig) -> Result<Vec<(String, Objective)>, EvalError> {
    let preset = |name: &String| {
        let value = serde_json::json!({ "preset": name });
        let object = Object::new(&value, "presets").map_err(|e| EvalError::Input(e.to_string()))?;
        let mut objective = Objective::default()
            .with(&object)
            .map_err(|e| EvalError::Input(e.to_string()))?;
        let distances = &config.distances_m;
        objective.distance_m = [distances[0], distances[distances.len() - 1]];
        Ok((name.clone(), objective))
    };
    config.presets.iter().map(preset).collect()
}

/// Renders or reads all views of a site and calibrates there.
fn prepare(
    site: &mut Site,
    config: &OperationConfig,
    observer: &Observer,
    share: &dyn Fn(f64) -> f64,
) -> Result<Profile, EvalError> {
    let stop = |error: EvalError| error.or_stopped(observer.cancel);
    let name = site.water.name.clone();
    (observer.progress)(share(0.0), &format!("{name}: calibrating"));
    let profile = site.profile(observer.cancel).map_err(stop)?;
    let mut keys = Vec::new();
    for &depth_m in &config.depths_m {
        for station in 0..config.stations {
            for &distance_m in &config.distances_m {
                keys.push(ViewKey::new(depth_m, station, distance_m));
            }
        }
    }
    for (done, key) in keys.iter().enumerate() {
        let message = format!("{name}: view {} of {}", done + 1, keys.len());
        (observer.progress)(share(done as f64 / keys.len() as f64), &message);
        site.view(*key, observer.cancel).map_err(stop)?;
    }
    Ok(profile)
}

/// All methods in all repetitions, repetitions side by side.
fn fly_all(
    water: &Water,
    methods: &[Method],
    threads: Option<usize>,
    observer: &Observer,
) -> Result<Vec<MethodResult>, EvalError> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0))
        .build()
        .map_err(|e| EvalError::Input(format!("cannot start threads: {e}")))?;
    let fly = |index: usize| -> Result<Vec<Vec<Step>>, EvalError> {
        let repetition = Repetition::new(water, index)?;
        methods
            .iter()
            .map(|method| {
                if observer.cancel.load(Ordering::Relaxed) {
                    return Err(EvalError::Interrupted);
                }
                repetition.fly(method)
            })
            .collect()
    };
    let repetitions: Vec<Vec<Vec<Step>>> = pool.install(|| {
        (0..water.config.repetitions)
            .into_par_iter()
            .map(fly)
            .collect::<Result<_, _>>()
    })?;
    let result = |k: usize| {
        let flights: Vec<Vec<Step>> = repetitions.iter().map(|r| r[k].clone()).collect();
        MethodResult {
            method: methods[k].clone(),
            measures: flights
                .iter()
                .map(|steps| FlightMeasure::of(water.config, steps))
                .collect(),
            flights,
        }
    };
    Ok((0..methods.len()).map(result).collect())
}

/// One seed of several numbers; different numbers or another order give another seed.
pub fn seed_of(parts: &[u64]) -> u64 {
    parts.iter().fold(0x51ed_270b_7f4a_7c15, |seed, &part| {
        let mut z = (seed ^ part).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z ^ (z >> 31)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_differ_by_value_and_order() {
        let seeds = [
            seed_of(&[1, 2]),
            seed_of(&[2, 1]),
            seed_of(&[1, 3]),
            seed_of(&[1, 2, 0]),
            seed_of(&[0]),
            seed_of(&[]),
        ];
        for i in 0..seeds.len() {
            assert!(!seeds[..i].contains(&seeds[i]), "{seeds:?}");
        }
    }
}
