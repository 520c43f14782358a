//! Scattering between cosine bins, per azimuthal mode.

use std::f64::consts::TAU;

use uw_media::phase::PhaseTable;

use super::{COSINES, MODES, NARROW_X};

/// Points per bin at which the phase function is sampled.
const POINTS: usize = 4096;
/// Generators of a three-dimensional additive recurrence (Roberts 2018).
const STEPS: [f64; 3] = [
    0.819_172_513_396_164_4,
    0.671_043_606_703_789_2,
    0.549_700_477_901_970_2,
];

/// Mean of cos(m Δφ) over the scatterings from a bin into another, for each azimuthal mode m.
pub(super) struct Transitions {
    /// Mode by mode, row by row: from bin i to bin j.
    pub(super) modes: Vec<[[f64; COSINES]; COSINES]>,
    /// Share of the light scattered into the narrow cone.
    pub(super) narrow: f64,
    /// Mean cosine of the scattering angle.
    pub(super) mean_cosine: f64,
}

impl Transitions {
    /// Samples the phase function from every bin.
    pub(super) fn build(phase: &PhaseTable) -> Self {
        let mut modes = vec![[[0.0; COSINES]; COSINES]; MODES];
        let (mut narrow, mut mean_cosine) = (0.0, 0.0);
        let share = 1.0 / (COSINES * POINTS) as f64;
        for from in 0..COSINES {
            for point in 0..POINTS {
                let shifted = |d: usize| (0.5 + STEPS[d] * point as f64).fract();
                let u = -1.0 + 2.0 * (from as f64 + shifted(0)) / COSINES as f64;
                let x = phase.sample_x(shifted(1).clamp(1e-12, 1.0 - 1e-12));
                if x <= NARROW_X {
                    narrow += share;
                }
                mean_cosine += share * (1.0 - 2.0 * x);
                let (to, cos_turn) = scattered(u, x, TAU * shifted(2));
                let (mut previous, mut current) = (1.0, cos_turn);
                for mode in &mut modes {
                    mode[from][to] += previous / POINTS as f64;
                    (previous, current) = (current, 2.0 * cos_turn * current - previous);
                }
            }
        }
        modes.iter_mut().for_each(symmetrise);
        Self {
            modes,
            narrow,
            mean_cosine,
        }
    }
}

/// Bin and cosine of the change of azimuth after turning by sin²(θ/2) = `x` at `roll` from the cosine `u`.
fn scattered(u: f64, x: f64, roll: f64) -> (usize, f64) {
    let (cosine, sine) = (1.0 - 2.0 * x, 2.0 * (x * (1.0 - x)).max(0.0).sqrt());
    let across = (1.0 - u * u).max(0.0).sqrt();
    let v = u * cosine + across * sine * roll.cos();
    let along = across * cosine - u * sine * roll.cos();
    let beside = sine * roll.sin();
    let length = along.hypot(beside);
    let cos_turn = if length > 0.0 { along / length } else { 1.0 };
    let bin = ((v + 1.0) * 0.5 * COSINES as f64) as usize;
    (bin.min(COSINES - 1), cos_turn.clamp(-1.0, 1.0))
}

/// The exact matrix is symmetric and does not change when both directions are turned upside down.
fn symmetrise(matrix: &mut [[f64; COSINES]; COSINES]) {
    const LAST: usize = COSINES - 1;
    for i in 0..COSINES {
        for j in 0..=i {
            let mean = 0.25
                * (matrix[i][j]
                    + matrix[j][i]
                    + matrix[LAST - i][LAST - j]
                    + matrix[LAST - j][LAST - i]);
            for (a, b) in [(i, j), (j, i), (LAST - i, LAST - j), (LAST - j, LAST - i)] {
                matrix[a][b] = mean;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use uw_media::phase::{Phase, PhaseTable};

    #[test]
    fn isotropic_scattering_goes_into_every_bin_alike_and_has_no_azimuth() {
        let t = Transitions::build(&PhaseTable::new(&Phase::Isotropic));
        for from in 0..COSINES {
            let sum: f64 = t.modes[0][from].iter().sum();
            assert!((sum - 1.0).abs() < 0.02, "{from}: {sum}");
            assert!(
                t.modes[0][from]
                    .iter()
                    .all(|p| (p * COSINES as f64 - 1.0).abs() < 0.2)
            );
            assert!(
                t.modes[1][from]
                    .iter()
                    .all(|p| p.abs() < 0.1 / COSINES as f64)
            );
        }
    }
}
