//! One channel's light in all pictures: the target as the nearest pictures show it, and what the others must then show.

use super::mosaic::Cosines;
use super::pictures::{Light, Pictures};
use super::views::Seen;
use uw_twin::estimate::every_water::Derived;

/// Steps in which the spread of the target's own picture is taken back (Van Cittert 1931); those of the nearest pictures are hardly spread.
const SHARPENING_STEPS: usize = 4;

/// A small change of the water.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Shift {
    pub(super) a: f64,
    pub(super) b: f64,
    pub(super) ln_backscatter: f64,
}

impl Shift {
    /// A value in the changed water.
    fn of(&self, value: &Derived) -> f64 {
        value.value
            + self.a * value.by_a
            + self.b * value.by_b
            + self.ln_backscatter * value.by_ln_backscatter
    }
}

/// Which picture tells the target's blocks, and which blocks of which pictures are compared with that.
pub(super) struct Plan {
    /// Pictures that tell blocks: (picture, [(block, its place among those shown)]).
    pub(super) told_by: Vec<(usize, Vec<(usize, usize)>)>,
    /// Per picture the blocks to be compared, (block, its place among those shown).
    pub(super) compared: Vec<Vec<(usize, usize)>>,
    /// Blocks that the nearest picture shows.
    inner: Vec<usize>,
}

impl Plan {
    /// Of the pictures in channel `k`: every block is told by the nearest lamp picture that shows it, of these by the brightest;
    /// all others are compared with that in the blocks that the nearest picture shows.
    pub(super) fn new(pictures: &Pictures, k: usize) -> Self {
        let grid = pictures.grid;
        let mut told_by: Vec<(usize, Vec<(usize, usize)>)> = Vec::new();
        let mut teller = vec![None; grid.len()];
        for (block, teller) in teller.iter_mut().enumerate() {
            let known = |i: &usize| {
                let shown = &pictures.shown[*i];
                shown.light != Light::Daylight && shown.known(block, k).is_some()
            };
            let order = |i: &usize| {
                let shown = &pictures.shown[*i];
                let level = match shown.light {
                    Light::Lamps(level) => level,
                    Light::Daylight => 0.0,
                };
                (shown.distance_m, -level)
            };
            let all = (0..pictures.shown.len()).filter(known);
            let first = all.min_by(|i, j| {
                let ((d, l), (e, m)) = (order(i), order(j));
                d.total_cmp(&e).then(l.total_cmp(&m))
            });
            *teller = first;
        }
        let place = |i: usize, block: usize| pictures.shown[i].shown.binary_search(&block).ok();
        for (block, i) in teller.iter().enumerate() {
            let Some((i, at)) = i.and_then(|i| Some((i, place(i, block)?))) else {
                continue;
            };
            match told_by.iter_mut().find(|(own, _)| *own == i) {
                Some((_, blocks)) => blocks.push((block, at)),
                None => told_by.push((i, vec![(block, at)])),
            }
        }
        let inner: Vec<usize> = (0..grid.len()).filter(|b| grid.is_inner(*b)).collect();
        let compared = (0..pictures.shown.len()).map(|i| {
            let blocks = inner.iter().filter(|block| {
                let told = teller[**block];
                told.is_some_and(|t| t != i) && pictures.shown[i].known(**block, k).is_some()
            });
            blocks
                .filter_map(|block| Some((*block, place(i, *block)?)))
                .collect()
        });
        Self {
            compared: compared.collect(),
            told_by,
            inner,
        }
    }
}

/// A channel of all pictures, in one water.
pub(super) struct Channel<'a> {
    pub(super) pictures: &'a Pictures,
    pub(super) plan: &'a Plan,
    pub(super) cosines: &'a Cosines,
    pub(super) k: usize,
    /// Per picture.
    pub(super) seen: Vec<Seen>,
}

/// Reflectance of the target's blocks.
struct Target {
    blocks: Vec<f64>,
    mean: f64,
}

/// What the pictures must show.
pub(super) struct Prediction {
    /// Mean reflectance of the target.
    pub(super) reflectance: f64,
    /// Per picture the radiance of the blocks compared, for lamps at 100 % or daylight of 1, and what of it is detail of the target.
    pub(super) radiance: Vec<Vec<[f64; 2]>>,
}

impl Channel<'_> {
    /// The prediction in a slightly changed water, `scales` being the pictures' signal per radiance.
    pub(super) fn predict(&self, shift: &Shift, scales: &[f64]) -> Prediction {
        let target = self.target(shift, scales);
        let radiance = self.plan.compared.iter().enumerate();
        Prediction {
            reflectance: target.mean,
            radiance: radiance
                .map(|(i, blocks)| self.radiance(i, blocks, &target, shift))
                .collect(),
        }
    }

    fn radiance(
        &self,
        i: usize,
        blocks: &[(usize, usize)],
        target: &Target,
        shift: &Shift,
    ) -> Vec<[f64; 2]> {
        if blocks.is_empty() {
            return Vec::new();
        }
        let seen = &self.seen[i];
        let spread = self.cosines.spread(&target.blocks, &left(seen, shift));
        let gain = 1.0 / (1.0 - shift.of(&seen.returned) * target.mean);
        let of = |&(block, at): &(usize, usize)| {
            let [straight, scattered] =
                [&seen.straight[at], &seen.scattered[at]].map(|s| shift.of(s));
            let light = gain * shift.of(&seen.light[at]);
            let all = light * (straight * target.blocks[block] + scattered * spread[block]);
            let even = light * (straight + scattered) * target.mean;
            [shift.of(&seen.veil[at]) + all, all - even]
        };
        blocks.iter().map(of).collect()
    }

    /// The target as the pictures that tell it have it.
    fn target(&self, shift: &Shift, scales: &[f64]) -> Target {
        let mut blocks = vec![f64::NAN; self.pictures.grid.len()];
        // Reflectance times share of light that comes to the camera, and that share.
        let mut cleared = blocks.clone();
        for (i, told) in &self.plan.told_by {
            let (shown, seen) = (&self.pictures.shown[*i], &self.seen[*i]);
            for &(block, at) in told {
                let radiance = shown.blocks[at].signal[self.k] / scales[*i];
                cleared[block] = (radiance - shift.of(&seen.veil[at])) / shift.of(&seen.light[at]);
                blocks[block] = cleared[block] / self.comes(seen, at, shift);
            }
        }
        let inner = self
            .plan
            .inner
            .iter()
            .map(|b| blocks[*b])
            .filter(|r| r.is_finite());
        let (sum, n) = inner.fold((0.0, 0.0), |(sum, n), r| (sum + r, n + 1.0));
        let alone: f64 = if n > 0.0 { sum / n } else { 0.0 };
        let returned = self.plan.told_by.first();
        let returned = returned.map_or(0.0, |(i, _)| shift.of(&self.seen[*i].returned));
        let mean = alone / (1.0 + returned * alone);
        for (i, told) in &self.plan.told_by {
            let less = 1.0 - shift.of(&self.seen[*i].returned) * mean;
            for (block, _) in told {
                cleared[*block] *= less;
                blocks[*block] *= less;
            }
        }
        for value in blocks.iter_mut().filter(|value| !value.is_finite()) {
            *value = mean;
        }
        for _ in 0..SHARPENING_STEPS {
            self.sharpen(&mut blocks, &cleared, shift);
        }
        Target { blocks, mean }
    }

    /// Share of the target's light that comes to the camera, straight or not.
    fn comes(&self, seen: &Seen, at: usize, shift: &Shift) -> f64 {
        shift.of(&seen.straight[at]) + shift.of(&seen.scattered[at])
    }

    fn sharpen(&self, blocks: &mut [f64], cleared: &[f64], shift: &Shift) {
        let before = blocks.to_vec();
        for (i, told) in &self.plan.told_by {
            let seen = &self.seen[*i];
            let spread = self.cosines.spread(&before, &left(seen, shift));
            for &(block, at) in told {
                let straight = shift.of(&seen.straight[at]) * before[block];
                let scattered = shift.of(&seen.scattered[at]) * spread[block];
                let missing = cleared[block] - straight - scattered;
                blocks[block] += missing / self.comes(seen, at, shift);
            }
        }
    }
}

/// What scattered rays leave of each cosine.
fn left(seen: &Seen, shift: &Shift) -> Vec<f64> {
    seen.transfer.iter().map(|wave| shift.of(wave)).collect()
}
