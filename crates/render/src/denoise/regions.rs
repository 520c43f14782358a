//! Connected surfaces as the picture shows them: neighbouring pixels belong together where their centres show one object
//! without an edge in depth between them. Surfaces too small for fits of their own, such as growth far away, are one region an
//! object.

use std::collections::HashMap;

use glam::DVec2;
use rayon::prelude::*;

use super::guides::NO_REGION;
use super::look::Look;
use crate::prepare::Prepared;

/// Sine of the largest angle between a surface and the line from a point of it to the next.
const LARGEST_SLOPE: f64 = 0.5;
/// Largest distance of two neighbouring points over that of neighbours on a surface that faces the camera less.
const LARGEST_GAP: f64 = 4.0;
/// Farthest pixel whose centre may show the same surface as a ray.
const REACH_PX: usize = 2;
/// Pixels below which a connected surface is small: fits need about as many for all of their terms.
const SMALL_PX: usize = 32;
/// Least cosine towards the camera that counts.
const LEAST_COSINE: f64 = 0.02;

/// The connected surfaces of a picture.
pub(super) struct Regions {
    pub(super) width: usize,
    pub(super) height: usize,
    /// What the centre of each pixel shows.
    centres: Vec<Look>,
    /// The connected surface there.
    labels: Vec<u32>,
    /// The region of the small surfaces of an object.
    small: HashMap<u32, u32>,
    /// Angle between neighbouring pixels, rad.
    angle: f64,
}

impl Regions {
    pub(super) fn of(scene: &Prepared) -> Self {
        let camera = &scene.camera;
        let (width, height) = (camera.width as usize, camera.height as usize);
        let centre = |i: usize| {
            Look::through(
                scene,
                ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5),
                DVec2::ZERO,
            )
        };
        let centres: Vec<Look> = (0..width * height).into_par_iter().map(centre).collect();
        let (x, y) = (0.5 * width as f64, 0.5 * height as f64);
        let angle = camera
            .direction(x, y)
            .distance(camera.direction(x + 1.0, y));
        let mut regions = Self {
            width,
            height,
            centres,
            labels: Vec::new(),
            small: HashMap::new(),
            angle,
        };
        regions.labels = regions.connected();
        regions.join_small();
        regions
    }

    /// Makes one region of the small surfaces of each object: what is known of them, point by point, tells their depths and light apart.
    fn join_small(&mut self) {
        let mut sizes = vec![0_usize; self.labels.len()];
        for &label in &self.labels {
            sizes[label as usize] += 1;
        }
        for (label, centre) in self.labels.iter_mut().zip(&self.centres) {
            if sizes[*label as usize] < SMALL_PX {
                *label = *self.small.entry(centre.kind).or_insert(*label);
            }
        }
    }

    /// The region of a ray through pixel (`x`, `y`): that of the centre of the pixel or of a neighbour, whichever shows the
    /// same surface; else that of the small surfaces of what it meets.
    pub(super) fn of_look(&self, look: &Look, x: usize, y: usize) -> u32 {
        let own = y * self.width + x;
        if self.join(look, &self.centres[own]) {
            return self.labels[own];
        }
        (1..=REACH_PX)
            .find_map(|reach| self.of_neighbour(look, (x, y), reach))
            .or_else(|| self.small.get(&look.kind).copied())
            .unwrap_or(NO_REGION)
    }

    /// The region of a neighbour at a distance of `reach` pixels.
    fn of_neighbour(&self, look: &Look, (x, y): (usize, usize), reach: usize) -> Option<u32> {
        let columns = x.saturating_sub(reach)..(x + reach + 1).min(self.width);
        let rows = y.saturating_sub(reach)..(y + reach + 1).min(self.height);
        let all = rows.flat_map(|row| columns.clone().map(move |column| (column, row)));
        all.filter(|&(column, row)| column.abs_diff(x).max(row.abs_diff(y)) == reach)
            .map(|(column, row)| row * self.width + column)
            .find(|&other| self.join(look, &self.centres[other]))
            .map(|other| self.labels[other])
    }

    /// What the centre of pixel (`x`, `y`) shows.
    pub(super) fn centre(&self, x: usize, y: usize) -> &Look {
        &self.centres[y * self.width + x]
    }

    /// The region at the centre of pixel (`x`, `y`).
    pub(super) fn label(&self, x: usize, y: usize) -> u32 {
        self.labels[y * self.width + x]
    }

    fn connected(&self) -> Vec<u32> {
        let mut parents: Vec<u32> = (0..self.centres.len() as u32).collect();
        for y in 0..self.height {
            for x in 0..self.width {
                let own = y * self.width + x;
                let right = (x + 1 < self.width).then_some(own + 1);
                let below = (y + 1 < self.height).then_some(own + self.width);
                for other in right.into_iter().chain(below) {
                    if self.join(&self.centres[own], &self.centres[other]) {
                        let (one, two) = (root(&mut parents, own), root(&mut parents, other));
                        parents[one.max(two)] = one.min(two) as u32;
                    }
                }
            }
        }
        (0..parents.len())
            .map(|i| root(&mut parents, i) as u32)
            .collect()
    }

    /// Whether two points, a pixel or less from each other in the picture, lie on one surface without an edge between them.
    fn join(&self, one: &Look, other: &Look) -> bool {
        if one.kind != other.kind {
            return false;
        }
        if one.range_m.is_infinite() || other.range_m.is_infinite() {
            return one.range_m == other.range_m;
        }
        let gap = other.apparent - one.apparent;
        let square = gap.length_squared();
        let aside = |look: &Look| look.normal.dot(gap).powi(2);
        let cosine = one.facing.max(other.facing).max(LEAST_COSINE);
        let spacing = self.angle * one.range_m.min(other.range_m);
        aside(one).max(aside(other)) <= LARGEST_SLOPE * LARGEST_SLOPE * square
            && square * cosine * cosine <= (LARGEST_GAP * spacing).powi(2)
    }
}

fn root(parents: &mut [u32], index: usize) -> usize {
    let mut index = index;
    while parents[index] as usize != index {
        parents[index] = parents[parents[index] as usize];
        index = parents[index] as usize;
    }
    index
}

/// The element of a region in a list in order of regions, to which `none` is added where it is not there yet.
pub(super) fn entry<T>(
    list: &mut Vec<T>,
    region: u32,
    region_of: impl Fn(&T) -> u32,
    none: impl FnOnce() -> T,
) -> &mut T {
    let index = match list.binary_search_by_key(&region, region_of) {
        Ok(index) => index,
        Err(index) => {
            list.insert(index, none());
            index
        }
    };
    &mut list[index]
}
