//! What directions are worth where light scatters: which share of them to draw around the sun, and how much light comes from each.
//!
//! The integrand over the new direction d' is p(d·d') times the light from d'. It has two peaks: at d' = d, where p is
//! large, and at d' = sun, where the light is. With the irradiance E of the sun's beam, the light around the sun (its
//! aureole) amounts to E·(e^(ωfτ/μ) − 1) (f: share of the scattering that is narrow), of which p(d·sun) is sent into d.

use std::f64::consts::TAU;

use uw_media::phase::PhaseTable;

use super::solver::{Daylight, Solution};
use super::{AZIMUTHS, COSINES, DEPTHS, bin_cosine, column::Column};

/// Least and largest share: neither peak may be left out, and the estimate is coarse.
const LEAST: f64 = 0.1;
const LARGEST: f64 = 0.7;
/// Half the width of a bin, as sin²(θ/2): closer to the sun the grid cannot see.
const BLUR_X: f64 = 6e-4;
/// Least worth of a direction over the mean light at its depth: the solution may miss what there is.
const LEAST_LIGHT: f64 = 1e-4;
/// Most sunlight over the mean light: times the phase function it is a number yet.
const MOST_SUNLIGHT: f64 = 1e30;
/// Largest exponent of the aureole.
const LARGEST_EXPONENT: f64 = 30.0;

/// One channel in the daylight.
pub(super) struct Lit<'a> {
    pub(super) phase: &'a PhaseTable,
    pub(super) light: &'a Daylight<'a>,
    /// As in `Transitions`.
    pub(super) narrow: f64,
}

/// Of the directions at the nodes of a solution, [depth][cosine][azimuth].
#[derive(Default)]
pub(super) struct Worths {
    /// Share of directions to draw around the sun where a walk comes along this one; 0 without a sun.
    pub(super) sun_share: Vec<f32>,
    /// Radiance but for what the sun's beam brings in one scattering, over the mean radiance at its depth.
    pub(super) light: Vec<f32>,
    /// The rest, over the same and over the phase function towards the sun.
    pub(super) sunlight: Vec<f32>,
}

/// The sun's beam at a node.
struct Beam {
    up: f64,
    across: f64,
    irradiance: f64,
    /// Light of its aureole over that of the beam.
    blurred: f64,
}

impl Worths {
    pub(super) fn of(lit: &Lit<'_>, solution: &Solution) -> Self {
        let mut worths = Self::default();
        for node in 0..DEPTHS {
            let depth = solution.max_depth * (node as f64 / (DEPTHS - 1) as f64).powi(2);
            let beam = lit.beam(depth);
            let mean = ((solution.down[node] + solution.up[node]) / TAU).max(f64::MIN_POSITIVE);
            for index in 0..COSINES * AZIMUTHS {
                let (up, azimuth) = (bin_cosine(index / AZIMUTHS), index % AZIMUTHS);
                let scattered = solution.scattered[node * COSINES * AZIMUTHS + index];
                let (share, sunlight) = beam.as_ref().map_or((0.0, 0.0), |beam| {
                    let line = line(lit.light.column, depth, up, beam.up);
                    let share = lit.sun_share(beam, (up, azimuth), line, scattered);
                    let blurred = if up > 0.0 { beam.blurred } else { 0.0 };
                    (share, beam.irradiance * line * (1.0 + blurred))
                });
                let light = (scattered + lit.sky(depth, up)) / mean;
                worths.sun_share.push(share as f32);
                worths.light.push(light.max(LEAST_LIGHT) as f32);
                worths
                    .sunlight
                    .push((sunlight / mean).min(MOST_SUNLIGHT) as f32);
            }
        }
        worths
    }
}

impl Lit<'_> {
    fn beam(&self, depth: f64) -> Option<Beam> {
        let (up, irradiance) = self.light.sun?;
        let scattered = self.light.column.scattering_depth(depth);
        let exponent = (self.narrow * scattered / up).min(LARGEST_EXPONENT);
        Some(Beam {
            up,
            across: (1.0 - up * up).max(0.0).sqrt(),
            irradiance: irradiance * (-depth / up).exp(),
            blurred: exponent.exp_m1(),
        })
    }

    /// Share around the sun for a walk that comes along a direction from where `scattered` comes, with `line` as below.
    fn sun_share(
        &self,
        beam: &Beam,
        (up, azimuth): (f64, usize),
        line: f64,
        scattered: f64,
    ) -> f64 {
        let across = (1.0 - up * up).sqrt();
        let turn = 1.0 - 2.0 * (azimuth as f64 / (AZIMUTHS - 1) as f64).powi(2);
        let cosine = up * beam.up + across * beam.across * turn;
        let phase = self.phase.value((0.5 * (1.0 - cosine)).clamp(BLUR_X, 1.0));
        let broad = scattered / (beam.irradiance * phase).max(1e-300);
        let around_view = line + broad.max(line * beam.blurred);
        let share = beam.blurred / (beam.blurred + around_view).max(1e-300);
        share.clamp(LEAST, LARGEST)
    }

    /// Radiance of the sky through the surface, at optical depth `depth` in a direction of cosine `up`.
    fn sky(&self, depth: f64, up: f64) -> f64 {
        if up <= 0.0 {
            return 0.0;
        }
        let boundary = &self.light.boundary;
        let entering = (1.0 - boundary.internal_reflectance(up)) * boundary.index.powi(2);
        self.light.sky * entering * (-depth / up).exp()
    }
}

/// Sunlight scattered once along a way out, relative to its source at the way's start.
fn line(column: &Column<'_>, depth: f64, up: f64, up_sun: f64) -> f64 {
    let reach = 1.0 / ((1.0 - up / up_sun).max(0.0) + up.max(0.0) / depth.max(1e-6));
    column.albedo(depth) * reach.min(1e6)
}
