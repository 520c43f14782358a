//! From single measurements to a curve of error against processor time, and the seconds at which it meets an error.

use super::backend::Backend;
use super::table::Measurement;

/// Error against time of one scene on one backend.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Name of the scene.
    pub scene: String,
    /// Where it was rendered.
    pub backend: Backend,
    /// Reading and preparing the scene, s.
    pub setup_s: f64,
    /// Rungs by samples per pixel, upwards.
    pub rungs: Vec<Rung>,
}

/// The mean of the repeats of one number of samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Rung {
    /// Samples per pixel.
    pub samples_per_pixel: u32,
    /// Repeats.
    pub repeats: usize,
    /// Processor time of a render, s.
    pub cpu_s: f64,
    /// Wall time of a render, s.
    pub render_s: f64,
    /// Walks started at the camera, per render.
    pub paths: f64,
    /// Vertices of walks and bridges, per render.
    pub path_vertices: f64,
    /// Relative mean squared error, see [`super::error::ErrorToReference`].
    pub rel_mse: f64,
    /// Standard error of `rel_mse` from the scatter of the repeats; none for a single one.
    pub rel_mse_standard_error: Option<f64>,
    /// Mean signed relative error, per channel.
    pub bias: [f64; 3],
    /// Standard error of `bias`, from the noise of the repeats and of the reference.
    pub bias_standard_error: [f64; 3],
}

/// When a curve meets an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SecondsToError {
    /// Processor time, s.
    pub cpu_s: f64,
    /// Whether no rung lies on the far side of the error, so that it was found along error ∝ 1/time.
    pub extrapolated: bool,
}

impl Curve {
    /// Puts the measurements of one scene and backend together. `reference_error` is the relative standard error of
    /// the reference's mean, which all repeats share.
    pub fn of(
        scene: &str,
        backend: Backend,
        measurements: &[&Measurement],
        reference_error: [f64; 3],
    ) -> Self {
        let mut samples: Vec<u32> = measurements.iter().map(|m| m.samples_per_pixel).collect();
        samples.sort_unstable();
        samples.dedup();
        let rungs = samples.into_iter().map(|samples| {
            let repeats: Vec<_> = measurements
                .iter()
                .copied()
                .filter(|m| m.samples_per_pixel == samples)
                .collect();
            Rung::of(&repeats, reference_error)
        });
        Self {
            scene: scene.to_owned(),
            backend,
            setup_s: mean(measurements, |m| m.setup_s),
            rungs: rungs.collect(),
        }
    }

    /// Processor time at which the curve first meets the relative mean squared error `target` > 0: between two rungs
    /// along a straight line in log-log, outside along error ∝ 1/time from the nearest rung. `None` when no rung
    /// has an error above 0 to start from.
    pub fn seconds_to(&self, target: f64) -> Option<SecondsToError> {
        let points: Vec<(f64, f64)> = self
            .rungs
            .iter()
            .map(|r| (r.cpu_s, r.rel_mse))
            .filter(|&(cpu_s, error)| cpu_s > 0.0 && error > 0.0 && error.is_finite())
            .collect();
        for pair in points.windows(2) {
            let [(t0, e0), (t1, e1)] = [pair[0], pair[1]];
            if e0 >= target && target >= e1 {
                let share = if e0 > e1 {
                    (e0 / target).ln() / (e0 / e1).ln()
                } else {
                    0.0
                };
                return Some(SecondsToError {
                    cpu_s: t0 * (t1 / t0).powf(share),
                    extrapolated: false,
                });
            }
        }
        let (first, last) = (points.first()?, points.last()?);
        let (cpu_s, error) = if first.1 < target { first } else { last };
        Some(SecondsToError {
            cpu_s: cpu_s * error / target,
            extrapolated: *error != target,
        })
    }

    /// Relative mean squared error of a single sample per pixel, by the rung with the most samples: error times
    /// number of samples.
    pub fn rel_mse_of_one_sample(&self) -> Option<f64> {
        let rung = self.rungs.last()?;
        Some(rung.rel_mse * f64::from(rung.samples_per_pixel))
    }

    /// Largest number of standard errors by which a channel of a rung is off in the mean.
    pub fn largest_bias_z(&self) -> f64 {
        self.rungs
            .iter()
            .flat_map(|r| (0..3).map(|k| bias_z(r.bias[k], r.bias_standard_error[k])))
            .fold(0.0, f64::max)
    }
}

fn bias_z(bias: f64, standard_error: f64) -> f64 {
    if bias == 0.0 {
        0.0
    } else {
        (bias / standard_error).abs()
    }
}

impl Rung {
    fn of(repeats: &[&Measurement], reference_error: [f64; 3]) -> Self {
        let count = repeats.len() as f64;
        let rel_mse = mean(repeats, |m| m.rel_mse);
        let scatter = mean(repeats, |m| (m.rel_mse - rel_mse).powi(2));
        let bias_standard_error = std::array::from_fn(|k| {
            // The reference's share is the same in all repeats and does not average out.
            let shared = reference_error[k].powi(2);
            let own = mean(repeats, |m| {
                (m.bias_standard_error()[k].powi(2) - shared).max(0.0)
            });
            (own / count + shared).sqrt()
        });
        Self {
            samples_per_pixel: repeats.first().map_or(0, |m| m.samples_per_pixel),
            repeats: repeats.len(),
            cpu_s: mean(repeats, |m| m.cpu_s),
            render_s: mean(repeats, |m| m.render_s),
            paths: mean(repeats, |m| m.paths as f64),
            path_vertices: mean(repeats, |m| m.path_vertices as f64),
            rel_mse,
            rel_mse_standard_error: (repeats.len() > 1).then(|| (scatter / (count - 1.0)).sqrt()),
            bias: std::array::from_fn(|k| mean(repeats, |m| m.bias()[k])),
            bias_standard_error,
        }
    }
}

fn mean(measurements: &[&Measurement], value: impl Fn(&Measurement) -> f64) -> f64 {
    measurements.iter().map(|m| value(m)).sum::<f64>() / measurements.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::tests::measurement;

    fn curve(points: &[(f64, f64)]) -> Curve {
        let measurements: Vec<Measurement> = points
            .iter()
            .enumerate()
            .map(|(i, &(cpu_s, rel_mse))| Measurement {
                samples_per_pixel: 4 << i,
                cpu_s,
                rel_mse,
                ..measurement()
            })
            .collect();
        let all: Vec<&Measurement> = measurements.iter().collect();
        Curve::of("s1", Backend::Cpu, &all, [0.0; 3])
    }

    fn assert_meets(points: &[(f64, f64)], target: f64, cpu_s: f64, extrapolated: bool) {
        let found = curve(points).seconds_to(target).expect("found");
        assert!(
            (found.cpu_s / cpu_s - 1.0).abs() < 1e-12,
            "{points:?}: {found:?}"
        );
        assert_eq!(found.extrapolated, extrapolated, "{points:?}");
    }

    #[test]
    fn errors_between_rungs_lie_on_a_straight_line_in_log_log() {
        let steep = [(1.0, 1e-1), (4.0, 1e-3), (16.0, 1e-4)];
        assert_meets(&steep, 1e-2, 2.0, false);
        assert_meets(&steep, 1e-3, 4.0, false);
        assert_meets(&steep, 1e-4, 16.0, false);
        assert_meets(&steep, 10f64.powf(-3.5), 8.0, false);
    }

    #[test]
    fn errors_outside_the_rungs_follow_one_over_time_and_are_said_to() {
        let points = [(1.0, 1e-2), (4.0, 4e-3)];
        assert_meets(&points, 1e-3, 16.0, true);
        assert_meets(&points, 1e-1, 0.1, true);
        assert_meets(&points[..1], 1e-2, 1.0, false);
    }

    #[test]
    fn the_first_crossing_of_a_rising_curve_counts_and_errors_below_zero_do_not() {
        assert_meets(
            &[(1.0, 1e-1), (2.0, 1e-3), (4.0, 1.0), (8.0, 1e-3)],
            1e-1,
            1.0,
            false,
        );
        assert_meets(&[(1.0, 1e-2), (2.0, -1e-5)], 1e-3, 10.0, true);
        assert_eq!(curve(&[(1.0, -1e-5)]).seconds_to(1e-3), None);
        // Rising throughout: from where it ends.
        assert_meets(
            &[(1.0, 0.9), (4.0, 0.8), (16.0, 3.9)],
            1e-2,
            16.0 * 390.0,
            true,
        );
    }

    #[test]
    fn repeats_are_averaged_and_the_reference_is_counted_once() {
        let repeats = [1e-2, 2e-2, 3e-2].map(|rel_mse| Measurement {
            rel_mse,
            bias_r: 0.0,
            bias_g: rel_mse,
            bias_b: 0.0,
            // 0.03 of the render and 0.04 of the reference.
            bias_standard_error_g: 0.05,
            ..measurement()
        });
        let all: Vec<&Measurement> = repeats.iter().collect();
        let curve = Curve::of("s1", Backend::Cpu, &all, [0.0, 0.04, 0.0]);
        let [rung] = &curve.rungs[..] else {
            panic!("one rung: {curve:?}")
        };
        assert_eq!((rung.samples_per_pixel, rung.repeats), (64, 3));
        assert!((rung.rel_mse - 2e-2).abs() < 1e-15 && (rung.bias[1] - 2e-2).abs() < 1e-15);
        let scatter = rung.rel_mse_standard_error.expect("three repeats");
        assert!((scatter - 1e-2 / 3f64.sqrt()).abs() < 1e-15, "{scatter}");
        let expected = (0.03_f64.powi(2) / 3.0 + 0.04_f64.powi(2)).sqrt();
        assert!(
            (rung.bias_standard_error[1] - expected).abs() < 1e-15,
            "{rung:?}"
        );
        assert!((curve.largest_bias_z() - 2e-2 / expected).abs() < 1e-12);
    }
}
