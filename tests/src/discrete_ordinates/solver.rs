//! The light field: slices of water doubled, added from below, and gone through from above.

use std::f64::consts::PI;

use super::angles::{Node, gauss, legendre, moments};
use super::layers::{Below, Layer, Scattering};
use super::matrix::{Matrix, sum};
use super::once::Once;
use super::water::Slice;
use super::{Problem, Travel};

/// Optical depth (after scaling) of water that passes for infinitely deep.
const DEEP: f64 = 100.0;

/// A problem in slices, with the directions of its light.
pub struct Solver<'a> {
    problem: &'a Problem<'a>,
    /// Cosines and weights; the last ones have weight 0.
    pub nodes: Vec<Node>,
    /// Scaled moments.
    moments: Vec<f64>,
    /// Share of scattered light that counts as unscattered.
    peak: f64,
    /// Cosine of the refracted sun.
    pub mu_sun: f64,
    /// Irradiance perpendicular to the beam just below the surface.
    sun: f64,
    slices: Vec<Slice>,
    /// Scaled optical depths of the slices' tops and of the end of the last one.
    levels: Vec<f64>,
    /// Indices in `levels` of the depths that are asked for.
    asked: Vec<usize>,
}

impl<'a> Solver<'a> {
    /// Depths in metres; `per_panel` Gauss nodes, and a node for each direction.
    pub fn new(
        problem: &'a Problem<'a>,
        depths_m: &[f64],
        per_panel: usize,
        directions: &[Travel],
    ) -> Self {
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
        let air = problem.sun_zenith_deg.to_radians();
        let mu_sun = (air.sin() / n).asin().cos();
        let entering = (1.0 - reflectance(mu_sun, n)) * air.cos() / mu_sun;
        let deepest_m = depths_m
            .iter()
            .fold(problem.water.uniform_from_m(), |deepest, z| deepest.max(*z));
        let end_m = problem.bottom.map_or(deepest_m, |bottom| bottom.0);
        let slices = problem.water.slices(depths_m, end_m);
        let mut levels = vec![0.0];
        for slice in &slices {
            let scaled = (slice.a + slice.b * (1.0 - peak)) * slice.thickness_m;
            levels.push(levels[levels.len() - 1] + scaled);
        }
        let above = |depth: &f64| slices.iter().filter(|s| s.top_m < *depth).count();
        let asked = depths_m.iter().map(above).collect();
        Self {
            problem,
            nodes,
            moments: full[..degrees]
                .iter()
                .map(|moment| (moment - peak) / (1.0 - peak))
                .collect(),
            peak,
            mu_sun,
            sun: problem.sun_irradiance * entering,
            slices,
            levels,
            asked,
        }
    }

    /// Number of Fourier modes that scatter.
    pub fn modes(&self) -> usize {
        let counts = |moment: &f64| moment.abs() > 1e-12;
        self.moments.iter().rposition(counts).map_or(1, |l| l + 1)
    }

    /// Irradiance perpendicular to the beam at each of the depths asked for.
    pub fn beams(&self) -> Vec<f64> {
        let at = |&level: &usize| self.sun * self.left_of_beam(level);
        self.asked.iter().map(at).collect()
    }

    /// What the cut moments take from once-scattered light.
    pub fn once(&self) -> Once<'_> {
        Once {
            phase: self.problem.phase,
            moments: &self.moments,
            peak: self.peak,
            mu_sun: self.mu_sun,
            sun: self.sun,
            slices: &self.slices,
            levels: &self.levels,
            asked: &self.asked,
            deep: self.problem.bottom.is_none().then(|| self.deep()),
        }
    }

    /// Transmittance of the beam from the surface to a level.
    fn left_of_beam(&self, level: usize) -> f64 {
        (-self.levels[level] / self.mu_sun).exp()
    }

    /// Scattering and attenuation, scaled, 1/m, of the water below the last level.
    fn deep(&self) -> (f64, f64) {
        let deep = self.problem.water.deep();
        (deep.b, deep.a + deep.b * (1.0 - self.peak))
    }

    /// Scaled single scattering albedo.
    fn albedo(&self, b: f64, scaled_c: f64) -> f64 {
        if b > 0.0 {
            b * (1.0 - self.peak) / scaled_c
        } else {
            0.0
        }
    }

    /// Fourier mode `m` of the radiance, (down, up), at the depths asked for.
    pub fn mode(&self, m: usize) -> Vec<(Vec<f64>, Vec<f64>)> {
        let scattering = self.scattering(m);
        let layers: Vec<Layer> = self
            .slices
            .iter()
            .zip(self.levels.windows(2))
            .map(|(slice, ends)| {
                let scaled_c = slice.a + slice.b * (1.0 - self.peak);
                Layer::new(
                    &scattering,
                    self.albedo(slice.b, scaled_c),
                    ends[1] - ends[0],
                )
            })
            .collect();
        let mut below = vec![self.end(&scattering, m)];
        for (i, layer) in layers.iter().enumerate().rev() {
            below.push(below[below.len() - 1].under(layer, self.left_of_beam(i)));
        }
        below.reverse();
        let (mirror, sky) = self.surface(m);
        let incoming = sum(&mirror.apply(&below[0].up), 1.0, &sky);
        let mut down = vec![mirror.times(&below[0].r).all_orders().apply(&incoming)];
        for (i, layer) in layers.iter().enumerate() {
            down.push(below[i + 1].down_below(layer, self.left_of_beam(i), &down[i]));
        }
        let field = |&level: &usize| below[level].field(down[level].clone());
        self.asked.iter().map(field).collect()
    }

    /// For an albedo of 1.
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
                0.5 * self.nodes[j].1 * phase(&functions[i], &functions[j], side)
            })
        };
        let twice = if m == 0 { 1.0 } else { 2.0 };
        let strength = twice * self.sun / (4.0 * PI);
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

    /// The water or bottom below the last slice.
    fn end(&self, scattering: &Scattering, m: usize) -> Below {
        let n = self.nodes.len();
        let beam = self.left_of_beam(self.levels.len() - 1);
        let Some((_, reflectance)) = self.problem.bottom else {
            let (b, scaled_c) = self.deep();
            let deep = Layer::new(scattering, self.albedo(b, scaled_c), DEEP);
            let up = deep.up.iter().map(|s| s * beam).collect();
            return Below { r: deep.r, up };
        };
        let reflectance = if m == 0 { reflectance } else { 0.0 };
        let of_beam = reflectance / PI * self.mu_sun * self.sun * beam;
        Below {
            r: Matrix::from_fn(n, |_, j| {
                2.0 * reflectance * self.nodes[j].1 * self.nodes[j].0
            }),
            up: vec![of_beam; n],
        }
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
