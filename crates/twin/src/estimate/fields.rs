//! The smooth parts of an image, fitted to the renderer's paths through random image points.

use uw_render::integrator::RenderError;
use uw_render::prepare::Prepared;
use uw_render::rays::{Rays, Selection};

use super::basis::{Basis, solve};
use super::paths::{self, DEVICE};
use super::radiance::Source;

/// Independent groups of paths; even, as half of them make each of the two images.
pub const GROUPS: usize = 8;
/// Degree of the polynomials of daylight.
const DAYLIGHT_DEGREE: usize = 4;
/// Degree of the polynomials of lamps, whose beams vary more over the image.
const LAMPS_DEGREE: usize = 6;

/// Veil and irradiance of one source over an image, per group: coefficients of a [`Basis`].
#[derive(Clone, Debug, PartialEq)]
pub struct Fields {
    /// Whether the source is the lamps (at 100 %) rather than daylight.
    pub lamps: bool,
    /// Paths per group.
    pub samples_per_group: u32,
    /// Per group and channel the coefficients of the veil.
    pub veil: Vec<[Vec<f64>; 3]>,
    /// Per group and channel the coefficients of the irradiance over π and over the guess.
    pub irradiance: Vec<[Vec<f64>; 3]>,
}

impl Fields {
    /// The functions that the coefficients belong to.
    pub fn basis(lamps: bool, symmetric: bool) -> Basis {
        if lamps {
            Basis::new(LAMPS_DEGREE, symmetric)
        } else {
            Basis::new(DAYLIGHT_DEGREE, false)
        }
    }

    /// Mean coefficients over groups `from..to`: veil and irradiance per channel.
    pub fn mean_of(&self, from: usize, to: usize) -> ([Vec<f64>; 3], [Vec<f64>; 3]) {
        let mean = |of: &[[Vec<f64>; 3]]| {
            std::array::from_fn(|k| {
                let mut sum = vec![0.0; of[from][k].len()];
                for group in &of[from..to] {
                    sum.iter_mut().zip(&group[k]).for_each(|(s, c)| *s += c);
                }
                sum.iter().map(|s| s / (to - from) as f64).collect()
            })
        };
        (mean(&self.veil), mean(&self.irradiance))
    }
}

/// Takes paths and fits fields to them, as many as are asked for.
pub struct FieldSampler<'a> {
    source: &'a Source<'a>,
    rays: Rays<'a>,
    basis: Basis,
    seed: u64,
    samples_per_group: u32,
    sums: Vec<GroupSums>,
}

/// Moments of one group.
#[derive(Clone)]
struct GroupSums {
    /// Σ φφᵀ.
    plain: Vec<f64>,
    /// Σ M φφᵀ per channel.
    weighted: [Vec<f64>; 3],
    /// Σ φ · veil per channel.
    veil: [Vec<f64>; 3],
    /// Σ φ · reflected light per channel.
    reflected: [Vec<f64>; 3],
}

impl<'a> FieldSampler<'a> {
    /// A sampler of `source` in the scene `prepared` of its view; `seed` keys all its random numbers.
    ///
    /// # Errors
    /// [`RenderError::Gpu`] where the scene has more triangles than the kernels can name.
    pub fn new(
        source: &'a Source<'a>,
        prepared: &'a Prepared,
        seed: u64,
    ) -> Result<Self, RenderError> {
        let basis = Fields::basis(source.lamps, source.symmetric);
        let n = basis.len();
        let empty = GroupSums {
            plain: vec![0.0; n * n],
            weighted: std::array::from_fn(|_| vec![0.0; n * n]),
            veil: std::array::from_fn(|_| vec![0.0; n]),
            reflected: std::array::from_fn(|_| vec![0.0; n]),
        };
        let all = 0..prepared.lamps.len();
        let selection = Selection {
            lamps: all.filter(|_| source.lamps).collect(),
            ambient: !source.lamps,
            max_events: u32::MAX,
        };
        Ok(Self {
            source,
            rays: Rays::new(&DEVICE, prepared, &selection)?,
            basis,
            seed,
            samples_per_group: 0,
            sums: vec![empty; GROUPS],
        })
    }

    /// Goes on to `samples_per_group` paths in every group.
    ///
    /// # Errors
    /// Light that is no number.
    pub fn extend_to(&mut self, samples_per_group: u32) -> Result<(), RenderError> {
        let mut tracer = self.rays.tracer();
        let mut phi = vec![0.0; self.basis.len()];
        let view = self.source.view;
        let (width, height) = view.size_px();
        let texel = |(u, v): (f64, f64)| (u * width, v * height);
        for (group, sums) in (0..).zip(&mut self.sums) {
            for batch in paths::batches(self.seed, group, self.samples_per_group..samples_per_group)
            {
                let points: Vec<_> = batch.numbers().map(texel).collect();
                let sights: Vec<_> = points.iter().map(|&(x, y)| view.sight(x, y)).collect();
                // Where there is no target the ray is not counted.
                let forward = view.camera.forward;
                let towards = sights
                    .iter()
                    .map(|s| s.as_ref().map_or(forward, |s| s.direction));
                let directions: Vec<_> = towards.collect();
                let eye = view.camera.position_m;
                let lights = tracer.trace(&batch.key(), eye, &directions)?;
                for ((light, sight), &(x, y)) in lights.iter().zip(&sights).zip(&points) {
                    let Some(sight) = sight else {
                        continue;
                    };
                    let mut total = light.ambient();
                    for lamp in light.lamps() {
                        (0..3).for_each(|k| total[k] += lamp[k]);
                    }
                    let veil = light.backscatter();
                    let expected = self.source.at_point(sight);
                    let (p, q) = view.unit_coordinates(x, y);
                    self.basis.values(p, q, &mut phi);
                    let reflected = std::array::from_fn(|k| total[k] - veil[k]);
                    sums.add(&phi, expected, veil, reflected);
                }
            }
        }
        self.samples_per_group = self.samples_per_group.max(samples_per_group);
        Ok(())
    }

    /// The fit to all paths so far; `None` where too few of them see the target.
    pub fn fit(&self) -> Option<Fields> {
        let mut fields = Fields {
            lamps: self.source.lamps,
            samples_per_group: self.samples_per_group,
            veil: Vec::with_capacity(GROUPS),
            irradiance: Vec::with_capacity(GROUPS),
        };
        for sums in &self.sums {
            let mut veil: [Vec<f64>; 3] = sums.veil.clone();
            let mut irradiance = sums.reflected.clone();
            for k in 0..3 {
                solve(&mut sums.plain.clone(), &mut veil[k])?;
                solve(&mut sums.weighted[k].clone(), &mut irradiance[k])?;
            }
            fields.veil.push(veil);
            fields.irradiance.push(irradiance);
        }
        let all = fields
            .veil
            .iter()
            .chain(&fields.irradiance)
            .flatten()
            .flatten();
        all.copied().all(f64::is_finite).then_some(fields)
    }
}

impl GroupSums {
    fn add(&mut self, phi: &[f64], expected: [f64; 3], veil: [f64; 3], reflected: [f64; 3]) {
        let n = phi.len();
        for i in 0..n {
            for j in 0..n {
                let product = phi[i] * phi[j];
                self.plain[i * n + j] += product;
                for k in 0..3 {
                    self.weighted[k][i * n + j] += expected[k] * product;
                }
            }
            for k in 0..3 {
                self.veil[k][i] += phi[i] * veil[k];
                self.reflected[k][i] += phi[i] * reflected[k];
            }
        }
    }
}
