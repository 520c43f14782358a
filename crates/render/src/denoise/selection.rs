//! Which fit to believe where: by what each half says of the other half's fit.

use rayon::prelude::*;

use super::blur::boxed;
use super::regression::{CROSSED, Fitted, OWN, SHOWN, SMALLEST_CELL_PX, Values};

/// Least radius over which the errors of candidates are averaged, pixels, and how often.
const SCORE_RADIUS_PX: usize = 6;
const SCORE_PASSES: usize = 2;
/// The radius over the side of the cells that are judged: what is wrong with the next larger ones reaches as far as these do, and
/// the noise in which it has to be seen is less over more pixels.
const SCORE_RADIUS_CELLS: usize = 2;
/// Pixels along a side that an average over squares is worth, over the side of these.
const SCORE_WORTH: f32 = 1.5;
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
    let mut choice = vec![count - 1; scores.len() / count];
    let height = choice.len() / width.max(1);
    for candidate in (0..count - 1).rev() {
        let radius = score_radius(candidate);
        let smooth = |plane: Vec<f32>| {
            (0..SCORE_PASSES).fold(plane, |plane, _| boxed(&plane, width, radius))
        };
        let worth = |side: usize| (SCORE_WORTH * (2 * radius + 1) as f32).min(side as f32);
        let pixels = worth(width) * worth(height);
        let of_pixels = scores.chunks(count).zip(&choice);
        let gain: Vec<f32> = of_pixels
            .map(|(scores, &choice)| scores[choice] - scores[candidate])
            .collect();
        let squares = smooth(gain.iter().map(|gain| gain * gain).collect());
        let gain = smooth(gain);
        for (i, choice) in choice.iter_mut().enumerate() {
            let variance = (squares[i] - gain[i] * gain[i]).max(0.0) / pixels;
            if gain[i] > SIGNIFICANT * variance.sqrt() {
                *choice = candidate;
            }
        }
    }
    choice
}

/// Radius over which the errors of a candidate are averaged, pixels; the first one are the samples, whose cells are pixels.
fn score_radius(candidate: usize) -> usize {
    let cell_px = match candidate {
        0 => 1,
        _ => SMALLEST_CELL_PX << (candidate - 1),
    };
    SCORE_RADIUS_PX.max(SCORE_RADIUS_CELLS * cell_px)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Rng;

    const WIDTH: usize = 160;

    /// Share of the pixels that take the last candidate but one where that is better than the last by `gain`, in noise of a standard
    /// deviation of 1.
    fn chosen(gain: f32, seed: u32) -> f32 {
        const COUNT: usize = 5;
        let mut rng = Rng::new(3, seed, 0, 0);
        let mut scores = vec![0.0; WIDTH * WIDTH * COUNT];
        for pixel in scores.chunks_mut(COUNT) {
            pixel.fill(10.0);
            pixel[COUNT - 2] = 0.0;
            pixel[COUNT - 1] = gain + 12_f32.sqrt() * (rng.uniform() as f32 - 0.5);
        }
        let choice = choose(&scores, COUNT, WIDTH);
        let taken = choice.iter().filter(|&&choice| choice == COUNT - 2).count();
        taken as f32 / choice.len() as f32
    }

    /// Cells of 16 pixels that are better than those of 32 by a twentieth of the noise of a pixel: averages over 13 pixels, good
    /// enough for small cells, would not see it. Where nothing is better, the large ones stay.
    #[test]
    fn large_cells_are_judged_over_as_many_pixels_as_they_need() {
        let mean = |gain| (0..4).map(|seed| chosen(gain, seed)).sum::<f32>() / 4.0;
        let (better, equal) = (mean(0.05), mean(0.0));
        assert!(better > 0.9, "{better}");
        assert!(equal < 0.1, "{equal}");
    }
}
