//! How much pixels weigh: errors count over the level of the picture around them.

use super::blur;
use super::selection::Halves;

/// Radius over which the level of the picture is averaged that errors are weighed by, twice, pixels.
const LEVEL_RADIUS_PX: usize = 6;
/// Share of the picture's squared mean that is added to that squared level.
const LEVEL_FLOOR: f64 = 1e-4;

/// Weight of each pixel, per channel: one over its squared level.
pub(super) struct Weights {
    /// Of each half's samples, by the level of the other half: where a half's own bright samples took weight from themselves, fits
    /// would come out too dark.
    pub(super) halves: Halves,
    /// By the level of both.
    pub(super) both: Vec<[f32; 3]>,
}

impl Weights {
    pub(super) fn of(total: &Halves, width: usize) -> Self {
        let levels = total.each_ref().map(|half| levels(half, width));
        let [a, b] = &levels;
        let mean = |(a, b): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|k| 0.5 * (a[k] + b[k]));
        let both: Vec<[f32; 3]> = a.iter().zip(b).map(mean).collect();
        Self {
            halves: [squares_inverse(b), squares_inverse(a)],
            both: squares_inverse(&both),
        }
    }
}

/// The level of a picture around every pixel.
fn levels(picture: &[[f32; 3]], width: usize) -> Vec<[f32; 3]> {
    let planes: [Vec<f32>; 3] = std::array::from_fn(|k| {
        let plane: Vec<f32> = picture.iter().map(|value| value[k]).collect();
        (0..2).fold(plane, |plane, _| {
            blur::boxed(&plane, width, LEVEL_RADIUS_PX)
        })
    });
    let pixel = |i: usize| std::array::from_fn(|k| planes[k][i]);
    (0..picture.len()).map(pixel).collect()
}

/// One over the square of levels, over that of their mean; where there is no light at all, every pixel weighs the same.
fn squares_inverse(levels: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let mut weights = vec![[0.0; 3]; levels.len()];
    for k in 0..3 {
        let sum: f64 = levels.iter().map(|level| f64::from(level[k])).sum();
        let mean = sum / levels.len().max(1) as f64;
        for (weight, level) in weights.iter_mut().zip(levels) {
            let square = f64::from(level[k]).powi(2) + LEVEL_FLOOR * mean * mean;
            // Weights of any unit of light stay in the range of single precision.
            weight[k] = if square > 0.0 {
                (mean * mean / square) as f32
            } else {
                1.0
            };
        }
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bright sample takes no weight from itself, which would make fits too dark: those of its half keep theirs.
    #[test]
    fn a_halfs_samples_do_not_weigh_themselves() {
        const WIDTH: usize = 32;
        let even = vec![[1.0_f32; 3]; WIDTH * WIDTH];
        let mut bright = even.clone();
        let middle = WIDTH * WIDTH / 2 + WIDTH / 2;
        bright[middle] = [500.0; 3];
        let weights = Weights::of(&[bright, even], WIDTH);
        let contrast = |weights: &[[f32; 3]]| weights[middle][1] / weights[0][1];
        let [own, others] = weights.halves.each_ref().map(|half| contrast(half));
        assert!((own - 1.0).abs() < 1e-5, "{own}");
        assert!(others < 0.5, "{others}");
        assert!((others..1.0).contains(&contrast(&weights.both)));
    }

    /// A half that happens to see no light leaves the other half its fit.
    #[test]
    fn a_dark_half_lets_the_other_weigh() {
        const WIDTH: usize = 16;
        let of = |value: f32| vec![[value; 3]; WIDTH * WIDTH];
        let weights = Weights::of(&[of(1.0), of(0.0)], WIDTH);
        assert!(weights.halves.iter().flatten().all(|w| *w > [0.5; 3]));
    }
}
