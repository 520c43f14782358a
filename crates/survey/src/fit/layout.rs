//! Where each of a fit's parameters stands.

/// Logarithm of the backscatter fraction.
pub(super) const LN_BACKSCATTER: usize = 0;
/// Place on Jerlov's scale, where the water is taken to be on it.
pub(super) const PLACE: usize = 1;
/// Parameters that all channels share: these, and the logarithms of the lamps' gains.
const COMMON: usize = 5;
/// Logarithms of absorption, scattering and K_d.
const WATER: usize = 3;
/// Open numbers of a picture: how its detail is off, and the shift of a lamp picture's light or the veil of one in daylight, a
/// polynomial of second degree.
pub(super) const OF_PICTURE: usize = 7;

/// The order of all parameters, for so many pictures and depths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    pub(super) pictures: usize,
    pub(super) depths: usize,
}

impl Layout {
    /// Logarithm of the lamps' gain in channel `k`.
    pub(super) fn ln_gain(k: usize) -> usize {
        2 + k
    }

    fn channel(self, k: usize) -> usize {
        COMMON + k * (WATER + OF_PICTURE * self.pictures + self.depths)
    }

    /// Logarithm of the absorption.
    pub(super) fn ln_a(self, k: usize) -> usize {
        self.channel(k)
    }

    /// Logarithm of the scattering.
    pub(super) fn ln_b(self, k: usize) -> usize {
        self.channel(k) + 1
    }

    /// Logarithm of K_d, by which daylight falls with depth.
    pub(super) fn ln_k_d(self, k: usize) -> usize {
        self.channel(k) + 2
    }

    /// By how much a picture's detail is off.
    pub(super) fn detail(self, k: usize, picture: usize) -> usize {
        self.picture(k, picture) + OF_PICTURE - 1
    }

    /// First of the other open numbers of a picture.
    pub(super) fn picture(self, k: usize, picture: usize) -> usize {
        self.channel(k) + WATER + OF_PICTURE * picture
    }

    /// Logarithm of daylight's signal of a white target.
    pub(super) fn ln_daylight(self, k: usize, depth: usize) -> usize {
        self.picture(k, self.pictures) + depth
    }

    /// Number of parameters.
    pub(super) fn len(self) -> usize {
        self.channel(3)
    }
}
