//! Where two pictures from different distances show the same part of a target.

use super::blocks::Blocks;

/// Least correlation of two pictures of the same part.
const LEAST_CORRELATION: f64 = 0.85;
/// How much of the lack of correlation of any other place may be left at the right one: else the target repeats itself, or has no
/// features.
const MOST_LIKE_OTHERS: f64 = 0.5;
/// Least share of the nearer picture that the farther one must show.
const LEAST_SHARE: f64 = 0.4;
/// Fewest blocks that both show.
const FEWEST: f64 = 60.0;

/// Blocks that show the same part of the target.
#[derive(Clone, Debug)]
pub(super) struct Overlap {
    /// Places of a block in the nearer picture's cells and in the farther one's.
    pub(super) pairs: Vec<(usize, usize)>,
}

/// Steps from the middle of the nearer picture over the farther one's, and what both show there.
struct Shift {
    at: [isize; 2],
    correlation: f64,
}

/// The part of a target that both pictures show, whose blocks are equally large on it, by the reflectances of channel `k`; `None`
/// where there is none or nothing tells which it is.
pub(super) fn overlap(near: &Blocks, far: &Blocks, k: usize) -> Option<Overlap> {
    let values = |blocks: &Blocks| -> Vec<f64> {
        let mean = blocks.reflectance(k);
        let of = |block: &[super::blocks::Cell; 3]| block[k].reflectance() - mean;
        blocks.cells.iter().map(of).collect()
    };
    let (template, whole) = (values(near), values(far));
    let size = |blocks: &Blocks| [blocks.columns as isize, blocks.rows as isize];
    let (small, large) = (size(near), size(far));
    let least = FEWEST.max(LEAST_SHARE * template.len() as f64);
    let mut shifts = Vec::new();
    for y in 1 - small[1]..large[1] {
        for x in 1 - small[0]..large[0] {
            let shared = pairs([x, y], small, large);
            if (shared.len() as f64) < least {
                continue;
            }
            let correlation = correlation(shared.pairs(), &template, &whole);
            shifts.push(Shift {
                at: [x, y],
                correlation,
            });
        }
    }
    let by_correlation = |a: &&Shift, b: &&Shift| a.correlation.total_cmp(&b.correlation);
    let best = shifts.iter().max_by(by_correlation)?;
    let beside =
        |other: &&Shift| (0..2).any(|i| (other.at[i] - best.at[i]).abs() > 2 + small[i] / 6);
    let second = shifts.iter().filter(beside).max_by(by_correlation);
    let unlike = 1.0 - second.map_or(0.0, |other| other.correlation.max(0.0));
    let found = best.correlation >= LEAST_CORRELATION
        && 1.0 - best.correlation <= MOST_LIKE_OTHERS * unlike;
    found.then(|| Overlap {
        pairs: pairs(best.at, small, large).pairs().collect(),
    })
}

/// The rectangle that a shifted picture shares with another.
struct Shared {
    from: [isize; 2],
    to: [isize; 2],
    at: [isize; 2],
    widths: [isize; 2],
}

fn pairs(at: [isize; 2], small: [isize; 2], large: [isize; 2]) -> Shared {
    Shared {
        from: [0, 1].map(|i| (-at[i]).max(0)),
        to: [0, 1].map(|i| small[i].min(large[i] - at[i])),
        at,
        widths: [small[0], large[0]],
    }
}

impl Shared {
    fn len(&self) -> usize {
        let side = |i: usize| usize::try_from(self.to[i] - self.from[i]).unwrap_or_default();
        side(0) * side(1)
    }

    /// Indices in both.
    fn pairs(&self) -> impl Iterator<Item = (usize, usize)> {
        let [small, large] = self.widths;
        let (from, to, at) = (self.from, self.to, self.at);
        (from[1]..to[1]).flat_map(move |y| {
            (from[0]..to[0]).map(move |x| {
                let one = y * small + x;
                let other = (y + at[1]) * large + x + at[0];
                (one as usize, other as usize)
            })
        })
    }
}

fn correlation(pairs: impl Iterator<Item = (usize, usize)>, a: &[f64], b: &[f64]) -> f64 {
    let (mut n, mut sums, mut squares, mut product) = (0.0, [0.0; 2], [0.0; 2], 0.0);
    for (i, j) in pairs {
        let (x, y) = (a[i], b[j]);
        n += 1.0;
        sums[0] += x;
        sums[1] += y;
        squares[0] += x * x;
        squares[1] += y * y;
        product += x * y;
    }
    let variance = |i: usize| squares[i] - sums[i] * sums[i] / n;
    let scale = (variance(0) * variance(1)).max(0.0).sqrt();
    match scale > 0.0 {
        true => (product - sums[0] * sums[1] / n) / scale,
        false => 0.0,
    }
}
