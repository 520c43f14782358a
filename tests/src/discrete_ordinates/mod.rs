//! Radiative transfer in plane-parallel water by discrete ordinates and doubling (van de Hulst 1963, Hansen 1971):
//! an independent reference for the renderer's daylight.
//!
//! Homogeneous water under a flat refracting surface, lit by a collimated sun and a uniform sky, infinitely deep or
//! above a Lambertian bottom. Directions are Gauss nodes on two panels per hemisphere that meet at the critical
//! angle, and nodes of weight 0 where radiance is asked for. A phase function sharper than the nodes resolve is
//! treated by delta-M scaling (Wiscombe 1977): the share of the light that the first moment left out tells counts as
//! unscattered. Radiances get their once-scattered part with the full phase function (Nakajima and Tanaka 1988).

mod angles;
mod layers;
mod matrix;

use std::f64::consts::PI;

use uw_media::phase::PhaseFunction;

use angles::{Node, gauss, legendre, moments};
use layers::{Below, Layer, Scattering};
use matrix::{Matrix, sum};

/// Optical depth (after scaling) of water that passes for infinitely deep.
const DEEP: f64 = 100.0;

/// Water, surface and light. Depths are optical depths.
#[derive(Clone, Copy)]
pub struct Problem<'a> {
    /// Phase function.
    pub phase: &'a dyn PhaseFunction,
    /// Single scattering albedo b/c, in [0, 1).
    pub albedo: f64,
    /// Refractive index of the water; 1 for an index-matched surface.
    pub index: f64,
    /// Zenith angle of the sun in air, degrees.
    pub sun_zenith_deg: f64,
    /// Irradiance of the sun on a plane perpendicular to its beam in air, W/m².
    pub sun_irradiance: f64,
    /// Radiance of the sky, W/(m² sr).
    pub sky_radiance: f64,
    /// Optical depth and reflectance of a Lambertian bottom.
    pub bottom: Option<(f64, f64)>,
}

impl<'a> Problem<'a> {
    /// The benchmark of Mobley et al. 1993 (Applied Optics 32, 7484, problems 1 and 2): infinitely deep water of index
    /// 1.34 under a black sky, unit sun at 60°.
    pub fn benchmark(phase: &'a dyn PhaseFunction, albedo: f64) -> Self {
        Self {
            phase,
            albedo,
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

/// Irradiances at increasing optical depths, with `nodes` Gauss nodes per panel.
pub fn irradiances(problem: &Problem, depths: &[f64], nodes: usize) -> Vec<Irradiances> {
    let solver = Solver::new(problem, nodes, &[STRAIGHT_UP]);
    let fields = solver.mode(0, depths);
    let levels = depths.iter().zip(fields);
    levels
        .map(|(&depth, (down, up))| {
            let up = sum(&up, 1.0, &solver.once_scattered_upwards(depth));
            let integral = |field: &[f64], power: i32| {
                let terms = solver.nodes.iter().zip(field);
                2.0 * PI
                    * terms
                        .map(|(&(mu, w), l)| w * mu.powi(power) * l)
                        .sum::<f64>()
            };
            let beam = solver.beam(depth);
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

/// Radiances, W/(m² sr), at increasing optical depths (outer) in all directions (inner).
pub fn radiances(
    problem: &Problem,
    depths: &[f64],
    directions: &[Travel],
    nodes: usize,
) -> Vec<Vec<f64>> {
    let solver = Solver::new(problem, nodes, directions);
    let first = solver.nodes.len() - directions.len();
    let mut radiances: Vec<Vec<f64>> = depths
        .iter()
        .map(|&depth| {
            let correction = |&d: &Travel| solver.once_scattered(d, depth);
            directions.iter().map(correction).collect()
        })
        .collect();
    for m in 0..solver.modes() {
        let fields = solver.mode(m, depths);
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

struct Solver<'a> {
    problem: &'a Problem<'a>,
    /// Cosines and weights; the last ones have weight 0.
    nodes: Vec<Node>,
    /// Scaled moments.
    moments: Vec<f64>,
    /// Scaled albedo.
    albedo: f64,
    /// Scaled optical depth per optical depth.
    scale: f64,
    /// Cosine of the refracted sun.
    mu_sun: f64,
    /// Irradiance perpendicular to the beam just below the surface.
    sun: f64,
}

impl<'a> Solver<'a> {
    fn new(problem: &'a Problem<'a>, per_panel: usize, directions: &[Travel]) -> Self {
        let n = problem.index;
        let critical = (1.0 - 1.0 / (n * n)).sqrt();
        let mut nodes = if n > 1.0 {
            gauss(per_panel, 0.0, critical)
        } else {
            Vec::new()
        };
        nodes.extend(gauss(per_panel, critical, 1.0));
        nodes.extend(directions.iter().map(|d| (d.down.abs(), 0.0)));
        // Nodes on a panel integrate polynomials of this degree, less one, exactly.
        let degrees = 2 * per_panel;
        let full = moments(problem.phase, degrees + 1);
        let peak = full[degrees];
        let scale = 1.0 - problem.albedo * peak;
        let air = problem.sun_zenith_deg.to_radians();
        let mu_sun = (air.sin() / n).asin().cos();
        let entering = (1.0 - reflectance(mu_sun, n)) * air.cos() / mu_sun;
        Self {
            problem,
            nodes,
            moments: full[..degrees]
                .iter()
                .map(|moment| (moment - peak) / (1.0 - peak))
                .collect(),
            albedo: problem.albedo * (1.0 - peak) / scale,
            scale,
            mu_sun,
            sun: problem.sun_irradiance * entering,
        }
    }

    /// Number of Fourier modes that scatter.
    fn modes(&self) -> usize {
        let counts = |moment: &f64| moment.abs() > 1e-12;
        self.moments.iter().rposition(counts).map_or(1, |l| l + 1)
    }

    /// Irradiance perpendicular to the beam at an optical depth.
    fn beam(&self, depth: f64) -> f64 {
        self.sun * (-self.scale * depth / self.mu_sun).exp()
    }

    /// Fourier mode `m` of the radiance, (down, up), at increasing optical depths.
    fn mode(&self, m: usize, depths: &[f64]) -> Vec<(Vec<f64>, Vec<f64>)> {
        let scattering = self.scattering(m);
        let levels: Vec<f64> = [0.0].iter().chain(depths).map(|d| d * self.scale).collect();
        let beams: Vec<f64> = levels.iter().map(|d| (-d / self.mu_sun).exp()).collect();
        let between: Vec<Layer> = levels
            .windows(2)
            .map(|pair| Layer::new(&scattering, pair[1] - pair[0]))
            .collect();
        let last = levels.len() - 1;
        let mut below = vec![self.below(&scattering, m, levels[last])];
        for (layer, &beam) in between.iter().zip(&beams).rev() {
            below.push(below[below.len() - 1].under(layer, beam));
        }
        below.reverse();
        let (mirror, sky) = self.surface(m);
        let incoming = sum(&mirror.apply(&below[0].up), 1.0, &sky);
        let mut down = mirror.times(&below[0].r).all_orders().apply(&incoming);
        let mut fields = Vec::with_capacity(depths.len());
        for (i, layer) in between.iter().enumerate() {
            down = below[i + 1].down_below(layer, beams[i], &down);
            fields.push(below[i + 1].field(down.clone()));
        }
        fields
    }

    fn scattering(&self, m: usize) -> Scattering {
        let degrees = self.moments.len();
        let at = |mu: f64| legendre(m, degrees, mu);
        let functions: Vec<Vec<f64>> = self.nodes.iter().map(|node| at(node.0)).collect();
        let sun = at(self.mu_sun);
        // p_m between two directions, in the same hemisphere or (`side` -1) in opposite ones.
        let phase = |one: &[f64], other: &[f64], side: f64| {
            let mut sign = 1.0;
            let mut value = 0.0;
            for (i, (x, y)) in one.iter().zip(other).enumerate() {
                value += sign * (2 * (m + i) + 1) as f64 * self.moments[m + i] * x * y;
                sign *= side;
            }
            value
        };
        let between = |side: f64| {
            Matrix::from_fn(self.nodes.len(), |i, j| {
                0.5 * self.albedo * self.nodes[j].1 * phase(&functions[i], &functions[j], side)
            })
        };
        let twice = if m == 0 { 1.0 } else { 2.0 };
        let strength = twice * self.albedo * self.sun / (4.0 * PI);
        let of_beam = |side: f64| {
            functions
                .iter()
                .map(|f| strength * phase(f, &sun, side))
                .collect()
        };
        Scattering {
            mu: self.nodes.iter().map(|node| node.0).collect(),
            onward: between(1.0),
            back: between(-1.0),
            beam_down: of_beam(1.0),
            beam_up: of_beam(-1.0),
            mu_sun: self.mu_sun,
        }
    }

    /// The water or bottom below the last level, at a scaled optical depth.
    fn below(&self, scattering: &Scattering, m: usize, depth: f64) -> Below {
        let n = self.nodes.len();
        let beam = (-depth / self.mu_sun).exp();
        let Some((bottom, reflectance)) = self.problem.bottom else {
            let deep = Layer::new(scattering, DEEP);
            let up = deep.up.iter().map(|s| s * beam).collect();
            return Below { r: deep.r, up };
        };
        let rest = Layer::new(scattering, (bottom * self.scale - depth).max(0.0));
        let reflectance = if m == 0 { reflectance } else { 0.0 };
        let of_beam = reflectance / PI * self.mu_sun * self.sun * beam * rest.beam;
        let bottom = Below {
            r: Matrix::from_fn(n, |_, j| {
                2.0 * reflectance * self.nodes[j].1 * self.nodes[j].0
            }),
            up: vec![of_beam; n],
        };
        bottom.under(&rest, beam)
    }

    /// Reflection at the underside of the surface, and the sky through it.
    fn surface(&self, m: usize) -> (Matrix, Vec<f64>) {
        let n = self.problem.index;
        let inside: Vec<f64> = self
            .nodes
            .iter()
            .map(|&(mu, _)| reflectance(mu, n))
            .collect();
        let sky = if m == 0 {
            self.problem.sky_radiance
        } else {
            0.0
        };
        let through = inside.iter().map(|r| (1.0 - r) * n * n * sky).collect();
        let count = inside.len();
        let mirror = Matrix::from_fn(count, |i, j| if i == j { inside[i] } else { 0.0 });
        (mirror, through)
    }

    /// What the once-scattered upward radiance lacks, averaged over the azimuth, for every node. (Downwards the
    /// peak is in the way, and what is cut there changes no irradiance.)
    fn once_scattered_upwards(&self, depth: f64) -> Vec<f64> {
        let steps = 4 * self.moments.len();
        let mean = |&(mu, _): &Node| {
            let at = |i: usize| Travel {
                down: -mu,
                azimuth_deg: 360.0 * i as f64 / steps as f64,
            };
            let total: f64 = (0..steps).map(|i| self.once_scattered(at(i), depth)).sum();
            total / steps as f64
        };
        self.nodes.iter().map(mean).collect()
    }

    /// What the once-scattered radiance lacks because of the cut moments.
    fn once_scattered(&self, travel: Travel, depth: f64) -> f64 {
        let mu = travel.down;
        let sines = ((1.0 - mu * mu) * (1.0 - self.mu_sun * self.mu_sun)).sqrt();
        let cosine = mu * self.mu_sun + sines * travel.azimuth_deg.to_radians().cos();
        let functions = legendre(0, self.moments.len(), cosine);
        let terms = functions.iter().zip(&self.moments).enumerate();
        let cut: f64 = terms
            .map(|(l, (p, chi))| (2 * l + 1) as f64 * chi * p)
            .sum();
        let full = 4.0 * PI * self.problem.phase.value(0.5 * (1.0 - cosine));
        let missing = self.problem.albedo / self.scale * full - self.albedo * cut;
        missing / (4.0 * PI) * self.sun * self.lit_length(mu, self.scale * depth)
    }

    /// ∫ of the beam's transmittance along the line of sight, weighted by the transmittance to its end, over μ.
    fn lit_length(&self, mu: f64, depth: f64) -> f64 {
        let rate = 1.0 / self.mu_sun - 1.0 / mu;
        let beam = (-depth / self.mu_sun).exp();
        if mu > 0.0 {
            // From the surface down to `depth`.
            let x = rate * depth;
            let mean = if x.abs() < 1e-8 { 1.0 } else { x.exp_m1() / x };
            return depth / mu * beam * mean;
        }
        let to_bottom = self
            .problem
            .bottom
            .map_or(f64::INFINITY, |(bottom, _)| self.scale * bottom - depth);
        beam * -(-rate * to_bottom).exp_m1() / (rate * -mu)
    }
}

/// Fresnel's reflectance of unpolarised light from the cosines in water and in air; 1 for total reflection.
fn reflectance(in_water: f64, n: f64) -> f64 {
    let Some(in_air) = cosine_in_air(in_water, n) else {
        return 1.0;
    };
    let s = (n * in_water - in_air) / (n * in_water + in_air);
    let p = (n * in_air - in_water) / (n * in_air + in_water);
    0.5 * (s * s + p * p)
}

fn cosine_in_air(in_water: f64, n: f64) -> Option<f64> {
    let square = 1.0 - n * n * (1.0 - in_water * in_water);
    (square > 0.0).then(|| square.sqrt())
}

#[cfg(test)]
mod tests;
