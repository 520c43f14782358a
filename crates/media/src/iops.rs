//! Inherent optical properties of a water body, one value per colour channel.

/// What light or water is in the three channels of a camera (R, G, B), as `Spectrum` of the shaders: radiance, a share
/// of light, a coefficient. In a scene with light by wavelength, each channel is one wavelength of a sample.
pub type Spectrum = [f64; 3];

/// Absorption and scattering of homogeneous water in the three colour channels, in 1/m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iops {
    /// Absorption coefficient per channel (R, G, B), 1/m, finite and >= 0.
    pub a: Spectrum,
    /// Scattering coefficient per channel (R, G, B), 1/m, finite and >= 0.
    pub b: Spectrum,
}

impl Iops {
    /// Attenuation coefficient c = a + b per channel, 1/m.
    pub fn c(&self) -> Spectrum {
        [
            self.a[0] + self.b[0],
            self.a[1] + self.b[1],
            self.a[2] + self.b[2],
        ]
    }

    /// What lies between two waters: this one at `share` 0, `other` at 1.
    pub fn towards(&self, other: &Self, share: f64) -> Self {
        let between =
            |x: Spectrum, y: Spectrum| std::array::from_fn(|k| x[k] + share * (y[k] - x[k]));
        Self {
            a: between(self.a, other.a),
            b: between(self.b, other.b),
        }
    }

    /// Single-scattering albedo b / c per channel, in [0, 1]; 0 where c is 0.
    pub fn albedo(&self) -> Spectrum {
        let c = self.c();
        std::array::from_fn(|k| if c[k] > 0.0 { self.b[k] / c[k] } else { 0.0 })
    }
}
