//! Which fit to believe where: by what each half says of the other half's fit.

use super::blur::boxed;
use super::regression::Fitted;

/// Radius over which the errors of candidates are averaged, pixels, and how often.
const SCORE_RADIUS_PX: usize = 6;
const SCORE_PASSES: usize = 2;
/// Radius over which a choice is smoothed, pixels.
const CHOICE_RADIUS_PX: usize = 3;

/// A layer, half by half.
pub(super) type Halves = [Vec<[f32; 3]>; 2];

/// Takes of every pixel the candidate with the least estimated error: the layer as it is, or one of `fitted`.
pub(super) fn select(
    raw: [&[[f32; 3]]; 2],
    fitted: impl Iterator<Item = Fitted>,
    weights: &[[f32; 3]],
    width: usize,
) -> Halves {
    let mut candidates: Vec<Halves> = vec![raw.map(<[_]>::to_vec)];
    for mut next in fitted {
        let last = &candidates[candidates.len() - 1];
        for half in 0..2 {
            for (i, value) in next.halves[half].iter_mut().enumerate() {
                if !next.known[i] {
                    *value = last[half][i];
                }
            }
        }
        candidates.push(next.halves);
    }
    let scores: Vec<Vec<f32>> = candidates
        .iter()
        .map(|candidate| {
            let score = score(candidate, raw, weights);
            (0..SCORE_PASSES).fold(score, |plane, _| boxed(&plane, width, SCORE_RADIUS_PX))
        })
        .collect();
    let choice: Vec<usize> = (0..weights.len())
        .map(|i| {
            let order = |a: &usize, b: &usize| scores[*a][i].total_cmp(&scores[*b][i]);
            (0..scores.len()).min_by(order).unwrap_or(0)
        })
        .collect();
    blend(&candidates, &choice, width)
}

/// For every pixel what is expected to be the squared error of the mean of the candidate's halves, and the variance of a half
/// of the layer, which is the same for all candidates; weighted, summed over channels.
fn score(candidate: &Halves, raw: [&[[f32; 3]]; 2], weights: &[[f32; 3]]) -> Vec<f32> {
    let [a, b] = candidate;
    let of = |i: usize| {
        (0..3)
            .map(|k| {
                let (one, other) = (a[i][k] - raw[1][i][k], b[i][k] - raw[0][i][k]);
                let spread = a[i][k] - b[i][k];
                let error = 0.5 * (one * one + other * other) - 0.25 * spread * spread;
                weights[i][k] * error
            })
            .sum()
    };
    (0..weights.len()).map(of).collect()
}

/// The candidates by a smoothed choice.
fn blend(candidates: &[Halves], choice: &[usize], width: usize) -> Halves {
    let mut sum: Halves = [0, 1].map(|_| vec![[0.0; 3]; choice.len()]);
    for (index, candidate) in candidates.iter().enumerate() {
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
