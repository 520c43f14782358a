//! Which fit to believe where: by what each half says of the other half's fit.

use rayon::prelude::*;

use super::blur::boxed;
use super::regression::{CROSSED, Fitted, OWN, SHOWN, Values};

/// Radius over which the errors of candidates are averaged, pixels, and how often.
const SCORE_RADIUS_PX: usize = 6;
const SCORE_PASSES: usize = 2;
/// As many pixels as an average over them is worth: 1.5 times the side of the squares, squared.
const SCORE_PIXELS: f32 = 380.0;
/// Standard errors by which smaller cells must be better than larger ones. Both halves follow the same choice: cells that are
/// taken because noise of both agrees by chance give both the same error, which nothing tells of.
const SIGNIFICANT: f32 = 2.0;
/// Radius over which a choice is smoothed, pixels.
const CHOICE_RADIUS_PX: usize = 3;

/// A layer, half by half.
pub(super) type Halves = [Vec<[f32; 3]>; 2];

/// A layer as it was chosen.
pub(super) struct Chosen {
    /// All over every pixel, half by half.
    pub(super) shown: Halves,
    /// What the samples are more where they looked, half by half.
    pub(super) residuals: Halves,
}

/// Takes of every pixel the candidate with the least estimated error: the layer as it is, or one of `fitted`, which go from small
/// cells to large ones.
pub(super) fn select(
    raw: [&[[f32; 3]]; 2],
    mut fitted: Vec<Fitted>,
    weights: &[[f32; 3]],
    width: usize,
) -> Chosen {
    fill_from_larger(&mut fitted);
    let first = match fitted.first() {
        Some(finest) => score_of_samples(raw, finest, weights),
        None => vec![0.0; weights.len()],
    };
    let mut candidates = vec![samples(raw)];
    for next in &fitted {
        let last = &candidates[candidates.len() - 1];
        candidates.push(known_or(next, last));
    }
    let mut scores = vec![first];
    scores.extend(
        (candidates[1..]
            .par_iter()
            .map(|own| score(own, raw, weights)))
        .collect::<Vec<_>>(),
    );
    let choice = choose(&scores, width);
    blend(&candidates, raw, &shares(&choice, candidates.len(), width))
}

/// The samples as they are.
fn samples(raw: [&[[f32; 3]]; 2]) -> Vec<Values> {
    let halves = raw[0].iter().zip(raw[1]);
    halves.map(|(&a, &b)| [[a, b]; 3]).collect()
}

/// Where cells hold too few pixels of a surface for a fit, the next larger ones that have one stand in, before the samples themselves do.
fn fill_from_larger(fitted: &mut [Fitted]) {
    for index in (1..fitted.len()).rev() {
        let (smaller, larger) = fitted.split_at_mut(index);
        for (own, other) in smaller[index - 1].iter_mut().zip(&larger[0]) {
            *own = own.or(*other);
        }
    }
}

fn known_or(fitted: &Fitted, last: &[Values]) -> Vec<Values> {
    let pairs = fitted.iter().zip(last);
    pairs.map(|(own, last)| own.unwrap_or(*last)).collect()
}

/// For every pixel the last candidate, or the one before that is better than those after it by more than chance.
fn choose(scores: &[Vec<f32>], width: usize) -> Vec<usize> {
    let smooth = |plane: Vec<f32>| {
        (0..SCORE_PASSES).fold(plane, |plane, _| boxed(&plane, width, SCORE_RADIUS_PX))
    };
    let pixels = scores.first().map_or(0, Vec::len);
    let mut choice = vec![scores.len().saturating_sub(1); pixels];
    for candidate in (0..scores.len().saturating_sub(1)).rev() {
        let gain: Vec<f32> = (0..pixels)
            .map(|i| scores[choice[i]][i] - scores[candidate][i])
            .collect();
        let squares = smooth(gain.iter().map(|gain| gain * gain).collect());
        let gain = smooth(gain);
        for (i, choice) in choice.iter_mut().enumerate() {
            let variance = (squares[i] - gain[i] * gain[i]).max(0.0) / SCORE_PIXELS;
            if gain[i] > SIGNIFICANT * variance.sqrt() {
                *choice = candidate;
            }
        }
    }
    choice
}

/// For every pixel what is expected to be the squared error of the mean of the candidate's halves, and the variance of a half
/// of the layer but for what is known of where its samples looked, which is the same for all candidates; weighted, summed over
/// channels.
fn score(candidate: &[Values], raw: [&[[f32; 3]]; 2], weights: &[[f32; 3]]) -> Vec<f32> {
    sums(weights, |i, k| {
        let ([a, b], [at_b, at_a]) = (&candidate[i][SHOWN], &candidate[i][CROSSED]);
        let (one, other) = (at_b[k] - raw[1][i][k], at_a[k] - raw[0][i][k]);
        let spread = a[k] - b[k];
        0.5 * (one * one + other * other) - 0.25 * spread * spread
    })
}

/// The same of the samples as they are. Where they looked is known, and what that does to their difference from `finest`.
fn score_of_samples(raw: [&[[f32; 3]]; 2], finest: &Fitted, weights: &[[f32; 3]]) -> Vec<f32> {
    sums(weights, |i, k| {
        let spread = raw[0][i][k] - raw[1][i][k];
        let known = finest[i].map_or(0.0, |values| {
            let (own, crossed) = (&values[OWN], &values[CROSSED]);
            0.5 * (own[0][k] + crossed[1][k] - own[1][k] - crossed[0][k])
        });
        0.75 * spread * spread - 0.5 * known * known
    })
}

/// Weighted sums over channels.
fn sums(weights: &[[f32; 3]], of: impl Fn(usize, usize) -> f32) -> Vec<f32> {
    let weighted = |(i, w): (usize, &[f32; 3])| (0..3).map(|k| w[k] * of(i, k)).sum();
    weights.iter().enumerate().map(weighted).collect()
}

/// How much each of `count` candidates is worth in every pixel, by a smoothed choice; none of one that is nowhere chosen.
fn shares(choice: &[usize], count: usize, width: usize) -> Vec<Option<Vec<f32>>> {
    let of = |index: usize| {
        let is_chosen = |&own: &usize| if own == index { 1.0 } else { 0.0 };
        let chosen: Vec<f32> = choice.iter().map(is_chosen).collect();
        let is_needed = choice.contains(&index);
        is_needed.then(|| boxed(&chosen, width, CHOICE_RADIUS_PX))
    };
    (0..count).map(of).collect()
}

/// The candidates by their shares.
fn blend(candidates: &[Vec<Values>], raw: [&[[f32; 3]]; 2], shares: &[Option<Vec<f32>>]) -> Chosen {
    let of_pixel = |i: usize| {
        let (mut shown, mut own) = ([[0.0; 3]; 2], [[0.0; 3]; 2]);
        for (candidate, share) in candidates.iter().zip(shares) {
            let share = share.as_ref().map_or(0.0, |share| share[i]);
            if share == 0.0 {
                continue;
            }
            for (half, k) in [0, 1]
                .into_iter()
                .flat_map(|half| [0, 1, 2].map(|k| (half, k)))
            {
                shown[half][k] += share * candidate[i][SHOWN][half][k];
                own[half][k] += share * candidate[i][OWN][half][k];
            }
        }
        let residual = |half: usize| std::array::from_fn(|k| raw[half][i][k] - own[half][k]);
        ((shown[0], shown[1]), (residual(0), residual(1)))
    };
    let pixels = (0..raw[0].len()).into_par_iter().map(of_pixel);
    let ((a, b), (of_a, of_b)): ((Vec<_>, Vec<_>), (Vec<_>, Vec<_>)) = pixels.unzip();
    Chosen {
        shown: [a, b],
        residuals: [of_a, of_b],
    }
}
