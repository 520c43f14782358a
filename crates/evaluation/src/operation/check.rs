//! What a configuration may hold.

use uw_guidance::features::Candidate;

use uw_survey::fit::{FEWEST_DISTANCES, LEAST_RATIO};

use super::config::{FORMAT, OperationConfig};

/// Most views that a configuration may ask for.
const MOST_VIEWS: usize = 100_000;

impl OperationConfig {
    /// Checks every value; the error names the field, the value and what would be right.
    pub fn check(&self) -> Result<(), String> {
        if self.format != FORMAT {
            return Err(format!(
                "format must be \"{FORMAT}\", got {:?}",
                self.format
            ));
        }
        self.pattern()?;
        self.vehicle.check()?;
        self.check_track()?;
        self.check_waters()?;
        self.check_calibration()?;
        self.check_twin()?;
        self.check_patterns()?;
        let quality = self.quality;
        within("quality.noise_share", quality.noise_share, 0.01, 100.0)?;
        if !(1..=quality.most_samples).contains(&quality.least_samples) {
            return Err(format!(
                "quality.least_samples must be from 1 to most_samples {}, got {}",
                quality.most_samples, quality.least_samples
            ));
        }
        if quality.pilot_samples < 2 {
            return Err(format!(
                "quality.pilot_samples must be at least 2 for a variance, got {}",
                quality.pilot_samples
            ));
        }
        if self.presets.is_empty() {
            return Err("presets must name at least one preset of the objective".into());
        }
        if self.niqe_block_px < 16 || !self.niqe_block_px.is_multiple_of(2) {
            return Err(format!(
                "niqe_block_px must be even and at least 16, got {}",
                self.niqe_block_px
            ));
        }
        Ok(())
    }

    fn check_track(&self) -> Result<(), String> {
        increasing("depths_m", &self.depths_m, 0.05, 1e3)?;
        increasing("distances_m", &self.distances_m, 0.1, 10.0)?;
        increasing("light_pct", &self.light_pct, 0.0, 100.0)?;
        within("step_m", self.step_m, 0.01, 10.0)?;
        within("lane_m", self.lane_m, 0.0, 100.0)?;
        within("track_error_m", self.track_error_m, 0.0, 0.5 * self.step_m)?;
        within("speed_m_per_s", self.speed_m_per_s, 1e-3, 100.0)?;
        within("start_distance_m", self.start_distance_m, 0.1, 10.0)?;
        within("start_light_pct", self.start_light_pct, 0.0, 100.0)?;
        if !(2..=self.stations).contains(&self.views_per_leg) {
            return Err(format!(
                "views_per_leg must be from 2 to stations {}, got {}",
                self.stations, self.views_per_leg
            ));
        }
        if self.repetitions < 2 {
            return Err(format!(
                "repetitions must be at least 2 for a standard error, got {}",
                self.repetitions
            ));
        }
        let (legs, distances) = (self.depths_m.len(), self.distances_m.len());
        let views = [legs, distances, self.water.len()]
            .into_iter()
            .fold(self.stations, usize::saturating_mul);
        if views > MOST_VIEWS {
            return Err(format!(
                "waters x depths_m x stations x distances_m must be at most {MOST_VIEWS} views, got {views}"
            ));
        }
        Ok(())
    }

    fn check_waters(&self) -> Result<(), String> {
        if self.water.is_empty() {
            return Err("at least one [[water]] is needed".into());
        }
        for (i, water) in self.water.iter().enumerate() {
            water.body()?;
            let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
            if water.name.is_empty() || !water.name.chars().all(plain) {
                return Err(format!(
                    "water.name must consist of letters, digits, _ and -, got {:?}",
                    water.name
                ));
            }
            if self.water[..i].iter().any(|w| w.name == water.name) {
                return Err(format!("water.name {:?} is given twice", water.name));
            }
            let fraction = water.backscatter_fraction;
            within("water.backscatter_fraction", fraction, 1e-6, 0.499_999)?;
            let held = water.held_distance_m;
            one_of("water.held_distance_m", held, &self.distances_m)?;
        }
        Ok(())
    }

    fn check_patterns(&self) -> Result<(), String> {
        for (i, pair) in self.patterns.iter().enumerate() {
            within("patterns.distance_m", pair.distance_m, 0.1, 10.0)?;
            within("patterns.light_pct", pair.light_pct, 0.0, 100.0)?;
            if self.patterns[..i].contains(pair) {
                let Candidate {
                    distance_m,
                    light_pct,
                } = pair;
                return Err(format!(
                    "patterns must differ, got {distance_m} m at {light_pct} % twice"
                ));
            }
        }
        Ok(())
    }

    fn check_calibration(&self) -> Result<(), String> {
        let calibration = &self.calibration;
        increasing("calibration.depths_m", &calibration.depths_m, 0.01, 1e3)?;
        increasing(
            "calibration.distances_m",
            &calibration.distances_m,
            0.1,
            10.0,
        )?;
        for &distance_m in &calibration.distances_m {
            one_of("calibration.distances_m", distance_m, &self.distances_m)?;
        }
        within("calibration.light_pct", calibration.light_pct, 1.0, 100.0)?;
        within(
            "calibration.contrast_depth_m",
            calibration.contrast_depth_m,
            0.05,
            1e3,
        )?;
        if calibration.up_samples_per_half == 0 {
            return Err("calibration.up_samples_per_half must be at least 1".into());
        }
        let ends = |values: &[f64]| [values[0], values[values.len() - 1]];
        let covers =
            |outer: [f64; 2], inner: [f64; 2]| outer[0] <= inner[0] && inner[1] <= outer[1];
        let (depths, legs) = (ends(&calibration.depths_m), ends(&self.depths_m));
        if !covers(depths, legs) {
            return Err(format!(
                "calibration.depths_m {depths:?} must cover depths_m {legs:?}"
            ));
        }
        let (calibrated, flown) = (ends(&calibration.distances_m), ends(&self.distances_m));
        if !covers(calibrated, flown) {
            return Err(format!(
                "calibration.distances_m {calibrated:?} must cover distances_m {flown:?}"
            ));
        }
        Ok(())
    }

    /// What the fit needs of the calibration, before anything is rendered.
    fn check_twin(&self) -> Result<(), String> {
        let Some(twin) = &self.twin else {
            return Ok(());
        };
        let paths = |field: &str, value: u32, least: u32, most: u32| {
            within(field, f64::from(value), f64::from(least), f64::from(most))
        };
        paths("twin.kilo_paths", twin.kilo_paths, 4, 1024)?;
        paths("twin.table_kilo_paths", twin.table_kilo_paths, 8, 8192)?;
        let distances = &self.calibration.distances_m;
        let wide = distances[distances.len() - 1] / distances[0] >= LEAST_RATIO;
        if distances.len() < FEWEST_DISTANCES || !wide {
            return Err(format!(
                "calibration.distances_m must be {FEWEST_DISTANCES} or more for the fit of [twin], the last at least {LEAST_RATIO} times \
                 the first, got {distances:?}"
            ));
        }
        Ok(())
    }
}

fn within(field: &str, value: f64, least: f64, most: f64) -> Result<(), String> {
    if (least..=most).contains(&value) {
        Ok(())
    } else {
        Err(format!("{field} must be in [{least}, {most}], got {value}"))
    }
}

fn one_of(field: &str, value: f64, known: &[f64]) -> Result<(), String> {
    if known.contains(&value) {
        Ok(())
    } else {
        Err(format!("{field} must be one of {known:?}, got {value}"))
    }
}

fn increasing(field: &str, values: &[f64], least: f64, most: f64) -> Result<(), String> {
    if values.is_empty() || values.windows(2).any(|w| !(w[0] < w[1])) {
        return Err(format!(
            "{field} must be increasing and not empty, got {values:?}"
        ));
    }
    values
        .iter()
        .try_for_each(|&value| within(field, value, least, most))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_values_are_named_with_what_would_be_right() {
        let cases = [
            (
                "views_per_leg = 11",
                "views_per_leg must be from 2 to stations 10, got 11",
            ),
            ("repetitions = 1", "repetitions must be at least 2"),
            ("target = \"lawn\"", "target must be one of hull_red"),
            ("distances_m = [1.0, 0.5]", "distances_m must be increasing"),
            ("depths_m = [1.0, 9.0]", "must cover depths_m [1.0, 9.0]"),
            ("stations = 1000000", "must be at most 100000 views"),
            (
                "[twin]\nkilo_paths = 2",
                "twin.kilo_paths must be in [4, 1024], got 2",
            ),
            (
                "[twin]\ntable_kilo_paths = 9000",
                "twin.table_kilo_paths must be in [8, 8192], got 9000",
            ),
            (
                "[twin]\n[calibration]\ndistances_m = [0.5, 3.0]",
                "calibration.distances_m must be 3 or more for the fit of [twin], the last at least 1.8 times the first, got [0.5, 3.0]",
            ),
        ];
        for (line, expected) in cases {
            let text = format!("format = \"uw-operation/1\"\n{line}\n");
            let config: OperationConfig = toml::from_str(&text).expect("parsed");
            let message = config.check().expect_err(line);
            assert!(message.contains(expected), "{line}: {message}");
        }
    }
}
