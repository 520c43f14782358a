//! When a label is wrong: further from the plain render than errors and the stated approximations allow.

use super::check::CheckedEntry;

/// What the method may be off: counts.
pub const ALLOWED_COUNTS: f64 = 0.1;
/// What the method may be off besides: share of the contrast.
pub const ALLOWED_SHARE: f64 = 0.01;
/// Probability that a check of right labels finds one wrong.
const FALSE_ALARM: f64 = 1e-3;
/// Degrees of freedom of a label's standard error, which comes from eight groups of paths.
const LABEL_FREEDOM: f64 = 7.0;
/// Degrees of freedom of a render's standard error, which comes from 60 patches.
const RENDER_FREEDOM: f64 = 59.0;

impl CheckedEntry {
    /// How far the label's contrast may be from the render's in each channel, counts, in a check of `entries`: 0.1 counts
    /// and 1 % for the approximations of the method, and as many combined standard errors as right labels exceed
    /// anywhere in one check of a thousand (Sidak over all channels of all entries, Student's distribution with the
    /// degrees of freedom of Welch and Satterthwaite).
    pub fn allowed(&self, entries: usize) -> [f64; 3] {
        let values = 3 * entries.max(1);
        let one = -f64::exp_m1(f64::ln_1p(-FALSE_ALARM) / values as f64);
        std::array::from_fn(|k| {
            let (label, render) = (self.label_error[k].powi(2), self.error[k].powi(2));
            let freedom = (label + render).powi(2)
                / (label.powi(2) / LABEL_FREEDOM + render.powi(2) / RENDER_FREEDOM);
            let errors = (label + render).sqrt();
            let beyond = if errors > 0.0 {
                errors * student_quantile(one, freedom)
            } else {
                0.0
            };
            ALLOWED_COUNTS + ALLOWED_SHARE * self.render[k].abs() + beyond
        })
    }

    /// Channels whose label is further from the render than that; a number that is none is always too far.
    pub fn wrong_channels(&self, entries: usize) -> Vec<usize> {
        let allowed = self.allowed(entries);
        (0..3)
            .filter(|&k| !((self.label[k] - self.render[k]).abs() <= allowed[k]))
            .collect()
    }
}

/// The value that Student's t of `freedom` degrees exceeds in magnitude with probability `p` (Wallace's approximation,
/// Biometrika 46 (1959), 125; within 2 % for 7 degrees and more).
fn student_quantile(p: f64, freedom: f64) -> f64 {
    let stretch = (8.0 * freedom + 3.0) / (8.0 * freedom + 1.0);
    let exponent = (normal_quantile(p) * stretch).powi(2) / freedom;
    (freedom * exponent.exp_m1()).sqrt()
}

/// The same of a normal variable (Abramowitz and Stegun 26.2.23, error below 4.5e-4).
fn normal_quantile(p: f64) -> f64 {
    let t = (-2.0 * (p / 2.0).ln()).sqrt();
    let above = 2.515_517 + t * (0.802_853 + t * 0.010_328);
    let below = 1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308));
    t - above / below
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_tables() {
        // Two-sided, from tables of the normal and of Student's distribution.
        for (p, expected) in [(0.05, 1.959_964), (1e-3, 3.290_527), (1e-6, 4.891_638)] {
            assert!((normal_quantile(p) - expected).abs() < 5e-4, "{p}");
        }
        for (p, freedom, expected) in [
            (0.05, 7.0, 2.364_62),
            (1e-3, 7.0, 5.407_88),
            (1e-3, 60.0, 3.460_20),
        ] {
            let got = student_quantile(p, freedom);
            assert!((got / expected - 1.0).abs() < 0.02, "{p} {freedom}: {got}");
        }
    }

    #[test]
    fn a_label_is_wrong_beyond_allowance_and_errors() {
        let mut entry = CheckedEntry {
            image: "x".into(),
            depth_m: 1.0,
            distance_m: 1.0,
            light_pct: 0.0,
            label: [10.0, 10.0, f64::NAN],
            label_error: [0.0; 3],
            render: [10.19, 10.3, 10.0],
            error: [0.0; 3],
        };
        assert_eq!(entry.wrong_channels(1), [1, 2]);
        entry.label_error = [0.05; 3];
        assert_eq!(entry.wrong_channels(1), [2]);
        // The more labels are looked at, the further one of them may be off by chance.
        assert!(entry.allowed(100)[0] > entry.allowed(1)[0]);
    }
}
