//! The results of an operation.

use uw_calib::Profile;

use super::config::WaterConfig;
use super::flight::Step;
use super::measure::{FlightMeasure, mean_and_error};
use super::method::Method;
use super::report::Pictures;
use super::site::Site;

/// What was found in one water.
pub struct WaterResult {
    /// The water.
    pub water: WaterConfig,
    /// The calibration.
    pub profile: Profile,
    /// The methods.
    pub methods: Vec<MethodResult>,
    /// Pictures for the contact sheet.
    pub pictures: Pictures,
}

/// What one method did in one water.
pub struct MethodResult {
    /// The method.
    pub method: Method,
    /// One flight per repetition.
    pub flights: Vec<Vec<Step>>,
    /// Measures of the flights.
    pub measures: Vec<FlightMeasure>,
}

impl MethodResult {
    /// Mean and standard error over the repetitions.
    pub fn over_repetitions(&self, value: impl Fn(&FlightMeasure) -> f64) -> (f64, f64) {
        let values: Vec<f64> = self.measures.iter().map(value).collect();
        mean_and_error(&values)
    }
}

/// Processor time and work.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Views.
    pub views: usize,
    /// Processor time of all views, also of those an earlier run rendered, s.
    pub render_cpu_s: f64,
    /// Processor time of this run, renders included, s.
    pub run_cpu_s: f64,
    /// Mean samples per pixel of a view.
    pub mean_samples: f64,
}

impl Cost {
    /// Adds the views of a site.
    pub fn add_site(&mut self, site: &Site) {
        let (views, samples) = (site.views(), site.mean_samples());
        let before = self.mean_samples * self.views as f64;
        self.views += views;
        self.mean_samples = (before + samples * views as f64) / (self.views.max(1)) as f64;
        self.render_cpu_s += site.render_cpu_s();
    }

    /// Sets the processor time of the run.
    pub fn finish(&mut self, run_cpu_s: f64) {
        self.run_cpu_s = run_cpu_s;
    }
}
