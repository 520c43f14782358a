//! The part of one face that a pixel shows: what rays meet there follows from what the pixel's corners see.

use glam::DVec3;
use uw_media::Spectrum;

use super::look::Look;
use crate::prepare::Prepared;

/// Largest ratio of the ranges, and of the transmittances, at the corners: beyond, what is in between is not known well enough.
const LARGEST_RATIO: f64 = 1.05;

/// A pixel all of whose corners show one face.
pub(super) struct Face<'a> {
    scene: &'a Prepared,
    /// At the upper left corner.
    first: &'a Look,
    local: Bilinear<2>,
    point: Bilinear<3>,
    transmittance: Bilinear<3>,
}

/// Numbers known at the corners of a pixel, in between linear along rows and along columns.
struct Bilinear<const N: usize> {
    /// At the upper left corner, and what a step to the right, a step down and both add.
    parts: [[f64; N]; 4],
}

impl<const N: usize> Bilinear<N> {
    /// From the numbers at the corners, row by row.
    fn of(corners: [[f64; N]; 4]) -> Self {
        let [first, right, below, last] = corners;
        let from_first = |other: [f64; N]| std::array::from_fn(|n| other[n] - first[n]);
        let both = std::array::from_fn(|n| last[n] - right[n] - below[n] + first[n]);
        Self {
            parts: [first, from_first(right), from_first(below), both],
        }
    }

    #[inline]
    fn at(&self, (x, y): (f64, f64)) -> [f64; N] {
        let [first, right, down, both] = &self.parts;
        std::array::from_fn(|n| first[n] + x * right[n] + y * (down[n] + x * both[n]))
    }
}

impl<'a> Face<'a> {
    /// Of what the corners see, row by row; none where that is not one face at about one range.
    pub(super) fn of(scene: &'a Prepared, corners: &'a [Look; 4]) -> Option<Self> {
        let first = &corners[0];
        let is_one = corners.iter().all(|look| first.is_beside(look));
        if !is_one || !is_even(corners.each_ref().map(|look| look.range_m)) {
            return None;
        }
        let channel = |k: usize| corners.each_ref().map(|look| look.transmittance[k]);
        (0..3).all(|k| is_even(channel(k))).then(|| Self {
            scene,
            first,
            local: Bilinear::of(corners.each_ref().map(Look::local)),
            point: Bilinear::of(corners.each_ref().map(|look| look.point().to_array())),
            transmittance: Bilinear::of(corners.each_ref().map(|look| look.transmittance)),
        })
    }

    /// Whether the face is what `look` meets.
    pub(super) fn is_met(&self, look: &Look) -> bool {
        self.first.is_beside(look)
    }

    /// What a ray through the point `offset` from the upper left corner meets.
    pub(super) fn look(&self, offset: (f64, f64)) -> Look {
        let point = DVec3::from_array(self.point.at(offset));
        let transmittance: Spectrum = self.transmittance.at(offset);
        (self.first).moved(self.scene, self.local.at(offset), point, transmittance)
    }
}

/// Whether positive numbers differ little.
fn is_even(values: [f64; 4]) -> bool {
    let least = values.into_iter().fold(f64::INFINITY, f64::min);
    let most = values.into_iter().fold(0.0, f64::max);
    most.is_finite() && most <= LARGEST_RATIO * least
}
