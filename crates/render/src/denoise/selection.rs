//! Which fit to believe where: by what each half says of the other half's fit.

use super::blur::boxed;
use super::regression::Fitted;

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

/// A way to show the layer.
struct Candidate {
    shown: Halves,
    /// The same where each half's samples looked.
    own: Halves,
    /// What its squared error is expected to be, see [`score`].
    score: Vec<f32>,
}

/// Takes of every pixel the candidate with the least estimated error: the layer as it is, or one of `fitted`, which go from small
/// cells to large ones.
pub(super) fn select(
    raw: [&[[f32; 3]]; 2],
    fitted: impl Iterator<Item = Fitted>,
    weights: &[[f32; 3]],
    width: usize,
) -> Chosen {
    let mut fitted: Vec<Fitted> = fitted.collect();
    fill_from_larger(&mut fitted);
    let mut candidates: Vec<Candidate> = Vec::new();
    let mut crossed = raw.map(<[_]>::to_vec);
    for mut next in fitted {
        if candidates.is_empty() {
            candidates.push(Candidate {
                score: score_of_samples(raw, &next, weights),
                shown: crossed.clone(),
                own: crossed.clone(),
            });
        }
        let last = &candidates[candidates.len() - 1];
        for i in (0..weights.len()).filter(|&i| !next.known[i]) {
            for half in 0..2 {
                next.shown[half][i] = last.shown[half][i];
                next.own[half][i] = last.own[half][i];
                next.crossed[half][i] = crossed[half][i];
            }
        }
        candidates.push(Candidate {
            score: score(&next, raw, weights),
            shown: next.shown,
            own: next.own,
        });
        crossed = next.crossed;
    }
    let scores: Vec<&[f32]> = candidates.iter().map(|c| &c.score[..]).collect();
    let choice = choose(&scores, width);
    let shown = blend(candidates.iter().map(|c| &c.shown), &choice, width);
    let mut residuals = blend(candidates.iter().map(|c| &c.own), &choice, width);
    for (own, raw) in residuals.iter_mut().zip(raw) {
        for (own, raw) in own.iter_mut().zip(raw) {
            (0..3).for_each(|k| own[k] = raw[k] - own[k]);
        }
    }
    Chosen { shown, residuals }
}

/// Where cells hold too few pixels of a surface for a fit, the next larger ones that have one stand in, before the samples themselves do.
fn fill_from_larger(fitted: &mut [Fitted]) {
    for index in (1..fitted.len()).rev() {
        let (smaller, larger) = fitted.split_at_mut(index);
        let (Some(smaller), Some(larger)) = (smaller.last_mut(), larger.first()) else {
            continue;
        };
        for i in 0..smaller.known.len() {
            if larger.known[i] && !smaller.known[i] {
                smaller.known[i] = true;
                for half in 0..2 {
                    smaller.shown[half][i] = larger.shown[half][i];
                    smaller.own[half][i] = larger.own[half][i];
                    smaller.crossed[half][i] = larger.crossed[half][i];
                }
            }
        }
    }
}

/// For every pixel the last candidate, or the one before that is better than those after it by more than chance.
fn choose(scores: &[&[f32]], width: usize) -> Vec<usize> {
    let smooth = |plane: Vec<f32>| {
        (0..SCORE_PASSES).fold(plane, |plane, _| boxed(&plane, width, SCORE_RADIUS_PX))
    };
    let pixels = scores.first().map_or(0, |score| score.len());
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
fn score(fitted: &Fitted, raw: [&[[f32; 3]]; 2], weights: &[[f32; 3]]) -> Vec<f32> {
    let ([a, b], [at_b, at_a]) = (&fitted.shown, &fitted.crossed);
    sums(weights, |i, k| {
        let (one, other) = (at_b[i][k] - raw[1][i][k], at_a[i][k] - raw[0][i][k]);
        let spread = a[i][k] - b[i][k];
        0.5 * (one * one + other * other) - 0.25 * spread * spread
    })
}

/// The same of the samples as they are. Where they looked is known, and what that does to their difference from `finest`.
fn score_of_samples(raw: [&[[f32; 3]]; 2], finest: &Fitted, weights: &[[f32; 3]]) -> Vec<f32> {
    let (own, crossed) = (&finest.own, &finest.crossed);
    sums(weights, |i, k| {
        let spread = raw[0][i][k] - raw[1][i][k];
        let known = match finest.known[i] {
            true => 0.5 * (own[0][i][k] + crossed[1][i][k] - own[1][i][k] - crossed[0][i][k]),
            false => 0.0,
        };
        0.75 * spread * spread - 0.5 * known * known
    })
}

/// Weighted sums over channels.
fn sums(weights: &[[f32; 3]], of: impl Fn(usize, usize) -> f32) -> Vec<f32> {
    let weighted = |(i, w): (usize, &[f32; 3])| (0..3).map(|k| w[k] * of(i, k)).sum();
    weights.iter().enumerate().map(weighted).collect()
}

/// The candidates by a smoothed choice.
fn blend<'a>(
    candidates: impl Iterator<Item = &'a Halves>,
    choice: &[usize],
    width: usize,
) -> Halves {
    let mut sum: Halves = [0, 1].map(|_| vec![[0.0; 3]; choice.len()]);
    for (index, candidate) in candidates.enumerate() {
        let chosen: Vec<f32> = choice
            .iter()
            .map(|&c| if c == index { 1.0 } else { 0.0 })
            .collect();
        let share = boxed(&chosen, width, CHOICE_RADIUS_PX);
        for half in 0..2 {
            for (i, value) in sum[half].iter_mut().enumerate() {
                for k in 0..3 {
                    value[k] += share[i] * candidate[half][i][k];
                }
            }
        }
    }
    sum
}
