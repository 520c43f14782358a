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
        let mut numbers = *first;
        for n in 0..N {
            numbers[n] += x * right[n] + y * (down[n] + x * both[n]);
        }
        numbers
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
            Some(surface) => surface.seen(self.scene, offset),
        }
    }

    /// What it meets, which tells `seen`.
    pub(super) fn look(&self, offset: (f64, f64), seen: &Seen) -> Look {
        let Some(surface) = &self.surface else {
            return *self.first;
        };
        let [u, v, ..] = surface.seen.at(offset);
        let emission = (self.scene.geometry).emission(surface.material, DVec2::new(u, v));
        let point = DVec3::from_array(surface.points.at(offset));
        self.first.moved(point, seen, emission)
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

    #[inline]
    fn seen(&self, scene: &Prepared, offset: (f64, f64)) -> Seen {
        let [u, v, red, green, blue, x, y, z] = self.seen.at(offset);
        let rgb = (scene.geometry).reflectance(self.material, DVec2::new(u, v));
        Seen {
            transmittance: [red, green, blue],
            reflectance: reflectance(scene, rgb, self.material),
            shading_normal: DVec3::new(x, y, z),
        }
    }
}

/// Whether positive numbers differ little.
fn is_even(values: [f64; 4]) -> bool {
    let least = values.into_iter().fold(f64::INFINITY, f64::min);
    let most = values.into_iter().fold(0.0, f64::max);
    most.is_finite() && most <= LARGEST_RATIO * least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    /// A textured floor that is seen aslant, with a post before it.
    fn scene() -> Prepared {
        let text = r#"
            format = "uw-scene/1"
            water = { a = [0.3, 0.2, 0.25], b = [0.6, 0.7, 0.8], phase = { model = "fournier-forand", n = 1.10, backscatter_fraction = 0.0183 } }
            camera = { position_m = [0, 0, 2], forward = [1, 0, -1], up = [0, 0, 1], hfov_deg = 40, width = 320, height = 240 }
            [[object]]
            plane = { center_m = [2, 0, 0], normal = [0, 0, 1], up = [1, 0, 0], size_m = [9, 9] }
            reflectance = { texture = "../../assets/textures/coral_rock.png", encoding = "srgb", tile_m = [5, 5] }
            [[object]]
            plane = { center_m = [1, 0, 1], normal = [-1, 0, 0], up = [0, 0, 1], size_m = [0.2, 8] }
            reflectance = [0.9, 0.9, 0.9]
        "#;
        let folder = env!("CARGO_MANIFEST_DIR");
        Prepared::build(&Scene::parse(text, folder.as_ref(), "test").expect("valid"))
    }

    fn look(scene: &Prepared, x: f64, y: f64) -> Look {
        Look::through(scene, (x, y), DVec2::ZERO)
    }

    fn corners(scene: &Prepared, x: f64, y: f64) -> [Look; 4] {
        [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
            .map(|(right, down)| look(scene, x + right, y + down))
    }

    #[test]
    fn rays_meet_what_follows_from_the_corners() {
        let scene = scene();
        for (x, y) in [(15.0, 25.0), (250.0, 40.0), (40.0, 200.0), (300.0, 220.0)] {
            let corners = corners(&scene, x, y);
            let centre = look(&scene, x + 0.5, y + 0.5);
            let patch = Patch::of(&scene, corners.each_ref(), &centre).expect("one surface");
            for offset in [(0.1, 0.8), (0.5, 0.5), (0.9, 0.3)] {
                let exact = look(&scene, x + offset.0, y + offset.1);
                let seen = patch.seen(offset);
                let met = patch.look(offset, &seen);
                let extent_m = corners[0].point().distance(corners[3].point());
                let off_m = met.point().distance(exact.point());
                assert!(off_m < 0.01 * extent_m, "{x} {y}: {off_m} of {extent_m}");
                for k in 0..3 {
                    let of = |a: f64, b: f64| (a / b - 1.0).abs();
                    let off = of(seen.transmittance[k], exact.transmittance[k]);
                    assert!(off < 1e-3, "{x} {y}: {off}");
                    let off = of(seen.reflectance[k], exact.reflectance[k]);
                    assert!(off < 0.01, "{x} {y}: {off}");
                }
            }
        }
    }

    #[test]
    fn nothing_follows_from_corners_of_two_surfaces_or_beside_a_bend() {
        let scene = scene();
        let (x, y) = (15.0, 25.0);
        let of = |corners: [Look; 4], centre: Look| {
            Patch::of(&scene, corners.each_ref(), &centre).is_some()
        };
        let centre = |right: f64| look(&scene, x + right, y + 0.5);
        assert!(of(corners(&scene, x, y), centre(0.5)));
        assert!(!of(corners(&scene, x, y), centre(0.8)));
        let post = (0..320).find(|&x| look(&scene, f64::from(x), 100.5).kind != centre(0.5).kind);
        let edge = f64::from(post.expect("the post is in view")) - 1.0;
        assert!(!of(
            corners(&scene, edge, 100.0),
            look(&scene, edge + 0.5, 100.5)
        ));
    }
}
