//! Source iteration for plane-parallel daylight in one channel.
//!
//! Directions are those of the view: u > 0 looks up. Radiance is split into what a walk scores at once on a
//! segment (sunlight scattered once, the unscattered sky) and the rest, which is what is solved for.

use std::f64::consts::PI;

use super::{
    AZIMUTHS, COSINES, DEPTHS, MODES, bin_cosine, column::Column, transition::Transitions,
};
use crate::prepare::Boundary;

/// Bins that look up (or down).
const HALF: usize = COSINES / 2;
/// Width of a bin.
const WIDTH: f64 = 2.0 / COSINES as f64;
/// Most iterations; what is missing after them only makes the estimate low in nearly lossless water.
const MAX_ITERATIONS: usize = 120;
/// Relative change at which the iteration stops.
const TOLERANCE: f64 = 3e-3;
/// Least share of the azimuthal mean in any azimuth: the truncated series may dip below zero.
const LEAST_SHARE: f64 = 0.05;
/// Cosine of the sun above which its azimuth is of no account.
const OVERHEAD: f64 = 0.9999;

/// What lights one channel.
pub(super) struct Daylight<'a> {
    pub(super) column: &'a Column<'a>,
    /// Cosine of the refracted sun and its irradiance on a plane perpendicular to the beam.
    pub(super) sun: Option<(f64, f64)>,
    /// Radiance of the sky in the air.
    pub(super) sky: f64,
    pub(super) boundary: Boundary,
}

/// Radiances at the depth nodes.
pub(super) struct Solution {
    /// Optical depth of the last node.
    pub(super) max_depth: f64,
    /// [depth][cosine][azimuth].
    pub(super) scattered: Vec<f64>,
    /// Diffuse downward and upward irradiance per depth.
    pub(super) down: Vec<f64>,
    pub(super) up: Vec<f64>,
    /// Asymptotic −d ln L/dτ.
    pub(super) decay: f64,
}

type ByCosine = Vec<[f64; COSINES]>;

struct DepthGrid {
    depth: Vec<f64>,
    /// Single scattering albedo b/c at the nodes.
    albedo: Vec<f64>,
    /// Per interval above a node and bin: transmittance, and the weights of the source at its far and near end.
    transmitted: Vec<[f64; HALF]>,
    far: Vec<[f64; HALF]>,
    near: Vec<[f64; HALF]>,
    reflectance: [f64; HALF],
}

impl Solution {
    pub(super) fn solve(light: &Daylight<'_>, transitions: &Transitions, max_depth: f64) -> Self {
        let grid = DepthGrid::new(light, max_depth);
        let modes = match light.sun {
            Some((cosine, _)) if cosine < OVERHEAD => MODES,
            _ => 1,
        };
        let mut scattered = vec![0.0; DEPTHS * COSINES * AZIMUTHS];
        let mut mean = ByCosine::new();
        let mut total = ByCosine::new();
        for mode in 0..modes {
            let known = grid.scored_at_once(light, transitions, mode);
            let start = if mode == 0 {
                grid.diffuse_guess(light, transitions.mean_cosine, &known)
            } else {
                vec![[0.0; COSINES]; DEPTHS]
            };
            let rest = grid.iterate(&transitions.modes[mode], &known, start);
            add_mode(&mut scattered, &rest, mode);
            if mode == 0 {
                total = add(&known, &rest);
                mean = rest;
            }
        }
        keep_positive(&mut scattered, &mean);
        let flux = |t: usize, bins: std::ops::Range<usize>| {
            bins.map(|j| 2.0 * PI * WIDTH * bin_cosine(j).abs() * total[t][j])
                .sum()
        };
        Self {
            max_depth,
            scattered,
            down: (0..DEPTHS).map(|t| flux(t, HALF..COSINES)).collect(),
            up: (0..DEPTHS).map(|t| flux(t, 0..HALF)).collect(),
            decay: grid.decay(&total),
        }
    }
}

impl DepthGrid {
    fn new(light: &Daylight<'_>, max_depth: f64) -> Self {
        let depth: Vec<f64> = (0..DEPTHS)
            .map(|t| max_depth * (t as f64 / (DEPTHS - 1) as f64).powi(2))
            .collect();
        let mut grid = Self {
            transmitted: vec![[0.0; HALF]; DEPTHS],
            far: vec![[0.0; HALF]; DEPTHS],
            near: vec![[0.0; HALF]; DEPTHS],
            reflectance: std::array::from_fn(|j| {
                light.boundary.internal_reflectance(bin_cosine(HALF + j))
            }),
            albedo: depth.iter().map(|&tau| light.column.albedo(tau)).collect(),
            depth,
        };
        for t in 1..DEPTHS {
            for j in 0..HALF {
                let path = (grid.depth[t] - grid.depth[t - 1]) / bin_cosine(HALF + j);
                let transmitted = (-path).exp();
                // Exact for a source that is linear in depth.
                let far = -(-path).exp_m1() / path;
                grid.transmitted[t][j] = transmitted;
                grid.far[t][j] = far - transmitted;
                grid.near[t][j] = 1.0 - far;
            }
        }
        grid
    }

    /// Mode `mode` of the sunlight scattered once and, in mode 0, of the sky seen through the surface.
    fn scored_at_once(
        &self,
        light: &Daylight<'_>,
        transitions: &Transitions,
        mode: usize,
    ) -> ByCosine {
        let mut field = vec![[0.0; COSINES]; DEPTHS];
        if let Some((sun_cosine, irradiance)) = light.sun {
            let from = (((sun_cosine + 1.0) * 0.5 * COSINES as f64) as usize).min(COSINES - 1);
            let phase = transitions.modes[mode][from].map(|p| irradiance * p / (2.0 * PI * WIDTH));
            if light.column.is_even() {
                self.add_sunlight(sun_cosine, &phase, &mut field);
            } else {
                self.sweep(&self.sunlight(sun_cosine, &phase), &mut field);
            }
        }
        if mode == 0 {
            for (row, depth) in field.iter_mut().zip(&self.depth) {
                for j in HALF..COSINES {
                    let entering =
                        (1.0 - self.reflectance[j - HALF]) * light.boundary.index.powi(2);
                    row[j] += light.sky * entering * (-depth / bin_cosine(j)).exp();
                }
            }
        }
        field
    }

    /// Adds what one scattering makes of sunlight in water that is the same everywhere.
    fn add_sunlight(&self, sun_cosine: f64, phase: &[f64; COSINES], field: &mut ByCosine) {
        for (t, row) in field.iter_mut().enumerate() {
            let depth = self.depth[t];
            for (j, value) in row.iter_mut().enumerate() {
                let u = bin_cosine(j);
                let mut lit = line(depth, u, sun_cosine) * phase[j];
                if u > 0.0 {
                    lit += self.reflectance[j - HALF] * (-depth / u).exp() / (1.0 + u / sun_cosine)
                        * phase[COSINES - 1 - j];
                }
                *value += self.albedo[t] * lit;
            }
        }
    }

    /// The source of it at every node.
    fn sunlight(&self, sun_cosine: f64, phase: &[f64; COSINES]) -> ByCosine {
        let nodes = self.depth.iter().zip(&self.albedo);
        let at = |(depth, albedo): (&f64, &f64)| {
            let beam = albedo * (-depth / sun_cosine).exp();
            phase.map(|p| beam * p)
        };
        nodes.map(at).collect()
    }

    /// Isotropic radiance that decays as in diffusion, from all the light that enters: nearly right where
    /// little is lost, and there the iteration would not get far from nothing.
    fn diffuse_guess(&self, light: &Daylight<'_>, mean_cosine: f64, known: &ByCosine) -> ByCosine {
        let sun = light
            .sun
            .map_or(0.0, |(cosine, irradiance)| cosine * irradiance);
        let sky = if light.sky > 0.0 {
            (HALF..COSINES)
                .map(|j| 2.0 * PI * WIDTH * bin_cosine(j) * known[0][j])
                .sum()
        } else {
            0.0
        };
        let albedo = self.albedo.iter().sum::<f64>() / DEPTHS as f64;
        let loss = 1.0 - albedo;
        let decay = (3.0 * loss * (1.0 - albedo * mean_cosine)).max(0.0).sqrt();
        let entering = albedo.powi(2) * (sun + sky) / PI;
        let at = |depth: &f64| [entering * (-decay * depth).exp(); COSINES];
        self.depth.iter().map(at).collect()
    }

    /// Everything that scattered after what `known` holds, from the estimate `rest` on.
    fn iterate(
        &self,
        matrix: &[[f64; COSINES]; COSINES],
        known: &ByCosine,
        mut rest: ByCosine,
    ) -> ByCosine {
        if self.albedo.iter().all(|&albedo| albedo == 0.0) {
            return rest;
        }
        let mut previous = 0.0;
        for iteration in 0..MAX_ITERATIONS {
            let source = self.scatter(matrix, known, &rest);
            self.sweep(&source, &mut rest);
            // Deep down there is little light but it must have converged as well.
            let size: f64 = rest
                .iter()
                .zip(&self.depth)
                .map(|(row, depth)| {
                    row.iter().map(|v| v.abs()).sum::<f64>() * (0.3 * depth.min(200.0)).exp()
                })
                .sum();
            if iteration > 5 && (size - previous).abs() <= TOLERANCE * size {
                break;
            }
            previous = size;
        }
        rest
    }

    /// What scatters at every node.
    fn scatter(
        &self,
        matrix: &[[f64; COSINES]; COSINES],
        known: &ByCosine,
        rest: &ByCosine,
    ) -> ByCosine {
        let mut source = vec![[0.0; COSINES]; DEPTHS];
        for (t, out) in source.iter_mut().enumerate() {
            // The matrix is symmetric, so its rows serve as columns and the inner loop runs along memory.
            for j in 0..COSINES {
                let radiance = self.albedo[t] * (known[t][j] + rest[t][j]);
                for (o, p) in out.iter_mut().zip(&matrix[j]) {
                    *o += p * radiance;
                }
            }
        }
        source
    }

    /// Radiance of `source` along every direction: upwards views from the surface down, the others from below.
    fn sweep(&self, source: &ByCosine, field: &mut ByCosine) {
        for j in 0..HALF {
            let k = HALF - 1 - j;
            field[DEPTHS - 1][j] = source[DEPTHS - 1][j];
            for t in (0..DEPTHS - 1).rev() {
                field[t][j] = field[t + 1][j] * self.transmitted[t + 1][k]
                    + self.near[t + 1][k] * source[t][j]
                    + self.far[t + 1][k] * source[t + 1][j];
            }
        }
        for j in HALF..COSINES {
            let k = j - HALF;
            field[0][j] = self.reflectance[k] * field[0][COSINES - 1 - j];
            for t in 1..DEPTHS {
                field[t][j] = field[t - 1][j] * self.transmitted[t][k]
                    + self.near[t][k] * source[t][j]
                    + self.far[t][k] * source[t - 1][j];
            }
        }
    }

    /// Decay of the whole radiance between two deep nodes.
    fn decay(&self, total: &ByCosine) -> f64 {
        let (shallow, deep) = (DEPTHS - 30, DEPTHS - 12);
        let sum = |t: usize| total[t].iter().sum::<f64>();
        let rate = (sum(shallow) / sum(deep)).ln() / (self.depth[deep] - self.depth[shallow]);
        if rate.is_finite() {
            rate.clamp(0.0, 1.0)
        } else {
            1.0
        }
    }
}

/// Integral along a view from depth `tau` of the attenuation of sunlight and view, in optical depth.
fn line(tau: f64, u: f64, sun_cosine: f64) -> f64 {
    let sunlight = (-tau / sun_cosine).exp();
    let rate = 1.0 - u / sun_cosine;
    if u <= 0.0 {
        return sunlight / rate;
    }
    let path = tau / u;
    if (rate * path).abs() < 1e-6 {
        return sunlight * path;
    }
    (sunlight - (-path).exp()) / rate
}

fn add(a: &ByCosine, b: &ByCosine) -> ByCosine {
    let sum = |(a, b): (&[f64; COSINES], &[f64; COSINES])| std::array::from_fn(|j| a[j] + b[j]);
    a.iter().zip(b).map(sum).collect()
}

/// Adds mode `mode` at every azimuth node, damped against ringing (Lanczos' sigma factors).
fn add_mode(scattered: &mut [f64], rest: &ByCosine, mode: usize) {
    let damping = match mode {
        0 => 1.0,
        m => {
            let x = PI * m as f64 / MODES as f64;
            2.0 * x.sin() / x
        }
    };
    for p in 0..AZIMUTHS {
        let azimuth = 2.0 * (p as f64 / (AZIMUTHS - 1) as f64).asin();
        let factor = damping * (mode as f64 * azimuth).cos();
        for (t, row) in rest.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                scattered[(t * COSINES + j) * AZIMUTHS + p] += factor * value;
            }
        }
    }
}

/// Keeps every azimuth above a share of the mean, and the first depth above nothing: upward views just below
/// a surface that does not reflect see none, but a little deeper they do.
fn keep_positive(scattered: &mut [f64], mean: &ByCosine) {
    for t in 0..DEPTHS {
        for j in 0..COSINES {
            let own = mean[t][j];
            let least = if t == 0 {
                own.max(0.3 * mean[1][j])
            } else {
                own
            };
            for p in 0..AZIMUTHS {
                let value = &mut scattered[(t * COSINES + j) * AZIMUTHS + p];
                *value = value.max(LEAST_SHARE * least);
            }
        }
    }
}
