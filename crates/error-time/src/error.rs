//! How far a render is from its reference.

use super::reference::Reference;

/// Share of the picture's squared mean that is added to the squared reference of a pixel, so that dark pixels do
/// not rule the mean.
const FLOOR: f64 = 1e-4;

/// Distance of one render from a reference picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorToReference {
    /// Relative mean squared error, mean((x − ref)² / (ref² + 1e-4·mean(ref)²)) over pixels and channels, less
    /// the part that the noise of the reference is expected to add. Can be negative where that part rules.
    pub rel_mse: f64,
    /// Mean of the picture over that of the reference, less 1, per channel: the mean signed relative error.
    pub bias: [f64; 3],
    /// Standard error of `bias` from the noise of both pictures.
    pub bias_standard_error: [f64; 3],
}

/// Compares pixel means of radiance, and the variance of their mean over the picture, with `reference`, which must have
/// as many pixels.
///
/// A picture that differs where the reference's whole channel is black is infinitely far off.
pub fn compare(
    mean: &[[f64; 3]],
    variance_of_mean: [f64; 3],
    reference: &Reference,
) -> ErrorToReference {
    let floor = reference.floor();
    let mut sum = 0.0;
    for (x, r) in mean.iter().zip(&reference.mean) {
        for k in 0..3 {
            let level = r[k] * r[k] + floor[k];
            let square = (x[k] - r[k]).powi(2);
            sum += if square == 0.0 { 0.0 } else { square / level };
        }
    }
    let measured = sum / (3 * mean.len()) as f64;
    let (bias, bias_standard_error) = bias(mean, variance_of_mean, reference);
    ErrorToReference {
        rel_mse: measured - reference.rel_mse(),
        bias,
        bias_standard_error,
    }
}

fn bias(mean: &[[f64; 3]], own_variance: [f64; 3], reference: &Reference) -> ([f64; 3], [f64; 3]) {
    let (picture, expected) = (channel_means(mean), channel_means(&reference.mean));
    let of_reference = reference.relative_error_of_mean();
    let bias = std::array::from_fn(|k| {
        if picture[k] == expected[k] {
            0.0
        } else {
            picture[k] / expected[k] - 1.0
        }
    });
    let error = std::array::from_fn(|k| {
        if own_variance[k] == 0.0 {
            of_reference[k]
        } else {
            (own_variance[k].sqrt() / expected[k]).hypot(of_reference[k])
        }
    });
    (bias, error)
}

impl Reference {
    /// What is added to the squared value of a pixel, per channel.
    fn floor(&self) -> [f64; 3] {
        channel_means(&self.mean).map(|mean| FLOOR * mean * mean)
    }

    /// The reference's own relative mean squared error, from its standard errors: what its noise is expected to
    /// add to the measured error of an independent picture.
    pub fn rel_mse(&self) -> f64 {
        let floor = self.floor();
        let mut sum = 0.0;
        for (r, error) in self.mean.iter().zip(&self.standard_error) {
            for k in 0..3 {
                let square = error[k] * error[k];
                sum += if square == 0.0 {
                    0.0
                } else {
                    square / (r[k] * r[k] + floor[k])
                };
            }
        }
        sum / (3 * self.mean.len()) as f64
    }

    /// Relative standard error of the mean over the picture, per channel; 0 for a black one.
    pub fn relative_error_of_mean(&self) -> [f64; 3] {
        let count = self.mean.len() as f64;
        let mean = channel_means(&self.mean);
        let squares: Vec<[f64; 3]> = self
            .standard_error
            .iter()
            .map(|e| e.map(|e| e * e))
            .collect();
        let square = channel_means(&squares);
        std::array::from_fn(|k| {
            if square[k] == 0.0 {
                0.0
            } else {
                (square[k] / count).sqrt() / mean[k]
            }
        })
    }
}

fn channel_means(pixels: &[[f64; 3]]) -> [f64; 3] {
    let count = pixels.len().max(1) as f64;
    std::array::from_fn(|k| pixels.iter().map(|p| p[k]).sum::<f64>() / count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::Provenance;
    use uw_render::sampling::Rng;

    fn reference(mean: Vec<[f64; 3]>, standard_error: Vec<[f64; 3]>) -> Reference {
        Reference {
            width: mean.len() as u32,
            height: 1,
            mean,
            standard_error,
            made: Provenance {
                scene_hash: String::new(),
                seed: 0,
                samples_per_pixel: 1,
                version: String::new(),
            },
        }
    }

    #[test]
    fn the_error_of_two_pixels_is_that_of_the_formula() {
        let exact = reference(vec![[1.0, 2.0, 4.0], [3.0, 2.0, 0.0]], vec![[0.0; 3]; 2]);
        let picture = [[1.1, 2.0, 4.0], [3.0, 1.8, 0.02]];
        let error = compare(&picture, [0.0; 3], &exact);
        // All channels have a mean of 2 over the picture: the floor is 4e-4.
        let expected = (0.01 / (1.0 + 4e-4) + 0.04 / (4.0 + 4e-4) + 4e-4 / 4e-4) / 6.0;
        assert!((error.rel_mse / expected - 1.0).abs() < 1e-12, "{error:?}");
        for (bias, expected) in error.bias.into_iter().zip([0.025, -0.05, 0.005]) {
            assert!((bias - expected).abs() < 1e-12, "{error:?}");
        }
        assert_eq!(error.bias_standard_error, [0.0; 3]);
    }

    #[test]
    fn black_pictures_are_equal_and_light_where_all_was_black_is_infinitely_wrong() {
        let black = reference(vec![[0.0; 3]; 4], vec![[0.0; 3]; 4]);
        let none = compare(&[[0.0; 3]; 4], [0.0; 3], &black);
        assert_eq!((none.rel_mse, none.bias), (0.0, [0.0; 3]));
        let some = compare(&[[0.0, 1e-9, 0.0]; 4], [0.0; 3], &black);
        assert_eq!((some.rel_mse, some.bias[1]), (f64::INFINITY, f64::INFINITY));
    }

    /// A number with mean 0 and standard deviation 1.
    fn noise(rng: &mut Rng) -> f64 {
        (0..12).map(|_| rng.uniform()).sum::<f64>() - 6.0
    }

    /// The noise of the reference is taken off: what is left is that of the picture, and the bias lies within
    /// its standard errors of the true one.
    #[test]
    fn the_noise_of_the_reference_is_not_counted() {
        const PIXELS: usize = 20_000;
        let (of_picture, of_reference, true_bias) = (0.03_f64, 0.02, 0.002);
        let mut rng = Rng::new(5, 0, 0, 0);
        let truth: Vec<[f64; 3]> = (0..PIXELS)
            .map(|_| std::array::from_fn(|_| 1.0 + rng.uniform()))
            .collect();
        let mut with_noise = |relative: f64, factor: f64| -> Vec<[f64; 3]> {
            truth
                .iter()
                .map(|t| t.map(|t| factor * t * (1.0 + relative * noise(&mut rng))))
                .collect()
        };
        let picture = with_noise(of_picture, 1.0 + true_bias);
        let noisy = with_noise(of_reference, 1.0);
        let errors = truth.iter().map(|t| t.map(|t| of_reference * t)).collect();
        let variance: Vec<[f64; 3]> = truth
            .iter()
            .map(|t| t.map(|t| (of_picture * t).powi(2)))
            .collect();
        let of_mean = channel_means(&variance).map(|v| v / PIXELS as f64);
        let error = compare(&picture, of_mean, &reference(noisy, errors));
        // Uncorrected it would be 44 % more. Noise in the denominators adds 0.2 %, the number of pixels leaves 0.8 %.
        let expected = of_picture * of_picture;
        assert!((error.rel_mse / expected - 1.0).abs() < 0.04, "{error:?}");
        for k in 0..3 {
            let z = (error.bias[k] - true_bias) / error.bias_standard_error[k];
            assert!(z.abs() < 4.0, "channel {k}: {error:?}");
            // Both parts: 0.03 and 0.02 of pixels that vary between 1 and 2, over the root of their number.
            let expected = of_picture.hypot(of_reference) / (PIXELS as f64).sqrt();
            let ratio = error.bias_standard_error[k] / expected;
            assert!((0.99..1.05).contains(&ratio), "channel {k}: {ratio}");
        }
    }
}
