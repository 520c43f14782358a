//! Layers without noise that guide the regression: for every pixel the shares of it that belong to connected surfaces
//! ("fragments"), with what is known of each. Whatever rays have to find out, they find out twice, once for each half of the
//! samples, so that what they miss is in the difference of the halves.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec2;
use rayon::prelude::*;

use super::face::Face;
use super::gather::Gathered;
use super::look::Look;
use super::regions::Regions;
use super::samples::{Aim, Half, Points, is_clear};
use crate::prepare::Prepared;
use crate::sampling::{Rng, sobol::scrambled};

/// Rays through a pixel for each half, where they differ, and where there is an edge: a sliver of a bright surface before a
/// dark one rules the pixel.
const LOOKS: u32 = 8;
pub(super) const VARIED_LOOKS: u32 = 32;
const EDGE_LOOKS: u32 = 128;
/// Of how many rays one finds the straight light.
const LIT_EVERY: u32 = 4;
/// Relative deviation of reflectance in a pixel, and relative difference of light, above which more rays are sent.
const VARIED: f64 = 0.02;
/// Key of the rays' numbers.
const LOOK_SEED: u64 = 0x6c6f_6f6b;

/// Of a fragment that belongs to no region: it is seen at no pixel's centre.
pub(super) const NO_REGION: u32 = u32::MAX;

/// What is known of a fragment from rays through all of the pixel; values are means over the fragment.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Shown {
    /// Part of the pixel's area.
    pub(super) share: f32,
    /// Reflectance times transmittance.
    pub(super) seen: [f32; 3],
    /// Transmittance of the water before it.
    pub(super) transmittance: [f32; 3],
    /// Light of lamps that comes straight from it over `seen`, W/(m² sr).
    pub(super) lamps: [f32; 3],
    /// The same of sun and sky.
    pub(super) day: [f32; 3],
}

/// What image points of samples have seen of a fragment.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sampled {
    /// Part of the points.
    pub(super) share: f32,
    /// Mean reflectance times transmittance there.
    pub(super) seen: [f32; 3],
}

impl Shown {
    /// As points all over the pixel have seen it.
    pub(super) fn sampled(&self) -> Sampled {
        Sampled {
            share: self.share,
            seen: self.seen,
        }
    }
}

/// The part of a pixel in which one connected surface is seen, for each half of the samples.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Fragment {
    /// The connected surface.
    pub(super) region: u32,
    /// Mean of unit normals.
    pub(super) normal: [f32; 3],
    /// As rays through all of the pixel show it.
    pub(super) shown: [Shown; 2],
    /// As walks have seen it.
    pub(super) walked: [Sampled; 2],
    /// As unscattered lamp light has seen it.
    pub(super) lit: [Sampled; 2],
}

/// The guides of a picture.
pub(super) struct Guides {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Fragments, those of a pixel one after the other, row by row.
    pub(super) fragments: Vec<Fragment>,
    /// Where those of each pixel begin, and the end.
    starts: Vec<u32>,
    /// Whether samples of the pixel have seen something else than rays through all of it.
    varied: Vec<bool>,
}

/// Per pixel of a row its fragments, and whether light or reflectance varies in it.
type Row = Vec<(Vec<Fragment>, bool)>;

impl Guides {
    /// Looks through every pixel, and along the rays of the samples where they may differ; none where it is cancelled.
    pub(super) fn of(
        scene: &Prepared,
        halves: &[Half<'_>; 2],
        cancel: &AtomicBool,
    ) -> Option<Self> {
        let looker = Looker {
            scene,
            halves,
            regions: Regions::of(scene),
        };
        let (width, height) = (looker.regions.width, looker.regions.height);
        let row = |y: usize| {
            let is_wanted = !cancel.load(Ordering::Relaxed);
            is_wanted.then(|| (0..width).map(|x| looker.pixel(x, y)).collect())
        };
        let rows: Option<Vec<Row>> = (0..height).into_par_iter().map(row).collect();
        let mut guides = Self {
            width,
            height,
            fragments: Vec::with_capacity(width * height),
            starts: Vec::with_capacity(width * height + 1),
            varied: Vec::with_capacity(width * height),
        };
        for (fragments, varied) in rows?.iter().flatten() {
            guides.starts.push(guides.fragments.len() as u32);
            guides.fragments.extend_from_slice(fragments);
            guides.varied.push(*varied);
        }
        guides.starts.push(guides.fragments.len() as u32);
        Some(guides)
    }

    /// The fragments of a pixel.
    pub(super) fn pixel(&self, index: usize) -> &[Fragment] {
        &self.fragments[self.starts[index] as usize..self.starts[index + 1] as usize]
    }

    /// Whether samples of a pixel have seen something else than rays through all of it.
    pub(super) fn is_varied(&self, index: usize) -> bool {
        self.varied[index]
    }

    /// The only fragment of a pixel that shows one region.
    pub(super) fn pure(&self, index: usize) -> Option<&Fragment> {
        match self.pixel(index) {
            [only] if only.region != NO_REGION => Some(only),
            _ => None,
        }
    }
}

/// What looks through pixels.
struct Looker<'a> {
    scene: &'a Prepared,
    halves: &'a [Half<'a>; 2],
    regions: Regions,
}

impl Looker<'_> {
    /// The fragments of a pixel, and whether samples have seen something else.
    fn pixel(&self, x: usize, y: usize) -> (Vec<Fragment>, bool) {
        let mut gathered = Gathered::default();
        for half in 0..2 {
            self.look_through(&mut gathered, half, (x, y), 0..LOOKS, LIT_EVERY);
        }
        let light_varies = gathered.light_deviation() > VARIED;
        if gathered.deviation() > VARIED || light_varies {
            let lit_every = if light_varies { 1 } else { LIT_EVERY };
            self.look_closer(&mut gathered, (x, y), lit_every);
        }
        if gathered.has_edge() {
            for half in 0..2 {
                let looks = VARIED_LOOKS..EDGE_LOOKS;
                self.look_through(&mut gathered, half, (x, y), looks, LIT_EVERY);
            }
        }
        let varied = gathered.deviation() > 0.0;
        if varied {
            self.follow_samples(&mut gathered, (x, y));
        }
        (gathered.fragments(), varied)
    }

    /// Adds rays to what is known of a pixel in which something varies. On one face all of them follow from those through the corners.
    fn look_closer(&self, gathered: &mut Gathered, (x, y): (usize, usize), lit_every: u32) {
        let looks = LOOKS..VARIED_LOOKS;
        let corners = self.corners(gathered, (x, y));
        let face = corners
            .as_ref()
            .and_then(|corners| Face::of(self.scene, corners))
            .filter(|face| face.is_met(self.regions.centre(x, y)));
        for half in 0..2 {
            match &face {
                Some(face) => self.look_at(gathered, face, half, (x, y), looks.clone(), lit_every),
                None => self.look_through(gathered, half, (x, y), looks.clone(), lit_every),
            }
        }
    }

    /// What the corners of a pixel see, row by row; none where that says little of what is in between.
    fn corners(&self, gathered: &Gathered, (x, y): (usize, usize)) -> Option<[Look; 4]> {
        if gathered.has_edge() || self.has_opening() {
            return None;
        }
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
        Some(corners.map(|offset| {
            let on_opening = DVec2::ZERO;
            self.look(x, y, &Aim { offset, on_opening })
        }))
    }

    /// Adds rays to what is known for a half.
    fn look_through(
        &self,
        gathered: &mut Gathered,
        half: usize,
        (x, y): (usize, usize),
        looks: Range<u32>,
        lit_every: u32,
    ) {
        let key = self.key(half, (x, y));
        for index in looks {
            let number = |dimension| scrambled(index, dimension, key);
            let look = self.look(x, y, &Aim::of(self.has_opening(), number));
            let found = gathered.of_region(self.regions.of_look(&look, x, y));
            found.show(half, &look);
            if index % lit_every == 0 || found.is_dark(half) {
                let light = look.straight_light(self.scene, (number(2), number(3)));
                found.light(half, &look, &light);
            }
        }
    }

    /// The same in a pixel that shows one face alone.
    fn look_at(
        &self,
        gathered: &mut Gathered,
        face: &Face<'_>,
        half: usize,
        (x, y): (usize, usize),
        looks: Range<u32>,
        lit_every: u32,
    ) {
        let key = self.key(half, (x, y));
        let region = self.regions.of_look(self.regions.centre(x, y), x, y);
        let found = gathered.of_region(region);
        for index in looks {
            let number = |dimension| scrambled(index, dimension, key);
            let look = face.look((number(0), number(1)));
            found.show(half, &look);
            if index % lit_every == 0 {
                let light = look.straight_light(self.scene, (number(2), number(3)));
                found.light(half, &look, &light);
            }
        }
    }

    /// What the numbers of the rays through a pixel for a half are keyed by.
    fn key(&self, half: usize, (x, y): (usize, usize)) -> u32 {
        let pixel = (y * self.regions.width + x) as u32;
        Rng::new(LOOK_SEED, pixel, half as u32, 0).bits()
    }

    fn has_opening(&self) -> bool {
        self.scene.camera.opening.is_some()
    }

    /// Looks along the rays of the samples.
    fn follow_samples(&self, gathered: &mut Gathered, (x, y): (usize, usize)) {
        let clear = is_clear(self.scene, self.regions.centre(x, y));
        for (half, samples) in self.halves.iter().enumerate() {
            for aim in samples.points((x, y), self.has_opening(), Points::Walks) {
                let look = self.look(x, y, &aim);
                let found = gathered.of_region(self.regions.of_look(&look, x, y));
                found.walked[half].add(&look);
                if clear == Some(false) {
                    found.lit[half].add(&look);
                }
            }
            if clear == Some(true) && !self.scene.lamps.is_empty() {
                for aim in samples.points((x, y), self.has_opening(), Points::Lit) {
                    let look = self.look(x, y, &aim);
                    let found = gathered.of_region(self.regions.of_look(&look, x, y));
                    found.lit[half].add(&look);
                }
            }
        }
    }

    fn look(&self, x: usize, y: usize, aim: &Aim) -> Look {
        let (px, py) = aim.offset;
        Look::through(self.scene, (x as f64 + px, y as f64 + py), aim.on_opening)
    }
}
