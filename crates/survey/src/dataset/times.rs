//! Where the time of a run goes: seconds and paths per stage, summed over the threads.

use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use uw_twin::estimate::fields::GROUPS;

/// Time and paths of one stage.
#[derive(Debug, Default)]
struct Stage {
    microseconds: AtomicU64,
    renders: AtomicU64,
    paths: AtomicU64,
}

/// Times per stage.
#[derive(Debug, Default)]
pub struct Times {
    daylight: Stage,
    lamps: Stage,
    upward: Stage,
    spread: Stage,
    statistics: Stage,
}

impl Stage {
    fn add(&self, time: Duration, renders: u64, samples_per_group: u32) {
        let microseconds = u64::try_from(time.as_micros()).unwrap_or(u64::MAX);
        self.microseconds.fetch_add(microseconds, Ordering::Relaxed);
        self.renders.fetch_add(renders, Ordering::Relaxed);
        let paths = u64::from(samples_per_group) * GROUPS as u64;
        self.paths.fetch_add(paths, Ordering::Relaxed);
    }

    fn seconds(&self) -> f64 {
        self.microseconds.load(Ordering::Relaxed) as f64 * 1e-6
    }
}

impl Times {
    pub(super) fn add_daylight(&self, time: Duration, samples_per_group: u32) {
        self.daylight.add(time, 1, samples_per_group);
    }

    pub(super) fn add_lamps(&self, time: Duration, samples_per_group: u32) {
        self.lamps.add(time, 1, samples_per_group);
    }

    pub(super) fn add_upward(&self, time: Duration, samples_per_group: u32) {
        self.upward.add(time, 1, samples_per_group);
    }

    pub(super) fn add_spread(&self, time: Duration) {
        self.spread.add(time, 0, 0);
    }

    pub(super) fn add_statistics(&self, time: Duration) {
        self.statistics.add(time, 0, 0);
    }

    /// Renders made in this run.
    pub fn renders(&self) -> u64 {
        [&self.daylight, &self.lamps, &self.upward]
            .iter()
            .map(|s| s.renders.load(Ordering::Relaxed))
            .sum()
    }
}

impl fmt::Display for Times {
    /// A line per stage; seconds are those of the threads, summed.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, stage) in [
            ("daylight", &self.daylight),
            ("lamps", &self.lamps),
            ("looking up", &self.upward),
        ] {
            let renders = stage.renders.load(Ordering::Relaxed);
            let paths = stage.paths.load(Ordering::Relaxed) as f64;
            let seconds = stage.seconds();
            writeln!(
                f,
                "  {name:<10} {renders:>6} renders {:>9.1} thread s {:>9.2} M paths",
                seconds,
                1e-6 * paths
            )?;
        }
        writeln!(
            f,
            "  spread            {:>16.1} thread s",
            self.spread.seconds()
        )?;
        write!(
            f,
            "  statistics        {:>16.1} thread s",
            self.statistics.seconds()
        )
    }
}
