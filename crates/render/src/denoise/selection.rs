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
    mut fitted: Fitted,
    weights: &[[f32; 3]],
    width: usize,
) -> Chosen {
    let (pixels, count) = (weights.len(), fitted.sizes + 1);
    let mut scores = vec![0.0; pixels * count];
    let of_pixels = fitted.values.par_chunks_mut(fitted.sizes);
    let with_scores = of_pixels.zip(scores.par_chunks_mut(count)).enumerate();
    with_scores.for_each(|(i, (fitted, scores))| {
        let samples = [raw[0][i], raw[1][i]];
        fill(fitted, &samples, &weights[i], scores);
    });
    let choice = choose(&scores, count, width);
    blend(&fitted, raw, &shares(&choice, count, width))
}

/// Says of a pixel what candidates are worth, the samples as they are first. Where cells hold too few pixels of a surface for a fit,
/// the next larger ones that have one stand in, and where there are none, the samples themselves do.
fn fill(
    fitted: &mut [Option<Values>],
    samples: &[[f32; 3]; 2],
    weight: &[f32; 3],
    scores: &mut [f32],
) {
    for index in (1..fitted.len()).rev() {
        fitted[index - 1] = fitted[index - 1].or(fitted[index]);
    }
    if let [of_samples, scores @ ..] = scores {
        *of_samples = score_of_samples(samples, fitted.first().unwrap_or(&None), weight);
        for (own, score) in fitted.iter_mut().zip(scores) {
            let values = own.get_or_insert([*samples; 3]);
            *score = self::score(values, samples, weight);
        }
    }
}

/// For every pixel the last candidate, or the one before that is better than those after it by more than chance, by the scores of
/// `count` candidates of each.
fn choose(scores: &[f32], count: usize, width: usize) -> Vec<usize> {
    let smooth = |plane: Vec<f32>| {
        (0..SCORE_PASSES).fold(plane, |plane, _| boxed(&plane, width, SCORE_RADIUS_PX))
    };
    let mut choice = vec![count - 1; scores.len() / count];
    for candidate in (0..count - 1).rev() {
        let of_pixels = scores.chunks(count).zip(&choice);
        let gain: Vec<f32> = of_pixels
            .map(|(scores, &choice)| scores[choice] - scores[candidate])
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

/// What is expected to be the squared error of the mean of the candidate's halves, and the variance of a half
/// of the layer but for what is known of where its samples looked, which is the same for all candidates; weighted, summed over
/// channels.
fn score(candidate: &Values, samples: &[[f32; 3]; 2], weight: &[f32; 3]) -> f32 {
    let ([a, b], [at_b, at_a]) = (&candidate[SHOWN], &candidate[CROSSED]);
    weighted(weight, |k| {
        let (one, other) = (at_b[k] - samples[1][k], at_a[k] - samples[0][k]);
        let spread = a[k] - b[k];
        0.5 * (one * one + other * other) - 0.25 * spread * spread
    })
}

/// The same of the samples as they are. Where they looked is known, and what that does to their difference from `finest`.
fn score_of_samples(samples: &[[f32; 3]; 2], finest: &Option<Values>, weight: &[f32; 3]) -> f32 {
    weighted(weight, |k| {
        let spread = samples[0][k] - samples[1][k];
        let known = finest.map_or(0.0, |values| {
            let (own, crossed) = (&values[OWN], &values[CROSSED]);
            0.5 * (own[0][k] + crossed[1][k] - own[1][k] - crossed[0][k])
        });
        0.75 * spread * spread - 0.5 * known * known
    })
}

/// Weighted sum over channels.
fn weighted(weight: &[f32; 3], of: impl Fn(usize) -> f32) -> f32 {
    (0..3).map(|k| weight[k] * of(k)).sum()
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
fn blend(fitted: &Fitted, raw: [&[[f32; 3]]; 2], shares: &[Option<Vec<f32>>]) -> Chosen {
    let of_pixel = |i: usize| {
        let samples = [[raw[0][i], raw[1][i]]; 3];
        let own = &fitted.values[i * fitted.sizes..(i + 1) * fitted.sizes];
        let candidates = [Some(&samples)]
            .into_iter()
            .chain(own.iter().map(Option::as_ref));
        let mut sum = [[[0.0; 3]; 2]; 2];
        for (candidate, share) in candidates.zip(shares) {
            let share = share.as_ref().map_or(0.0, |share| share[i]);
            let Some(candidate) = candidate.filter(|_| share > 0.0) else {
                continue;
            };
            for (sum, way) in sum.iter_mut().zip([SHOWN, OWN]) {
                for (sum, half) in sum.iter_mut().zip(&candidate[way]) {
                    (0..3).for_each(|k| sum[k] += share * half[k]);
                }
            }
        }
        let [shown, own] = sum;
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
