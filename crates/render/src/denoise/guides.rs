//! Layers without noise that guide the regression: for every pixel the shares of it that belong to connected surfaces
//! ("fragments"), with what is known of each.

use rayon::prelude::*;

use super::look::{Look, StraightLight};
use super::regions::Regions;
use crate::prepare::Prepared;

/// Rays through a pixel.
pub(super) const LOOKS: usize = 16;
/// Rays of them at whose ends the straight light is looked for.
const LIT_LOOKS: usize = 4;

/// Of a fragment that belongs to no region: it is seen at no pixel's centre.
pub(super) const NO_REGION: u32 = u32::MAX;

/// The part of a pixel in which one connected surface is seen; values are means over that part.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Fragment {
    /// The connected surface.
    pub(super) region: u32,
    /// Part of the pixel's area.
    pub(super) share: f32,
    /// Transmittance of the water before it.
    pub(super) transmittance: [f32; 3],
    /// Reflectance times transmittance.
    pub(super) seen: [f32; 3],
    /// Light of lamps that comes straight from it, W/(m² sr).
    pub(super) lamps: [f32; 3],
    /// Light of sun and sky that comes straight from it, W/(m² sr).
    pub(super) day: [f32; 3],
    /// Unit normal.
    pub(super) normal: [f32; 3],
}

/// The guides of a picture.
pub(super) struct Guides {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Fragments, those of a pixel one after the other, row by row.
    pub(super) fragments: Vec<Fragment>,
    /// Where those of each pixel begin, and the end.
    starts: Vec<u32>,
}

impl Guides {
    /// Looks through every pixel.
    pub(super) fn of(scene: &Prepared) -> Self {
        let regions = Regions::of(scene);
        let (width, height) = (regions.width, regions.height);
        let rows: Vec<Vec<Vec<Fragment>>> = (0..height)
            .into_par_iter()
            .map(|y| {
                (0..width)
                    .map(|x| fragments(scene, &regions, x, y))
                    .collect()
            })
            .collect();
        let mut all = Vec::with_capacity(width * height);
        let mut starts = Vec::with_capacity(width * height + 1);
        for pixel in rows.iter().flatten() {
            starts.push(all.len() as u32);
            all.extend_from_slice(pixel);
        }
        starts.push(all.len() as u32);
        Self {
            width,
            height,
            fragments: all,
            starts,
        }
    }

    /// The fragments of a pixel.
    pub(super) fn pixel(&self, index: usize) -> &[Fragment] {
        &self.fragments[self.starts[index] as usize..self.starts[index + 1] as usize]
    }

    /// The only fragment of a pixel that shows one region.
    pub(super) fn pure(&self, index: usize) -> Option<&Fragment> {
        match self.pixel(index) {
            [only] if only.region != NO_REGION => Some(only),
            _ => None,
        }
    }
}

/// Places of the rays in a pixel: a net whose points have each of 16 columns and rows for themselves.
pub(super) fn place(index: usize) -> (f64, f64) {
    let reversed = (index as u32).reverse_bits() >> 28;
    let n = LOOKS as f64;
    ((index as f64 + 0.5) / n, (f64::from(reversed) + 0.5) / n)
}

fn fragments(scene: &Prepared, regions: &Regions, x: usize, y: usize) -> Vec<Fragment> {
    let mut found: Vec<(u32, Sums)> = Vec::with_capacity(1);
    for index in 0..LOOKS {
        let (px, py) = place(index);
        let look = Look::through(scene, x as f64 + px, y as f64 + py);
        let region = regions.of_look(&look, x, y);
        let sums = match found.iter_mut().find(|(own, _)| *own == region) {
            Some((_, sums)) => sums,
            None => {
                found.push((region, Sums::default()));
                &mut found.last_mut().expect("just added").1
            }
        };
        sums.add(&look);
        if index % (LOOKS / LIT_LOOKS) == 0 || sums.lit.is_empty() {
            sums.lit.push(index_light(scene, &look));
        }
    }
    found
        .iter()
        .map(|(region, sums)| sums.fragment(*region))
        .collect()
}

/// Straight light over the reflectance that it is proportional to.
fn index_light(scene: &Prepared, look: &Look) -> StraightLight {
    let light = look.straight_light(scene);
    let over = |light: [f64; 3]| {
        std::array::from_fn(|k| {
            let seen = look.reflectance[k] * look.transmittance[k];
            if seen > 0.0 { light[k] / seen } else { 0.0 }
        })
    };
    StraightLight {
        lamps: over(light.lamps),
        day: over(light.day),
    }
}

#[derive(Default)]
struct Sums {
    count: f64,
    transmittance: [f64; 3],
    seen: [f64; 3],
    normal: [f64; 3],
    lit: Vec<StraightLight>,
}

impl Sums {
    fn add(&mut self, look: &Look) {
        self.count += 1.0;
        let normal = look.shading_normal.to_array();
        for k in 0..3 {
            self.transmittance[k] += look.transmittance[k];
            self.seen[k] += look.reflectance[k] * look.transmittance[k];
            self.normal[k] += normal[k];
        }
    }

    fn fragment(&self, region: u32) -> Fragment {
        let mean = |sum: [f64; 3]| sum.map(|sum| (sum / self.count) as f32);
        let seen = mean(self.seen);
        let lit = self.lit.len() as f64;
        let light = |of: fn(&StraightLight) -> [f64; 3]| {
            std::array::from_fn(|k| {
                let mean = self.lit.iter().map(|light| of(light)[k]).sum::<f64>() / lit;
                seen[k] * mean as f32
            })
        };
        Fragment {
            region,
            share: (self.count / LOOKS as f64) as f32,
            transmittance: mean(self.transmittance),
            seen,
            lamps: light(|light| light.lamps),
            day: light(|light| light.day),
            normal: mean(self.normal),
        }
    }
}
