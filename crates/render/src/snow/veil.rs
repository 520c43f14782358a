//! The veil that flakes take the place of: once-scattered lamp light along the sight of every pixel, without bias.

use glam::DVec3;
use rayon::prelude::*;
use uw_media::Spectrum;

use super::source::Source;
use super::view::{NEAR_M, View};
use crate::sampling::Rng;

/// Random points on the sight of a pixel.
const SAMPLES: u32 = 16;
/// Parts of the sight that a guide knows, growing with distance.
const BINS: usize = 64;
/// Parts of the picture that a guide knows, along each side.
const TILES: usize = 16;
/// Points of a part of the picture that it is looked at in, along each side.
const LOOKS: usize = 2;
/// Share of the points that goes evenly to all parts of the sight.
const EVEN: f64 = 0.2;
/// Share of the veil beyond the farthest flakes.
const BEYOND: f64 = 1e-3;
/// Stream of the random numbers; those of flakes have others.
const STREAM: u32 = 0x7665_696c;
/// Steps of the sequence of points within a pixel (Roberts 2018).
const STEPS: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

/// Where on the sights the light of a lamp comes from.
pub(super) struct Guide {
    /// Bounds of the parts, m along the optical axis.
    edges_m: Vec<f64>,
    /// For each part of the picture the light up to each bound, 1 at the last one.
    cumulative: Vec<Vec<f64>>,
}

impl Guide {
    /// Looks at the light of `source` up to `far_m` at most; `None` where there is none.
    pub(super) fn new(view: &View<'_>, source: &Source<'_>, far_m: f64) -> Option<Self> {
        let ratio = (far_m / NEAR_M).powf(1.0 / BINS as f64);
        let mut edges_m: Vec<f64> = (0..=BINS).map(|i| NEAR_M * ratio.powi(i as i32)).collect();
        let tiles = (0..TILES * TILES).into_par_iter();
        let light: Vec<Vec<f64>> = tiles
            .map(|tile| light_of_tile(view, source, &edges_m, tile))
            .collect();
        let of_bin = |bin: usize| light.iter().map(|own| own[bin]).sum::<f64>();
        let all: f64 = (0..BINS).map(of_bin).sum();
        if !(all > 0.0) {
            return None;
        }
        let mut bins = BINS;
        let mut beyond = 0.0;
        while bins > 1 && beyond + of_bin(bins - 1) <= BEYOND * all {
            bins -= 1;
            beyond += of_bin(bins);
        }
        edges_m.truncate(bins + 1);
        let cumulative = light.iter().map(|own| accumulated(&own[..bins])).collect();
        Some(Self {
            edges_m,
            cumulative,
        })
    }

    /// Distance along the optical axis beyond which the water stays evenly scattering, m.
    pub(super) fn far_m(&self) -> f64 {
        self.edges_m[self.edges_m.len() - 1]
    }

    fn of_pixel(&self, view: &View<'_>, column: u32, row: u32) -> &[f64] {
        let part = |at: u32, side: u32| at as usize * TILES / side as usize;
        let camera = view.camera;
        &self.cumulative[part(row, camera.height) * TILES + part(column, camera.width)]
    }

    /// Share of the light up to a distance, of a part of the picture.
    fn share_up_to(&self, cumulative: &[f64], depth_m: f64) -> f64 {
        let bin = self.edges_m.partition_point(|&edge| edge <= depth_m);
        if bin == 0 {
            return 0.0;
        }
        if bin == self.edges_m.len() {
            return 1.0;
        }
        let (from, to) = (self.edges_m[bin - 1], self.edges_m[bin]);
        let within = (depth_m - from) / (to - from);
        cumulative[bin - 1] + within * (cumulative[bin] - cumulative[bin - 1])
    }

    /// The distance up to which a share of the light lies, and its density there, 1/m.
    fn place(&self, cumulative: &[f64], share: f64) -> (f64, f64) {
        let above = cumulative.partition_point(|&sum| sum <= share);
        let bin = above.clamp(1, cumulative.len() - 1);
        let (from, to) = (self.edges_m[bin - 1], self.edges_m[bin]);
        let part = cumulative[bin] - cumulative[bin - 1];
        let depth_m = from + (share - cumulative[bin - 1]) / part * (to - from);
        (depth_m, part / (to - from))
    }
}

/// Light that each part of the sight brings to a part of the picture.
fn light_of_tile(view: &View<'_>, source: &Source<'_>, edges_m: &[f64], tile: usize) -> Vec<f64> {
    let camera = view.camera;
    let size = [camera.width, camera.height].map(f64::from);
    let looks = (0..LOOKS * LOOKS).map(|look| {
        let along = |tile: usize, look: usize, size: f64| {
            size * (tile as f64 + (look as f64 + 0.5) / LOOKS as f64) / TILES as f64
        };
        let px = along(tile % TILES, look % LOOKS, size[0]);
        let py = along(tile / TILES, look / LOOKS, size[1]);
        camera.direction(px, py)
    });
    let looks: Vec<DVec3> = looks.collect();
    let of_bin = |edges: &[f64]| {
        let depth_m = (edges[0] * edges[1]).sqrt();
        let light = looks.iter().map(|&direction| {
            let cosine = direction.dot(camera.forward);
            let point = camera.position_m + depth_m / cosine * direction;
            source.at(point, [0.0; 2]).iter().sum::<f64>() / cosine
        });
        light.sum::<f64>() * (edges[1] - edges[0])
    };
    edges_m.windows(2).map(of_bin).collect()
}

/// Shares up to each bound, of which a part is even.
fn accumulated(light: &[f64]) -> Vec<f64> {
    let all: f64 = light.iter().sum();
    let even = 1.0 / light.len() as f64;
    let own = |light: &f64| match all > 0.0 {
        true => (1.0 - EVEN) * light / all + EVEN * even,
        false => even,
    };
    let mut sum = 0.0;
    let sums = light.iter().map(|light| {
        sum += own(light);
        sum
    });
    let mut cumulative: Vec<f64> = std::iter::once(0.0).chain(sums).collect();
    let whole = cumulative[light.len()];
    cumulative.iter_mut().for_each(|sum| *sum /= whole);
    cumulative
}

/// Once-scattered light of a lamp at 100 % that every pixel gets from between the nearest and the farthest flakes,
/// W/(m² sr); its error is random and has no bias.
pub(super) fn veil(
    view: &View<'_>,
    source: &Source<'_>,
    guide: &Guide,
    seed: u32,
) -> Vec<Spectrum> {
    let camera = view.camera;
    let rows = (0..camera.height).into_par_iter();
    let of_row = |row: u32| {
        (0..camera.width).map(move |column| of_pixel(view, source, guide, seed, [column, row]))
    };
    rows.flat_map_iter(of_row).collect()
}

fn of_pixel(
    view: &View<'_>,
    source: &Source<'_>,
    guide: &Guide,
    seed: u32,
    [column, row]: [u32; 2],
) -> Spectrum {
    let camera = view.camera;
    let pixel = row * camera.width + column;
    let cumulative = guide.of_pixel(view, column, row);
    let depth_m = view.depth_of(pixel as usize).min(guide.far_m());
    let share = guide.share_up_to(cumulative, depth_m);
    if share <= 0.0 {
        return [0.0; 3];
    }
    let mut rng = Rng::new(u64::from(seed), pixel, 0, STREAM);
    let shift = [rng.uniform(), rng.uniform()];
    let mut sum = [0.0; 3];
    for i in 0..SAMPLES {
        let within = [0, 1].map(|k| (shift[k] + f64::from(i) * STEPS[k]).fract());
        let direction = camera.direction(f64::from(column) + within[0], f64::from(row) + within[1]);
        let cosine = direction.dot(camera.forward);
        let of_light = (f64::from(i) + rng.uniform()) / f64::from(SAMPLES);
        let (depth_m, density) = guide.place(cumulative, share * of_light);
        let point = camera.position_m + depth_m / cosine * direction;
        let light = source.at(point, [rng.uniform(), rng.uniform()]);
        let weight = share / (density * cosine * f64::from(SAMPLES));
        (0..3).for_each(|k| sum[k] += weight * light[k]);
    }
    sum
}
