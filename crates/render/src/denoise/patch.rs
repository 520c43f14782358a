//! The part of one smooth surface that a pixel shows: what rays meet there follows from what the pixel's corners see.

use glam::{DVec2, DVec3};

use super::look::{Ground, Look};
use crate::prepare::Prepared;

/// Largest ratio of the ranges, and of the transmittances, at the corners: beyond, what is in between is not known well enough.
const LARGEST_RATIO: f64 = 1.05;
/// Largest distance of what the centre shows from the mean of the corners, over the extent of the corners.
const LARGEST_BEND: f64 = 0.1;

/// A pixel all of whose corners show one surface.
pub(super) struct Patch<'a> {
    scene: &'a Prepared,
    /// At the upper left corner.
    first: &'a Look,
    surface: Surface,
}

enum Surface {
    /// Nothing is met.
    None,
    /// One primitive.
    Primitive { ground: Bilinear<8> },
    /// Several triangles of a mesh.
    Mesh {
        ground: Bilinear<8>,
        normal: Bilinear<3>,
    },
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

impl<'a> Patch<'a> {
    /// Of what the corners see, row by row, and the centre; none where that is not one smooth surface at about one range.
    pub(super) fn of(scene: &'a Prepared, corners: [&'a Look; 4], centre: &Look) -> Option<Self> {
        let first = corners[0];
        if !corners.into_iter().all(|look| look.kind == centre.kind) {
            return None;
        }
        let surface = if corners.into_iter().all(|look| look.is_beside(centre)) {
            match first.range_m.is_infinite() {
                true => Surface::None,
                false => Surface::Primitive {
                    ground: ground(scene, corners, centre, Look::on_primitive)?,
                },
            }
        } else {
            Surface::Mesh {
                ground: ground(scene, corners, centre, Look::on_mesh)?,
                normal: Bilinear::of(corners.map(|look| look.shading_normal.to_array())),
            }
        };
        Some(Self {
            scene,
            first,
            surface,
        })
    }

    /// Whether the light that comes straight from what is met can be told too.
    pub(super) fn knows_light(&self) -> bool {
        !matches!(self.surface, Surface::Mesh { .. })
    }

    /// What a ray through the point `offset` from the upper left corner meets.
    #[inline]
    pub(super) fn look(&self, offset: (f64, f64)) -> Look {
        match &self.surface {
            Surface::None => *self.first,
            Surface::Primitive { ground } => {
                self.first.moved(self.scene, &told(ground.at(offset)), None)
            }
            Surface::Mesh { ground, normal } => {
                let normal = DVec3::from_array(normal.at(offset));
                (self.first).moved(self.scene, &told(ground.at(offset)), Some(normal))
            }
        }
    }
}

/// What the corners have in `on` surfaces; none where one of them has nothing there, or where they and the centre do not agree.
fn ground(
    scene: &Prepared,
    corners: [&Look; 4],
    centre: &Look,
    on: fn(&Look, &Prepared) -> Option<DVec2>,
) -> Option<Bilinear<8>> {
    let is_even = is_even(corners.map(|look| look.range_m))
        && (0..3).all(|k| is_even(corners.map(|look| look.transmittance[k])));
    if !is_even {
        return None;
    }
    let numbers = |look: &Look| {
        let place = on(look, scene)?.to_array();
        let point = look.point().to_array();
        let (p, q, t) = (place, point, look.transmittance);
        Some([p[0], p[1], q[0], q[1], q[2], t[0], t[1], t[2]])
    };
    let [first, right, below, last] = corners.map(numbers);
    let of_corners = [first?, right?, below?, last?];
    let ground = Bilinear::of(of_corners);
    let (middle, centre) = (ground.at((0.5, 0.5)), numbers(centre)?);
    let is_smooth = [0..2, 2..5].into_iter().all(|range| {
        let distance = |a: &[f64; 8], b: &[f64; 8]| {
            let gaps = range.clone().map(|n| (a[n] - b[n]).powi(2));
            gaps.sum::<f64>().sqrt()
        };
        let extent = distance(&of_corners[0], &of_corners[3]);
        distance(&middle, &centre) <= LARGEST_BEND * extent
    });
    is_smooth.then_some(ground)
}

fn told(numbers: [f64; 8]) -> Ground {
    let [a, b, x, y, z, red, green, blue] = numbers;
    Ground {
        place: DVec2::new(a, b),
        point: DVec3::new(x, y, z),
        transmittance: [red, green, blue],
    }
}

/// Whether positive numbers differ little.
fn is_even(values: [f64; 4]) -> bool {
    let least = values.into_iter().fold(f64::INFINITY, f64::min);
    let most = values.into_iter().fold(0.0, f64::max);
    most.is_finite() && most <= LARGEST_RATIO * least
}
