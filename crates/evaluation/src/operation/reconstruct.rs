//! A clean picture from a render of few samples, knowing the target's texture.
//!
//! What a camera sees of a textured plane in water is D + F + V: light straight from the plane, D = reflectance × a
//! factor E that changes slowly over the picture (irradiance and transmittance); light of the plane scattered forward
//! on its way, F, which is D blurred by kernels of several widths; and the veil V of light that met no target, which
//! changes slowly. The render gives D and F + V with noise. E is the ratio of smoothed D and smoothed reflectance;
//! F + V is fitted with blurred copies of D and a quadratic surface by least squares, and what is left over is added
//! smoothed, so that no light is lost. The texture itself is never smoothed. The renderer's direct layer holds only
//! light that scattered nowhere, so that F + V also holds texture that is lit by scattered light and seen sharply: D and
//! the reflectance itself are terms of the fit.

use crate::linear::solve;

/// Width over which E is smoothed, standard deviation in pixels of a picture 240 pixels wide.
const FACTOR_SIGMA: f64 = 10.0;
/// The same of what the fit leaves over.
const REST_SIGMA: f64 = 12.0;
/// Widths of the blurred copies.
const BLUR_SIGMAS: [f64; 4] = [1.0, 2.5, 6.0, 16.0];
/// Width of the picture that the widths above are given for, pixels.
const NOMINAL_WIDTH: f64 = 240.0;
/// Terms of the fit: the reflectance, D, blurred copies of D, then 1, x, y, x², xy, y².
const TERMS: usize = 2 + BLUR_SIGMAS.len() + 6;
/// Share of the mean square of a term that is added to its own normal equation, against nearly equal terms.
const RIDGE: f64 = 1e-5;

/// One channel of a picture, row 0 first.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Width, pixels.
    pub width: usize,
    /// Values.
    pub values: Vec<f64>,
}

/// The clean picture: `total` radiance and the part of it that came `direct` from the target, both as rendered, and the
/// target's `reflectance` averaged over each pixel.
pub fn reconstruct(total: &Channel, direct: &Channel, reflectance: &Channel) -> Channel {
    let unit = total.width as f64 / NOMINAL_WIDTH;
    let clean_direct = clean_direct(direct, reflectance, FACTOR_SIGMA * unit);
    let scattered = total.zip(direct, |t, d| t - d);
    let terms = terms(reflectance, &clean_direct, unit);
    let fitted = fit(&terms, &scattered);
    let rest = scattered
        .zip(&fitted, |s, f| s - f)
        .blurred(REST_SIGMA * unit);
    let sum = clean_direct.zip(&fitted, |d, f| d + f);
    sum.zip(&rest, |s, r| (s + r).max(0.0))
}

fn clean_direct(direct: &Channel, reflectance: &Channel, sigma_px: f64) -> Channel {
    let (above, below) = (direct.blurred(sigma_px), reflectance.blurred(sigma_px));
    let factor = above.zip(&below, |a, b| if b > 0.0 { a / b } else { 0.0 });
    factor.zip(reflectance, |e, r| e * r)
}

fn terms(reflectance: &Channel, direct: &Channel, unit: f64) -> Vec<Channel> {
    let blurred = BLUR_SIGMAS.iter().map(|s| direct.blurred(s * unit));
    let sharp = [reflectance.clone(), direct.clone()];
    let mut terms: Vec<Channel> = sharp.into_iter().chain(blurred).collect();
    let (width, height) = (direct.width as f64, direct.height() as f64);
    let surfaces: [fn(f64, f64) -> f64; 6] = [
        |_, _| 1.0,
        |x, _| x,
        |_, y| y,
        |x, _| x * x,
        |x, y| x * y,
        |_, y| y * y,
    ];
    terms.extend(surfaces.map(|of| {
        Channel {
            width: direct.width,
            values: (0..direct.values.len())
                .map(|i| {
                    let x = (i % direct.width) as f64 / width - 0.5;
                    let y = (i / direct.width) as f64 / height - 0.5;
                    of(x, y)
                })
                .collect(),
        }
    }));
    terms
}

/// Least squares fit of `wanted` by the terms; zero where there is none.
fn fit(terms: &[Channel], wanted: &Channel) -> Channel {
    let product = |a: &Channel, b: &Channel| -> f64 {
        a.values.iter().zip(&b.values).map(|(a, b)| a * b).sum()
    };
    // Terms of one size make the ridge mean the same for all of them.
    let size: Vec<f64> = terms
        .iter()
        .map(|t| product(t, t).sqrt().max(1e-300))
        .collect();
    let normal: [[f64; TERMS]; TERMS] = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let ridge = if i == j { RIDGE } else { 0.0 };
            product(&terms[i], &terms[j]) / (size[i] * size[j]) + ridge
        })
    });
    let right: [f64; TERMS] = std::array::from_fn(|i| product(&terms[i], wanted) / size[i]);
    let weights = solve(&normal, &right).unwrap_or([0.0; TERMS]);
    let mut sum = vec![0.0; wanted.values.len()];
    for ((term, weight), size) in terms.iter().zip(weights).zip(size) {
        for (sum, value) in sum.iter_mut().zip(&term.values) {
            *sum += weight / size * value;
        }
    }
    Channel {
        width: wanted.width,
        values: sum,
    }
}

impl Channel {
    fn height(&self) -> usize {
        self.values.len() / self.width
    }

    fn zip(&self, other: &Self, of: impl Fn(f64, f64) -> f64) -> Self {
        let values = self.values.iter().zip(&other.values);
        Self {
            width: self.width,
            values: values.map(|(a, b)| of(*a, *b)).collect(),
        }
    }

    /// Convolved with a Gaussian; at the edges with the part of it inside, scaled to unit sum.
    fn blurred(&self, sigma_px: f64) -> Self {
        let reach = (3.0 * sigma_px).ceil() as usize;
        let kernel: Vec<f64> = (0..=reach)
            .map(|k| (-0.5 * (k as f64 / sigma_px).powi(2)).exp())
            .collect();
        let rows = blur_lines(&self.values, self.width, &kernel);
        let columns = transpose(&rows, self.width);
        let blurred = blur_lines(&columns, self.height(), &kernel);
        Self {
            width: self.width,
            values: transpose(&blurred, self.height()),
        }
    }
}

fn blur_lines(values: &[f64], length: usize, kernel: &[f64]) -> Vec<f64> {
    let mut out = Vec::with_capacity(values.len());
    for line in values.chunks_exact(length) {
        for x in 0..length {
            let (first, last) = (
                x.saturating_sub(kernel.len() - 1),
                (x + kernel.len() - 1).min(length - 1),
            );
            let (mut sum, mut weight) = (0.0, 0.0);
            for (i, value) in line.iter().enumerate().take(last + 1).skip(first) {
                let w = kernel[i.abs_diff(x)];
                sum += w * value;
                weight += w;
            }
            out.push(sum / weight);
        }
    }
    out
}

fn transpose(values: &[f64], width: usize) -> Vec<f64> {
    let height = values.len() / width;
    (0..values.len())
        .map(|i| values[i % height * width + i / height])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 240;
    const HEIGHT: usize = 135;

    fn channel(of: impl Fn(usize, usize) -> f64) -> Channel {
        Channel {
            width: WIDTH,
            values: (0..WIDTH * HEIGHT)
                .map(|i| of(i % WIDTH, i / WIDTH))
                .collect(),
        }
    }

    /// Uniform numbers in [0, 1).
    fn noise(seed: u32) -> Vec<f64> {
        let mut state = seed;
        (0..WIDTH * HEIGHT)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(state >> 8) / f64::from(1_u32 << 24)
            })
            .collect()
    }

    fn relative_error(got: &Channel, wanted: &Channel) -> f64 {
        let squares: f64 = got.zip(wanted, |a, b| (a - b).powi(2)).values.iter().sum();
        let level: f64 = wanted.values.iter().map(|v| v * v).sum();
        (squares / level).sqrt()
    }

    /// Truth, noisy total, noisy direct and reflectance of a picture with a known blur and veil.
    fn scene() -> (Channel, Channel, Channel, Channel) {
        let texture = noise(1);
        let reflectance = channel(|x, y| 0.2 + 0.3 * texture[y / 3 * WIDTH + x / 3]);
        let factor = channel(|x, y| 1.0 + 0.002 * x as f64 - 0.001 * y as f64);
        let direct = factor.zip(&reflectance, |e, r| e * r);
        let glow = direct.blurred(2.0);
        let veil = channel(|x, _| 0.3 + 0.0005 * x as f64);
        let scattered = glow.zip(&veil, |g, v| 0.6 * g + v);
        let truth = direct.zip(&scattered, |d, s| d + s);
        let (first, second) = (noise(7), noise(9));
        let noisy = |clean: &Channel, noise: &[f64]| Channel {
            width: WIDTH,
            values: clean
                .values
                .iter()
                .zip(noise)
                .map(|(c, n)| c * (0.5 + n))
                .collect(),
        };
        let noisy_direct = noisy(&direct, &first);
        let noisy_total = noisy_direct.zip(&noisy(&scattered, &second), |d, s| d + s);
        (truth, noisy_total, noisy_direct, reflectance)
    }

    #[test]
    fn noise_goes_and_texture_stays() {
        let (truth, total, direct, reflectance) = scene();
        let before = relative_error(&total, &truth);
        let after = relative_error(&reconstruct(&total, &direct, &reflectance), &truth);
        assert!(before > 0.18 && after < 0.012, "{before} {after}");
    }

    #[test]
    fn without_noise_a_blur_between_the_fitted_ones_is_met() {
        let (truth, ..) = scene();
        let texture = noise(1);
        let reflectance = channel(|x, y| 0.2 + 0.3 * texture[y / 3 * WIDTH + x / 3]);
        let factor = channel(|x, y| 1.0 + 0.002 * x as f64 - 0.001 * y as f64);
        let direct = factor.zip(&reflectance, |e, r| e * r);
        let got = reconstruct(&truth, &direct, &reflectance);
        assert!(relative_error(&got, &truth) < 0.005);
    }

    #[test]
    fn black_stays_black() {
        let black = channel(|_, _| 0.0);
        let grey = channel(|_, _| 0.5);
        assert!(
            reconstruct(&black, &black, &grey)
                .values
                .iter()
                .all(|v| *v == 0.0)
        );
    }
}
