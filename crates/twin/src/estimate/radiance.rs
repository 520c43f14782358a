//! Radiance of an image from its smooth parts and the target's texture, on a lattice of its pixels.

use super::basis::{Basis, legendre};
use super::fields::{Fields, GROUPS};
use super::guess::Guess;
use super::pyramid::TexturePyramid;
use super::spread::{Scattered, Spread};
use super::target_view::{Sight, TargetView};

/// Most points along each edge of a pixel at which its texture is taken.
const MOST_POINTS: usize = 8;

/// One source of light (daylight, or all lamps at 100 %) in one view of a target.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// Whether it is the lamps.
    pub lamps: bool,
    /// Whether its light is the same in the upper and the lower half of the image.
    pub symmetric: bool,
    /// The view.
    pub view: &'a TargetView,
    /// The target's texture.
    pub pyramid: &'a TexturePyramid,
    /// What the water does to camera rays.
    pub spread: &'a Spread,
    /// Shape of the irradiance.
    pub guess: &'a Guess,
}

impl Source<'_> {
    /// Reflected radiance per fitted irradiance at a point: M times the guess.
    pub fn at_point(&self, sight: &Sight) -> [f64; 3] {
        let (u, v) = self.view.tiles(sight.point);
        let sharp = self.pyramid.sample(0, u, v);
        self.reflected(sight, sharp, self.spread.scattered())
    }

    /// The same with the texture's own value (level 0) and the fate of scattered rays given.
    fn reflected(&self, sight: &Sight, sharp: [f32; 3], rays: &Scattered) -> [f64; 3] {
        let (u, v) = self.view.tiles(sight.point);
        let direct = self.spread.unscattered(sight);
        let seen = rays.colours().seen(sharp);
        let mut blurred: [f32; 3] = std::array::from_fn(|k| rays.levels(k)[0] * seen[k]);
        for level in 1..self.pyramid.levels() {
            let weights: [f32; 3] = std::array::from_fn(|k| rays.levels(k)[level]);
            if weights == [0.0; 3] {
                continue;
            }
            let texel = rays.colours().seen(self.pyramid.sample(level, u, v));
            (0..3).for_each(|k| blurred[k] += weights[k] * texel[k]);
        }
        let (transmitted, sharp) = (direct.transmittance, direct.colours.seen(sharp));
        let scattered = rays.share(self.view.incidence(sight.direction));
        let guess = self.guess.at(sight.point);
        std::array::from_fn(|k| {
            guess[k] * (transmitted[k] * f64::from(sharp[k]) + scattered[k] * f64::from(blurred[k]))
        })
    }
}

/// Every `step`-th pixel of an image in both directions, the middle one of each block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lattice {
    /// Image width, pixels.
    pub width: usize,
    /// Image height, pixels.
    pub height: usize,
    /// Distance of the pixels taken, >= 1.
    pub step: usize,
}

impl Lattice {
    /// Pixels per row.
    pub fn columns(&self) -> usize {
        self.width / self.step
    }

    /// Rows.
    pub fn rows(&self) -> usize {
        self.height / self.step
    }

    /// Centre of the pixel at (`column`, `row`) of the lattice, pixels.
    pub fn centre(&self, column: usize, row: usize) -> (f64, f64) {
        let centre = |i: usize| (i * self.step + self.step / 2) as f64 + 0.5;
        (centre(column), centre(row))
    }
}

/// Reflected radiance per fitted irradiance (M times the guess) of every pixel of a lattice.
#[derive(Clone, Debug)]
pub struct Reflection {
    lattice: Lattice,
    /// One for all estimates, or one for each.
    values: Vec<Vec<[f32; 3]>>,
}

impl Reflection {
    /// Of `source`, the texture averaged over each pixel.
    pub fn new(source: &Source, lattice: Lattice) -> Self {
        let values = reflected(source, &pixels(source, lattice), source.spread.scattered());
        Self {
            lattice,
            values: vec![values],
        }
    }

    /// One from each group of the walks that the spread comes from: their differences are the error that the
    /// number of walks leaves. The irradiance was fitted with all walks; with those of a group it would have made up for
    /// their mean, so each has the mean of all.
    pub fn of_groups(source: &Source, lattice: Lattice) -> Self {
        let pixels = pixels(source, lattice);
        let mean =
            |values: &[[f32; 3]], k: usize| values.iter().map(|v| f64::from(v[k])).sum::<f64>();
        let all = reflected(source, &pixels, source.spread.scattered());
        let of_group = |rays: &Scattered| {
            let mut values = reflected(source, &pixels, rays);
            for k in 0..3 {
                let factor = mean(&all, k) / mean(&values, k).max(f64::MIN_POSITIVE);
                values.iter_mut().for_each(|v| v[k] *= factor as f32);
            }
            values
        };
        Self {
            lattice,
            values: source.spread.groups().iter().map(of_group).collect(),
        }
    }

    /// None at all: what is left of an image is its veil.
    pub fn none(lattice: Lattice) -> Self {
        Self {
            lattice,
            values: vec![vec![[0.0; 3]; lattice.columns() * lattice.rows()]],
        }
    }
}

/// What the pixels of a lattice see: the middle's sight and the mean texture; nothing beside the target.
fn pixels(source: &Source, lattice: Lattice) -> Vec<Option<(Sight, [f32; 3])>> {
    let view = source.view;
    let pixel_m = view
        .sight(lattice.width as f64 / 2.0, lattice.height as f64 / 2.0)
        .map_or(0.0, |s| s.range_m / view.camera.focal_px.x);
    let points = ((2.0 * pixel_m / source.pyramid.texel_m()).ceil() as usize).clamp(2, MOST_POINTS);
    let of_row = |row| {
        (0..lattice.columns()).map(move |column| {
            let (x, y) = lattice.centre(column, row);
            let sight = view.sight(x, y)?;
            Some((sight, pixel_texture(source, x, y, points)))
        })
    };
    (0..lattice.rows()).flat_map(of_row).collect()
}

/// Reflected radiance per fitted irradiance of every pixel.
fn reflected(
    source: &Source,
    pixels: &[Option<(Sight, [f32; 3])>],
    rays: &Scattered,
) -> Vec<[f32; 3]> {
    let of_pixel = |pixel: &Option<(Sight, [f32; 3])>| match pixel {
        Some((sight, texture)) => source.reflected(sight, *texture, rays).map(|v| v as f32),
        None => [0.0; 3],
    };
    pixels.iter().map(of_pixel).collect()
}

/// Mean texture over the pixel around (`x`, `y`).
fn pixel_texture(source: &Source, x: f64, y: f64, points: usize) -> [f32; 3] {
    let mut sum = [0f32; 3];
    let centre = |i: usize| (i as f64 + 0.5) / points as f64 - 0.5;
    for (i, j) in (0..points).flat_map(|i| (0..points).map(move |j| (i, j))) {
        if let Some(sight) = source.view.sight(x + centre(i), y + centre(j)) {
            let (u, v) = source.view.tiles(sight.point);
            let texel = source.pyramid.sample(0, u, v);
            (0..3).for_each(|k| sum[k] += texel[k]);
        }
    }
    sum.map(|s| s / (points * points) as f32)
}

/// Radiance of the pixels of a lattice, in several independent estimates.
#[derive(Clone, Debug)]
pub struct RadianceImage {
    /// The lattice.
    pub lattice: Lattice,
    /// Per estimate the pixels, row by row.
    pub estimates: Vec<Vec<[f32; 3]>>,
}

impl RadianceImage {
    /// The first estimate `n` times, to be combined with `n` estimates of other light.
    pub fn repeated(&self, n: usize) -> Self {
        Self {
            lattice: self.lattice,
            estimates: vec![self.estimates[0].clone(); n],
        }
    }
}

/// Which groups of paths make an estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Estimates {
    /// Two, each of half of the groups.
    Halves,
    /// One of each group.
    Groups,
    /// One of all groups.
    Whole,
}

impl RadianceImage {
    /// The image of `fields`.
    pub fn new(source: &Source, fields: &Fields, reflection: &Reflection, kind: Estimates) -> Self {
        let parts: Vec<(usize, usize)> = match kind {
            Estimates::Halves => vec![(0, GROUPS / 2), (GROUPS / 2, GROUPS)],
            Estimates::Groups => (0..GROUPS).map(|g| (g, g + 1)).collect(),
            Estimates::Whole => vec![(0, GROUPS)],
        };
        let basis = Fields::basis(source.lamps, source.symmetric);
        let reflections = reflection.values.iter().cycle();
        let estimates = parts
            .into_iter()
            .zip(reflections)
            .map(|((from, to), values)| {
                estimate(&basis, fields.mean_of(from, to), reflection.lattice, values)
            })
            .collect();
        Self {
            lattice: reflection.lattice,
            estimates,
        }
    }
}

fn estimate(
    basis: &Basis,
    (veil, irradiance): ([Vec<f64>; 3], [Vec<f64>; 3]),
    lattice: Lattice,
    reflection: &[[f32; 3]],
) -> Vec<[f32; 3]> {
    let coordinate = |at: f64, size: usize| 2.0 * at / size as f64 - 1.0;
    let in_p: Vec<_> = (0..lattice.columns())
        .map(|column| legendre(coordinate(lattice.centre(column, 0).0, lattice.width)))
        .collect();
    let mut pixels = Vec::with_capacity(reflection.len());
    for row in 0..lattice.rows() {
        let q = coordinate(lattice.centre(0, row).1, lattice.height);
        let veil_row: [_; 3] = std::array::from_fn(|k| basis.row(&veil[k], q));
        let irradiance_row: [_; 3] = std::array::from_fn(|k| basis.row(&irradiance[k], q));
        for (column, in_p) in in_p.iter().enumerate() {
            let reflected = &reflection[row * lattice.columns() + column];
            pixels.push(std::array::from_fn(|k| {
                let veil = Basis::along_row(&veil_row[k], in_p);
                let irradiance = Basis::along_row(&irradiance_row[k], in_p);
                (veil + irradiance * f64::from(reflected[k])) as f32
            }));
        }
    }
    pixels
}
