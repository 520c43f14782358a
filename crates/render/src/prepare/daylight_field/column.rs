//! The water of one channel from the surface down: optical depths and albedos, of the same water everywhere or of layers.
//! Clouds are left out.

use crate::prepare::{Coefficients, Layers, Way};

/// Halvings that find a depth in metres.
const HALVINGS: usize = 60;

/// A column of water in one channel.
pub(super) struct Column<'a> {
    /// Attenuation and scattering, 1/m, of the same water everywhere; of layers those below all of them.
    c: f64,
    b: f64,
    layers: Option<(&'a Layers, usize)>,
}

impl<'a> Column<'a> {
    /// Channel `k` of water with coefficients `c` and `b`, 1/m, or of `layers`.
    pub(super) fn new(c: f64, b: f64, layers: Option<&'a Layers>, k: usize) -> Self {
        let Some(layers) = layers else {
            return Self { c, b, layers: None };
        };
        let last = &layers.coefficients[layers.depths_m.len() - 1];
        Self {
            c: last.c[k],
            b: last.b[k],
            layers: Some((layers, k)),
        }
    }

    /// Whether it is the same at every depth.
    pub(super) fn is_even(&self) -> bool {
        self.layers.is_none()
    }

    /// Attenuation coefficient below all layers, 1/m.
    pub(super) fn lowest_c(&self) -> f64 {
        self.c
    }

    /// Optical depth from the surface down to `depth_m`.
    pub(super) fn optical_depth(&self, depth_m: f64) -> f64 {
        self.integral(depth_m, self.c, |own, k| own.c[k])
    }

    /// What of an optical depth is scattering.
    pub(super) fn scattering_depth(&self, optical_depth: f64) -> f64 {
        if self.is_even() {
            return self.albedo(optical_depth) * optical_depth;
        }
        self.integral(self.depth_m(optical_depth), self.b, |own, k| own.b[k])
    }

    fn integral(&self, depth_m: f64, even: f64, of: fn(&Coefficients, usize) -> f64) -> f64 {
        let Some((layers, k)) = self.layers else {
            return even * depth_m;
        };
        match layers.way_down(depth_m) {
            Way::Length(length) => even * length,
            Way::Counted(counted) => {
                let parts = counted.iter().zip(&layers.coefficients);
                parts.map(|(length, own)| length * of(own, k)).sum()
            }
        }
    }

    /// Depth, m, of an optical depth of layers.
    fn depth_m(&self, optical_depth: f64) -> f64 {
        let (mut low, mut high) = (0.0, 1.0);
        while self.optical_depth(high) < optical_depth && high < 1e9 {
            (low, high) = (high, 2.0 * high);
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if self.optical_depth(middle) < optical_depth {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }

    /// Single scattering albedo at an optical depth.
    pub(super) fn albedo(&self, optical_depth: f64) -> f64 {
        let (c, b) = match self.layers {
            None => (self.c, self.b),
            Some((layers, k)) => {
                let own = layers.at_depth(self.depth_m(optical_depth));
                (own.c[k], own.b[k])
            }
        };
        if c > 0.0 { b / c } else { 0.0 }
    }
}
