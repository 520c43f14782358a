//! Layers without noise that guide the regression: for every pixel the shares of it that belong to connected surfaces
//! ("fragments"), with what is known of each. Whatever rays have to find out, they find out twice, once for each half of the
//! samples, so that what they miss is in the difference of the halves.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec2;
use rayon::prelude::*;

use super::gather::Gathered;
use super::look::Look;
use super::patch::Patch;
use super::regions::Regions;
use super::samples::{Aim, Half, Points, is_clear};
use crate::prepare::Prepared;
use crate::sampling::{Rng, sobol::scrambled};

/// Rays through a pixel for each half: those that are followed in any case, all, as many where they differ, and where there is an
/// edge: a sliver of a bright surface before a dark one rules the pixel.
const FIRST_LOOKS: u32 = 4;
const LOOKS: u32 = 8;
pub(super) const VARIED_LOOKS: u32 = 32;
const EDGE_LOOKS: u32 = 128;
/// Of how many rays one finds the straight light.
const LIT_EVERY: u32 = 4;
/// Relative deviation of reflectance in a pixel, and relative difference of light, above which more rays are sent.
const VARIED: f64 = 0.02;
/// Rows of pixels that are looked through at once.
const ROWS_AT_ONCE: usize = 8;
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

/// Per pixel of some rows its fragments, and whether light or reflectance varies in it.
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
        let bands: Vec<usize> = (0..height).step_by(ROWS_AT_ONCE).collect();
        let band = |first: usize| {
            let rows = first..(first + ROWS_AT_ONCE).min(height);
            let is_wanted = !cancel.load(Ordering::Relaxed);
            is_wanted.then(|| looker.band(rows))
        };
        let rows: Option<Vec<Row>> = bands.into_par_iter().map(band).collect();
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
    /// The pixels of some rows.
    fn band(&self, rows: Range<usize>) -> Row {
        let width = self.regions.width;
        let corners: Vec<Look> = match self.has_opening() {
            true => Vec::new(),
            false => (rows.start..=rows.end)
                .flat_map(|y| (0..=width).map(move |x| (x, y)))
                .map(|(x, y)| Look::through(self.scene, (x as f64, y as f64), DVec2::ZERO))
                .collect(),
        };
        let corners_of = |x: usize, y: usize| {
            let above = (y - rows.start) * (width + 1) + x;
            let below = above + width + 1;
            let corner = |index: usize| corners.get(index);
            Some([
                corner(above)?,
                corner(above + 1)?,
                corner(below)?,
                corner(below + 1)?,
            ])
        };
        rows.clone()
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| self.pixel((x, y), corners_of(x, y)))
            .collect()
    }

    /// The fragments of a pixel, whose corners show `corners`, and whether samples have seen something else.
    fn pixel(&self, (x, y): (usize, usize), corners: Option<[&Look; 4]>) -> (Vec<Fragment>, bool) {
        let mut gathered = Gathered::default();
        self.look_through(&mut gathered, (x, y), 0..FIRST_LOOKS, LIT_EVERY);
        let patch = corners
            .filter(|_| !gathered.has_edge())
            .and_then(|corners| Patch::of(self.scene, corners, self.regions.centre(x, y)));
        let look_on = |gathered: &mut Gathered, looks, lit_every| match &patch {
            Some(patch) => self.look_at(gathered, patch, (x, y), looks, lit_every),
            None => self.look_through(gathered, (x, y), looks, lit_every),
        };
        look_on(&mut gathered, FIRST_LOOKS..LOOKS, LIT_EVERY);
        let light_varies = gathered.light_deviation() > VARIED;
        if gathered.deviation() > VARIED || light_varies {
            let lit_every = if light_varies { 1 } else { LIT_EVERY };
            look_on(&mut gathered, LOOKS..VARIED_LOOKS, lit_every);
        }
        if gathered.has_edge() {
            let looks = VARIED_LOOKS..EDGE_LOOKS;
            self.look_through(&mut gathered, (x, y), looks, LIT_EVERY);
        }
        let varied = gathered.deviation() > 0.0;
        if varied {
            self.follow_samples(&mut gathered, (x, y));
        }
        (gathered.fragments(), varied)
    }

    /// Adds rays to what is known for both halves.
    fn look_through(
        &self,
        gathered: &mut Gathered,
        (x, y): (usize, usize),
        looks: Range<u32>,
        lit_every: u32,
    ) {
        for half in 0..2 {
            let key = self.key(half, (x, y));
            for index in looks.clone() {
                let number = |dimension| scrambled(index, dimension, key);
                self.add(gathered, half, (x, y), number, index % lit_every == 0);
            }
        }
    }

    /// The same in a pixel that shows one surface alone.
    fn look_at(
        &self,
        gathered: &mut Gathered,
        patch: &Patch<'_>,
        (x, y): (usize, usize),
        looks: Range<u32>,
        lit_every: u32,
    ) {
        let region = self.regions.label(x, y);
        for half in 0..2 {
            let key = self.key(half, (x, y));
            for index in looks.clone() {
                let number = |dimension| scrambled(index, dimension, key);
                let is_lit = index % lit_every == 0;
                if is_lit && !patch.knows_light() {
                    self.add(gathered, half, (x, y), number, true);
                    continue;
                }
                let found = gathered.of_region(region);
                let offset = (number(0), number(1));
                let seen = patch.seen(offset);
                found.show(half, &seen);
                if is_lit {
                    let look = patch.look(offset, &seen);
                    let light = look.straight_light(self.scene, (number(2), number(3)));
                    found.light(half, &look, &light);
                }
            }
        }
    }

    /// Adds one ray with these numbers, with the straight light at its end where that `is_lit` or nothing is known of it yet.
    fn add(
        &self,
        gathered: &mut Gathered,
        half: usize,
        (x, y): (usize, usize),
        number: impl Fn(usize) -> f64,
        is_lit: bool,
    ) {
        let look = self.look(x, y, &Aim::of(self.has_opening(), &number));
        let found = gathered.of_region(self.regions.of_look(&look, x, y));
        found.show(half, &look.seen());
        if is_lit || found.is_dark(half) {
            let light = look.straight_light(self.scene, (number(2), number(3)));
            found.light(half, &look, &light);
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
                found.walked[half].add(&look.seen());
                if clear == Some(false) {
                    found.lit[half].add(&look.seen());
                }
            }
            if clear == Some(true) && !self.scene.lamps.is_empty() {
                for aim in samples.points((x, y), self.has_opening(), Points::Lit) {
                    let look = self.look(x, y, &aim);
                    let found = gathered.of_region(self.regions.of_look(&look, x, y));
                    found.lit[half].add(&look.seen());
                }
            }
        }
    }

    fn look(&self, x: usize, y: usize, aim: &Aim) -> Look {
        let (px, py) = aim.offset;
        Look::through(self.scene, (x as f64 + px, y as f64 + py), aim.on_opening)
    }
}
