//! Contrast at a lamp level from pictures at two others.
//!
//! Light is linear in the level: what a pixel gets at level p is A + p·B, with A from above and B from the lamps. Contrast
//! in 8-bit counts is not, because cameras store an encoded signal. Mean and standard deviation of a patch in linear light are
//! linear in p where both lights show the same pattern, that of the target. They are taken between (or beyond) two levels, and
//! each patch's contrast is that of the nearer picture times the ratio of deviation times slope of the encoding.
//! Approximate are that both lights show the same pattern, that a patch lies on one slope of the encoding, and that noise
//! grows like the pattern; clipped pixels are beyond this.

use crate::Encoding;
use crate::stats::PatchGrid;

/// A picture of the target at a lamp level.
#[derive(Clone, Debug)]
pub(crate) struct Lit {
    /// Lamp level, percent; 0 is off.
    pub(crate) light_pct: f64,
    /// In 8-bit counts.
    pub(crate) counts: PatchGrid,
    /// In linear light, [0, 1].
    pub(crate) linear: PatchGrid,
}

/// Contrast per channel, 8-bit counts, at `light_pct` from pictures at two other levels from one place.
pub(crate) fn contrast_at(light_pct: f64, one: &Lit, other: &Lit, encoding: Encoding) -> [f64; 3] {
    let share = (light_pct - one.light_pct) / (other.light_pct - one.light_pct);
    let near = if share < 0.5 { one } else { other };
    let patches = near.counts.patches.len();
    let (mut sum, mut counted) = ([0.0; 3], [0.0f64; 3]);
    for i in 0..patches {
        let (a, b) = (&one.linear.patches[i], &other.linear.patches[i]);
        let (stored, known) = (&near.counts.patches[i], &near.linear.patches[i]);
        // A patch that is left out of one picture may be there in the other: both are needed.
        for k in (0..3).filter(|&k| !(a.mean[k] + b.mean[k]).is_nan()) {
            counted[k] += 1.0;
            let between = |a: f64, b: f64| (a + share * (b - a)).max(0.0);
            let there = between(a.std[k], b.std[k]) * encoding.slope(between(a.mean[k], b.mean[k]));
            let here = known.std[k] * encoding.slope(known.mean[k]);
            sum[k] += if here > 1e-6 {
                stored.std[k] * there / here
            } else {
                there
            };
        }
    }
    [0, 1, 2].map(|k| sum[k] / counted[k].max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::patch_statistics;

    /// A pattern under daylight and lamps that fall off to the side, as a camera of this encoding stores it.
    fn picture(light_pct: f64, encoding: Encoding) -> Lit {
        let (width, height) = (200, 120);
        let linear = |i: usize| {
            let (x, y) = ((i % width) as f64, (i / width) as f64);
            let pattern = 1.0 + 0.2 * (0.9 * x).sin() * (1.3 * y).cos();
            let lamps = 0.25 * (-((x - 100.0) / 80.0).powi(2)).exp();
            [0.05, 0.1, 0.02].map(|day| pattern * (day + 0.01 * light_pct * lamps))
        };
        let stored = |i: usize| linear(i).map(|l| encoding.counts(l));
        let measure = |of: &dyn Fn(usize) -> [f64; 3]| patch_statistics(width, height, of).unwrap();
        Lit {
            light_pct,
            counts: measure(&stored),
            linear: measure(&|i| stored(i).map(|c| encoding.light(c))),
        }
    }

    #[test]
    fn contrast_between_and_beyond_levels_is_that_of_a_picture_there() {
        for encoding in [Encoding::Srgb, Encoding::Linear] {
            let [off, low, high] = [0.0, 40.0, 100.0].map(|level| picture(level, encoding));
            for (level, one, other) in [
                (67.0, &off, &high),
                (67.0, &low, &high),
                (67.0, &off, &low),
                (20.0, &low, &off),
            ] {
                let got = contrast_at(level, one, other, encoding);
                let right = picture(level, encoding).counts.stats.contrast;
                for k in 0..3 {
                    // The lamps' fall-off inside a patch is no pattern of the target.
                    assert!((got[k] / right[k] - 1.0).abs() < 0.03, "{got:?} {right:?}");
                }
            }
        }
    }

    #[test]
    fn contrast_in_counts_is_not_linear_in_the_level() {
        let [off, middle, full] = [0.0, 50.0, 100.0].map(|l| picture(l, Encoding::Srgb));
        let of = |lit: &Lit| lit.counts.stats.contrast[2];
        assert!((0.5 * (of(&off) + of(&full)) / of(&middle) - 1.0).abs() > 0.03);
    }
}
