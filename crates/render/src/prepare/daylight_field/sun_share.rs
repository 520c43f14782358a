//! Where the light that a scattering sends into a direction comes from: from around the sun or from around the direction.
//!
//! The integrand over the new direction d' is p(d·d') times the light from d'. It has two peaks: at d' = d, where p is
//! large, and at d' = sun, where the light is. With the irradiance E of the sun's beam, the light around the sun (its
//! aureole) amounts to E·(e^(ωfτ/μ) − 1) (f: share of the scattering that is narrow), of which p(d·sun) is sent into d.

use uw_media::phase::PhaseTable;

use super::{AZIMUTHS, COSINES, DEPTHS, bin_cosine, column::Column, solver::Solution};
use crate::prepare::SunBeam;

/// Least and largest share: neither peak may be left out, and the estimate is coarse.
const LEAST: f64 = 0.1;
const LARGEST: f64 = 0.7;
/// Half the width of a bin, as sin²(θ/2): closer to the sun the grid cannot see.
const BLUR_X: f64 = 6e-4;

/// One channel in the sun.
pub(super) struct Lit<'a> {
    pub(super) phase: &'a PhaseTable,
    pub(super) column: &'a Column<'a>,
    /// Irradiance of the beam below the surface.
    pub(super) irradiance: f64,
    /// As in `Transitions`.
    pub(super) narrow: f64,
}

/// Shares at the nodes of `solution`, [depth][cosine][azimuth].
pub(super) fn sun_shares(lit: &Lit<'_>, sun: &SunBeam, solution: &Solution) -> Vec<f32> {
    let (up_sun, across_sun) = (sun.towards.z, (1.0 - sun.towards.z.powi(2)).max(0.0).sqrt());
    let mut shares = Vec::with_capacity(DEPTHS * COSINES * AZIMUTHS);
    for node in 0..DEPTHS {
        let depth = solution.max_depth * (node as f64 / (DEPTHS - 1) as f64).powi(2);
        let albedo = lit.column.albedo(depth);
        let scattered = lit.column.scattering_depth(depth);
        let beam = lit.irradiance * (-depth / up_sun).exp();
        let blurred = (lit.narrow * scattered / up_sun).min(30.0).exp_m1();
        for bin in 0..COSINES {
            let up = bin_cosine(bin);
            let across = (1.0 - up * up).sqrt();
            for azimuth in 0..AZIMUTHS {
                let turn = 1.0 - 2.0 * (azimuth as f64 / (AZIMUTHS - 1) as f64).powi(2);
                let cosine = up * up_sun + across * across_sun * turn;
                let phase = lit.phase.value((0.5 * (1.0 - cosine)).clamp(BLUR_X, 1.0));
                // Sunlight scattered once on the way out, relative to its source.
                let reach = 1.0 / ((1.0 - up / up_sun).max(0.0) + up.max(0.0) / depth.max(1e-6));
                let line = albedo * reach.min(1e6);
                let index = (node * COSINES + bin) * AZIMUTHS + azimuth;
                let broad = solution.scattered[index] / (beam * phase).max(1e-300);
                let around_view = line + broad.max(line * blurred);
                let share = blurred / (blurred + around_view).max(1e-300);
                shares.push(share.clamp(LEAST, LARGEST) as f32);
            }
        }
    }
    shares
}
