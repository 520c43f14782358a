//! Blurs of planes of numbers; beyond the edges nothing counts.

use rayon::prelude::*;

/// Standard deviation below which a Gaussian is summed as it is, pixels.
const NARROW: f64 = 3.0;

/// Convolved with a Gaussian, or with three boxes that come to the same.
pub(super) fn gaussian(values: &[f32], width: usize, sigma_px: f64) -> Vec<f32> {
    if sigma_px < NARROW {
        let reach = (3.0 * sigma_px).ceil() as usize;
        let kernel: Vec<f32> = (0..=reach)
            .map(|k| (-0.5 * (k as f64 / sigma_px).powi(2)).exp() as f32)
            .collect();
        return both_ways(values, width, &|line, out| weigh(line, out, &kernel));
    }
    let radius = box_radius(sigma_px);
    (0..3).fold(values.to_vec(), |plane, _| boxed(&plane, width, radius))
}

/// Means over squares of 2 `radius` + 1 pixels a side.
pub(super) fn boxed(values: &[f32], width: usize, radius: usize) -> Vec<f32> {
    both_ways(values, width, &|line, out| slide(line, out, radius))
}

/// Radius of three boxes with the variance of a Gaussian.
fn box_radius(sigma_px: f64) -> usize {
    let side = (4.0 * sigma_px * sigma_px + 1.0).sqrt();
    (0.5 * (side - 1.0)).round() as usize
}

type Line<'a> = &'a (dyn Fn(&[f32], &mut [f32]) + Sync);

fn both_ways(values: &[f32], width: usize, line: Line<'_>) -> Vec<f32> {
    let height = values.len() / width.max(1);
    let rows = lines(values, width, line);
    let columns = lines(&transposed(&rows, width), height, line);
    transposed(&columns, height)
}

fn lines(values: &[f32], length: usize, line: Line<'_>) -> Vec<f32> {
    let mut out = vec![0.0; values.len()];
    let all = out
        .par_chunks_mut(length.max(1))
        .zip(values.par_chunks(length.max(1)));
    all.for_each(|(out, values)| line(values, out));
    out
}

fn weigh(line: &[f32], out: &mut [f32], kernel: &[f32]) {
    let last = line.len() - 1;
    for (x, out) in out.iter_mut().enumerate() {
        let (from, to) = (
            (x + 1).saturating_sub(kernel.len()),
            (x + kernel.len() - 1).min(last),
        );
        let (mut sum, mut weight) = (0.0, 0.0);
        for (i, value) in line.iter().enumerate().take(to + 1).skip(from) {
            let w = kernel[i.abs_diff(x)];
            sum += w * value;
            weight += w;
        }
        *out = sum / weight;
    }
}

fn slide(line: &[f32], out: &mut [f32], radius: usize) {
    let n = line.len();
    let mut sum: f64 = line.iter().take(radius).map(|&v| f64::from(v)).sum();
    let mut count = radius.min(n);
    let mut share = 1.0 / count.max(1) as f64;
    for x in 0..n {
        let enters = line.get(x + radius).copied();
        let leaves = (x > radius).then(|| line[x - radius - 1]);
        sum += f64::from(enters.unwrap_or(0.0)) - f64::from(leaves.unwrap_or(0.0));
        if enters.is_some() != leaves.is_some() {
            count = if enters.is_some() {
                count + 1
            } else {
                count - 1
            };
            share = 1.0 / count as f64;
        }
        out[x] = (sum * share) as f32;
    }
}

fn transposed(values: &[f32], width: usize) -> Vec<f32> {
    let height = values.len() / width.max(1);
    let mut out = vec![0.0; values.len()];
    for (y, row) in values.chunks(width.max(1)).enumerate() {
        for (x, value) in row.iter().enumerate() {
            out[x * height + y] = *value;
        }
    }
    out
}
