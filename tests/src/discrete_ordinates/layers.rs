//! Layers of homogeneous water for one Fourier mode of the azimuth, and their combination.

use super::matrix::{Matrix, sum};

/// Optical depth of the layer that doubling starts from: once-scattered light only.
const THIN: f64 = 1.0 / (1u32 << 26) as f64;

/// Scattering at an albedo of 1 between the directions: w_j p_m(μ_i, ±μ_j) / 2, and of the beam,
/// (2 − δ) p_m(μ_i, ±μ_0) E / 4π.
#[derive(Clone, Debug)]
pub struct Scattering {
    /// Cosines of the directions, in (0, 1].
    pub mu: Vec<f64>,
    /// Into the same hemisphere.
    pub onward: Matrix,
    /// Into the other hemisphere.
    pub back: Matrix,
    /// Of the beam into downward directions.
    pub beam_down: Vec<f64>,
    /// Of the beam into upward directions.
    pub beam_up: Vec<f64>,
    /// Cosine of the beam.
    pub mu_sun: f64,
}

/// A layer: radiance out of it as a linear function of radiance and beam into it. Seen from below it is the same.
#[derive(Clone, Debug)]
pub struct Layer {
    /// Reflection.
    pub r: Matrix,
    /// Transmission, the unscattered included.
    pub t: Matrix,
    /// Downward radiance below it, from a beam of full strength at its top.
    pub down: Vec<f64>,
    /// Upward radiance above it from the beam.
    pub up: Vec<f64>,
    /// Transmittance of the beam.
    pub beam: f64,
}

impl Layer {
    /// A layer of this albedo and optical depth, by doubling.
    pub fn new(scattering: &Scattering, albedo: f64, optical_depth: f64) -> Self {
        let doublings = (optical_depth / THIN).log2().ceil().max(0.0) as i32;
        let mut layer = Self::thin(scattering, albedo, optical_depth / 2f64.powi(doublings));
        for _ in 0..doublings {
            layer = layer.doubled();
        }
        layer
    }

    fn thin(scattering: &Scattering, albedo: f64, optical_depth: f64) -> Self {
        let n = scattering.mu.len();
        let slant = |i: usize| optical_depth / scattering.mu[i];
        let scattered = |i: usize| albedo * slant(i);
        let scaled = |m: &Matrix| {
            Matrix::from_fn(n, |i, j| if i == j { scattered(i) } else { 0.0 }).times(m)
        };
        let unscattered = Matrix::from_fn(n, |i, j| if i == j { (-slant(i)).exp() } else { 0.0 });
        let from_beam = |beam: &[f64]| {
            let terms = beam.iter().enumerate();
            terms.map(|(i, s)| scattered(i) * s).collect()
        };
        Self {
            r: scaled(&scattering.back),
            t: scaled(&scattering.onward).plus(&unscattered),
            down: from_beam(&scattering.beam_down),
            up: from_beam(&scattering.beam_up),
            beam: (-optical_depth / scattering.mu_sun).exp(),
        }
    }

    fn doubled(&self) -> Self {
        let orders = self.r.times(&self.r).all_orders();
        let out = self.t.times(&orders);
        // Downward radiance between the halves, from the beam.
        let between = orders.apply(&sum(&self.down, self.beam, &self.r.apply(&self.up)));
        let up = sum(&self.r.apply(&between), self.beam, &self.up);
        Self {
            r: out.times(&self.r).times(&self.t).plus(&self.r),
            t: out.times(&self.t),
            down: sum(&self.t.apply(&between), self.beam, &self.down),
            up: sum(&self.up, 1.0, &self.t.apply(&up)),
            beam: self.beam * self.beam,
        }
    }
}

/// Everything below a level: its reflection, and the radiance it sends up because of the beam.
#[derive(Clone, Debug)]
pub struct Below {
    /// Reflection.
    pub r: Matrix,
    /// Upward radiance.
    pub up: Vec<f64>,
}

impl Below {
    /// Radiance at the top of this, (down, up), for downward radiance coming in.
    pub fn field(&self, down: Vec<f64>) -> (Vec<f64>, Vec<f64>) {
        let up = sum(&self.r.apply(&down), 1.0, &self.up);
        (down, up)
    }

    /// The same with `layer` on top, whose top the beam reaches with strength `beam`.
    pub fn under(&self, layer: &Layer, beam: f64) -> Self {
        let orders = layer.r.times(&self.r).all_orders();
        let out = layer.t.times(&self.r).times(&orders);
        let between = orders.apply(&self.incoming(layer, beam));
        let up = sum(&self.up, 1.0, &self.r.apply(&between));
        Self {
            r: out.times(&layer.t).plus(&layer.r),
            up: sum(&layer.t.apply(&up), beam, &layer.up),
        }
    }

    /// Downward radiance at the top of this, below `layer` with `down` coming in above that.
    pub fn down_below(&self, layer: &Layer, beam: f64, down: &[f64]) -> Vec<f64> {
        let incoming = sum(&layer.t.apply(down), 1.0, &self.incoming(layer, beam));
        layer.r.times(&self.r).all_orders().apply(&incoming)
    }

    /// Downward radiance between layer and this before any reflection by this of radiance from above.
    fn incoming(&self, layer: &Layer, beam: f64) -> Vec<f64> {
        sum(&layer.r.apply(&self.up), beam, &layer.down)
    }
}
