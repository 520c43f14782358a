//! Both samplers of every phase function: chi-squared, mean cosine, backscatter.

use uw_media::phase::{Phase, PhaseFunction};

use crate::models::{Model, every_model};
use crate::statistics::{ChiSquared, Rng, histogram_edges, sidak_limit};

/// The exact inverse is a hundred times slower than the table.
const EXACT_SAMPLES: usize = 30_000;
const TABLE_SAMPLES: usize = 200_000;

/// Histogram of sampled x over the edges, mean cosine and backscattered share.
struct Sampled {
    samples: f64,
    counts: Vec<f64>,
    mean_x: f64,
    variance_x: f64,
    backward: f64,
}

fn draw(edges: &[f64], seed: u64, samples: usize, sample: impl Fn(f64) -> f64) -> Sampled {
    let mut rng = Rng::new(seed);
    let mut counts = vec![0.0; edges.len() - 1];
    let (mut sum, mut squares, mut backward) = (0.0, 0.0, 0.0);
    for _ in 0..samples {
        let x = sample(rng.uniform());
        let cell = edges
            .partition_point(|edge| *edge < x)
            .clamp(1, counts.len());
        counts[cell - 1] += 1.0;
        sum += x;
        squares += x * x;
        backward += f64::from(u8::from(x > 0.5));
    }
    let n = samples as f64;
    Sampled {
        samples: n,
        counts,
        mean_x: sum / n,
        variance_x: squares / n - (sum / n) * (sum / n),
        backward: backward / n,
    }
}

fn expected_counts(edges: &[f64], phase: &Phase, samples: f64) -> Vec<f64> {
    edges
        .windows(2)
        .map(|pair| {
            let share = if pair[1] <= 0.5 {
                phase.cdf(pair[1]) - phase.cdf(pair[0])
            } else {
                phase.ccdf(pair[0]) - phase.ccdf(pair[1])
            };
            share * samples
        })
        .collect()
}

fn check(model: &Model, sampled: &Sampled, edges: &[f64], limit: f64) {
    let Model { name, phase, .. } = model;
    let chi = ChiSquared::new(
        &sampled.counts,
        &expected_counts(edges, phase, sampled.samples),
    );
    assert!(
        chi.degrees == 0 || chi.z() < limit,
        "{name}: chi-squared {} with {} degrees of freedom, z {}",
        chi.statistic,
        chi.degrees,
        chi.z()
    );
    let n = sampled.samples;
    let mean_x = 0.5 * (1.0 - phase.mean_cosine());
    let z = (sampled.mean_x - mean_x) / (sampled.variance_x / n).sqrt();
    assert!(
        z.abs() < limit + 1.0,
        "{name}: mean cosine off by {z} sigma"
    );
    let b = phase.backscatter_fraction();
    let z = (sampled.backward - b) / (b * (1.0 - b) / n).sqrt();
    assert!(
        z.abs() < limit + 1.0,
        "{name}: backscatter off by {z} sigma"
    );
}

#[test]
fn inverse_cdf_samples_the_phase_function() {
    let (models, edges) = (every_model(), histogram_edges());
    let limit = sidak_limit(models.len());
    for (i, model) in models.iter().enumerate() {
        let sampled = draw(&edges, 7 + i as u64, EXACT_SAMPLES, |u| {
            model.phase.inverse_cdf(u)
        });
        check(model, &sampled, &edges, limit);
    }
}

#[test]
fn the_table_samples_the_phase_function() {
    let (models, edges) = (every_model(), histogram_edges());
    let limit = sidak_limit(models.len());
    for (i, model) in models.iter().enumerate() {
        let sampled = draw(&edges, 1007 + i as u64, TABLE_SAMPLES, |u| {
            model.table.sample_x(u)
        });
        check(model, &sampled, &edges, limit);
    }
}
