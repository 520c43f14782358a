//! Radiative transfer in plane-parallel water by discrete ordinates, doubling and adding (van de Hulst 1963, Hansen
//! 1971): an independent reference for the renderer's daylight.
//!
//! Water under a flat refracting surface, lit by a collimated sun and a uniform sky, infinitely deep or above a
//! Lambertian bottom; homogeneous, or with coefficients that are piecewise linear in depth and may jump. Where they
//! vary, the water is cut into thin homogeneous slices, each doubled with its own albedo, which are then added; the
//! error goes with the square of the slices' thickness. The phase function is the same at all depths.
//!
//! Directions are Gauss nodes on two panels per hemisphere that meet at the critical angle, and nodes of weight 0 where
//! radiance is asked for. A phase function sharper than the nodes resolve is
//! treated by delta-M scaling (Wiscombe 1977): the share of the light that the first moment left out tells counts as
//! unscattered. Radiances get their once-scattered part with the full phase function (Nakajima and Tanaka 1988).

mod angles;
mod layers;
mod matrix;
mod once;
mod solver;
mod water;

use std::f64::consts::PI;

use uw_media::phase::PhaseFunction;

pub use angles::gauss;
use matrix::sum;
use solver::Solver;
pub use water::{Level, Water};

/// Water, surface and light.
#[derive(Clone)]
pub struct Problem<'a> {
    /// Phase function.
    pub phase: &'a dyn PhaseFunction,
    /// Water; without a bottom it must absorb below its last level.
    pub water: Water,
    /// Refractive index of the water; 1 for an index-matched surface.
    pub index: f64,
    /// Zenith angle of the sun in air, degrees.
    pub sun_zenith_deg: f64,
    /// Irradiance of the sun on a plane perpendicular to its beam in air, W/m².
    pub sun_irradiance: f64,
    /// Radiance of the sky, W/(m² sr).
    pub sky_radiance: f64,
    /// Depth, m, and reflectance, 0..1, of a Lambertian bottom, below all depths asked for.
    pub bottom: Option<(f64, f64)>,
}

impl<'a> Problem<'a> {
    /// The benchmark of Mobley et al. 1993 (Applied Optics 32, 7484, problems 1 and 2): infinitely deep water of index
    /// 1.34 under a black sky, unit sun at 60°. c is 1/m: depths are optical depths.
    pub fn benchmark(phase: &'a dyn PhaseFunction, albedo: f64) -> Self {
        Self {
            phase,
            water: Water::homogeneous(albedo),
            index: 1.34,
            sun_zenith_deg: 60.0,
            sun_irradiance: 1.0,
            sky_radiance: 0.0,
            bottom: None,
        }
    }
}

/// Irradiances at one depth, W/m², and the radiance straight up, W/(m² sr).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Irradiances {
    /// Downward plane irradiance, the sun included.
    pub e_d: f64,
    /// Upward plane irradiance.
    pub e_u: f64,
    /// Downward scalar irradiance, the sun included.
    pub e_od: f64,
    /// Upward scalar irradiance.
    pub e_ou: f64,
    /// Radiance straight up.
    pub l_u: f64,
}

/// Names of the quantities.
pub const QUANTITIES: [&str; 5] = ["E_d", "E_u", "E_od", "E_ou", "L_u"];

impl Irradiances {
    /// The quantity of this name, one of [`QUANTITIES`].
    ///
    /// # Panics
    /// For any other name.
    pub fn quantity(&self, name: &str) -> f64 {
        match name {
            "E_d" => self.e_d,
            "E_u" => self.e_u,
            "E_od" => self.e_od,
            "E_ou" => self.e_ou,
            "L_u" => self.l_u,
            other => panic!("unknown quantity {other}"),
        }
    }
}

/// A direction of travel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Travel {
    /// Cosine against straight down, not 0: positive for light that travels down.
    pub down: f64,
    /// Azimuth from that of the sunlight's travel, degrees.
    pub azimuth_deg: f64,
}

const STRAIGHT_UP: Travel = Travel {
    down: -1.0,
    azimuth_deg: 0.0,
};

/// Irradiances at increasing depths, m, with `nodes` Gauss nodes per panel.
pub fn irradiances(problem: &Problem, depths_m: &[f64], nodes: usize) -> Vec<Irradiances> {
    let solver = Solver::new(problem, depths_m, nodes, &[STRAIGHT_UP]);
    let integral = |field: &[f64], power: i32| {
        let terms = solver.nodes.iter().zip(field);
        let terms = terms.map(|(&(mu, w), l)| w * mu.powi(power) * l);
        2.0 * PI * terms.sum::<f64>()
    };
    let fields = solver.mode(0).into_iter();
    let lacking = solver.once().upwards(&solver.nodes);
    fields
        .zip(lacking)
        .zip(solver.beams())
        .map(|(((down, up), lacking), beam)| {
            let up = sum(&up, 1.0, &lacking);
            Irradiances {
                e_d: integral(&down, 1) + solver.mu_sun * beam,
                e_u: integral(&up, 1),
                e_od: integral(&down, 0) + beam,
                e_ou: integral(&up, 0),
                l_u: up[solver.nodes.len() - 1],
            }
        })
        .collect()
}

/// Radiances, W/(m² sr), at increasing depths, m, (outer) in all directions (inner).
pub fn radiances(
    problem: &Problem,
    depths_m: &[f64],
    directions: &[Travel],
    nodes: usize,
) -> Vec<Vec<f64>> {
    let solver = Solver::new(problem, depths_m, nodes, directions);
    let first = solver.nodes.len() - directions.len();
    let mut radiances = solver.once().along(directions);
    for m in 0..solver.modes() {
        let fields = solver.mode(m);
        for (level, (down, up)) in radiances.iter_mut().zip(&fields) {
            for (i, direction) in directions.iter().enumerate() {
                let field = if direction.down > 0.0 { down } else { up };
                let azimuth = direction.azimuth_deg.to_radians();
                level[i] += field[first + i] * (m as f64 * azimuth).cos();
            }
        }
    }
    radiances
}

#[cfg(test)]
mod tests;
