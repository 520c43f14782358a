//! The part of one smooth surface that a pixel shows: what rays meet there follows from what the pixel's corners see.

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::look::{Look, Seen, reflectance};
use crate::prepare::Prepared;

/// Largest ratio of the ranges, and of the transmittances, at the corners: beyond, what is in between is not known well enough.
const LARGEST_RATIO: f64 = 1.05;
/// Largest distance of what the centre shows from the mean of the corners, over the extent of the corners.
const LARGEST_BEND: f64 = 0.05;

/// A pixel all of whose corners show one surface.
pub(super) struct Patch<'a> {
    scene: &'a Prepared,
    /// At the upper left corner.
    first: &'a Look,
    /// None where nothing is met.
    surface: Option<Surface>,
}

struct Surface {
    material: usize,
    /// Places in the textures, transmittances and shading normals.
    seen: Bilinear<8>,
    points: Bilinear<3>,
    /// Whether it is one primitive.
    is_whole: bool,
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

    /// Whether some of the numbers of the centre are about those that follow from the corners.
    fn is_near(&self, centre: [f64; N], of: Range<usize>) -> bool {
        let distance = |a: [f64; N], b: [f64; N]| {
            let gaps = of.clone().map(|n| (a[n] - b[n]).powi(2));
            gaps.sum::<f64>().sqrt()
        };
        let extent = distance(self.at((0.0, 0.0)), self.at((1.0, 1.0)));
        distance(self.at((0.5, 0.5)), centre) <= LARGEST_BEND * extent
    }

    #[inline]
    fn at(&self, (x, y): (f64, f64)) -> [f64; N] {
        let [first, right, down, both] = &self.parts;
        std::array::from_fn(|n| first[n] + x * right[n] + y * (down[n] + x * both[n]))
    }
}

impl<'a> Patch<'a> {
    /// Of what the corners see, row by row, and the centre; none where that is not one smooth surface at about one range.
    pub(super) fn of(scene: &'a Prepared, corners: [&'a Look; 4], centre: &Look) -> Option<Self> {
        let first = corners[0];
        if !corners.into_iter().all(|look| look.kind == centre.kind) {
            return None;
        }
        let is_open = |look: &Look| look.range_m.is_infinite();
        let surface = match corners.into_iter().all(is_open) && is_open(centre) {
            true => None,
            false => Some(Surface::of(scene, corners, centre)?),
        };
        Some(Self {
            scene,
            first,
            surface,
        })
    }

    /// Whether the light that comes straight from what is met can be told too.
    pub(super) fn knows_light(&self) -> bool {
        self.surface.as_ref().is_none_or(|surface| surface.is_whole)
    }

    /// What a ray through the point `offset` from the upper left corner tells.
    #[inline]
    pub(super) fn seen(&self, offset: (f64, f64)) -> Seen {
        match &self.surface {
            None => self.first.seen(),
            Some(surface) => surface.seen(self.scene, offset).0,
        }
    }

    /// What it meets.
    pub(super) fn look(&self, offset: (f64, f64)) -> Look {
        let Some(surface) = &self.surface else {
            return *self.first;
        };
        let (seen, place) = surface.seen(self.scene, offset);
        let point = DVec3::from_array(surface.points.at(offset));
        (self.first).moved(self.scene, (surface.material, place), &seen, point)
    }
}

impl Surface {
    fn of(scene: &Prepared, corners: [&Look; 4], centre: &Look) -> Option<Self> {
        let is_even = is_even(corners.map(|look| look.range_m))
            && (0..3).all(|k| is_even(corners.map(|look| look.transmittance[k])));
        if !is_even {
            return None;
        }
        let [first, right, below, last] = corners.map(|look| look.place_in_texture(scene));
        let places = [first?, right?, below?, last?];
        let (material, place) = centre.place_in_texture(scene)?;
        let numbers = |look: &Look, place: DVec2| {
            let (t, n) = (look.transmittance, look.shading_normal);
            [place.x, place.y, t[0], t[1], t[2], n.x, n.y, n.z]
        };
        let seen = [0, 1, 2, 3].map(|i| numbers(corners[i], places[i].1));
        let points = Bilinear::of(corners.map(|look| look.point().to_array()));
        let seen = Bilinear::of(seen);
        let is_smooth = points.is_near(centre.point().to_array(), 0..3)
            && seen.is_near(numbers(centre, place), 0..2);
        is_smooth.then_some(Self {
            material,
            seen,
            points,
            is_whole: corners.into_iter().all(|look| look.is_beside(centre)),
        })
    }

    /// What is seen of a point, and its place in the textures.
    #[inline]
    fn seen(&self, scene: &Prepared, offset: (f64, f64)) -> (Seen, DVec2) {
        let [u, v, red, green, blue, x, y, z] = self.seen.at(offset);
        let place = DVec2::new(u, v);
        let rgb = scene.geometry.reflectance(self.material, place);
        let seen = Seen {
            transmittance: [red, green, blue],
            reflectance: reflectance(scene, rgb, self.material),
            shading_normal: DVec3::new(x, y, z),
        };
        (seen, place)
    }
}

/// Whether positive numbers differ little.
fn is_even(values: [f64; 4]) -> bool {
    let least = values.into_iter().fold(f64::INFINITY, f64::min);
    let most = values.into_iter().fold(0.0, f64::max);
    most.is_finite() && most <= LARGEST_RATIO * least
}
