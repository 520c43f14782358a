//! Heavy tails among the samples of a pixel.

use uw_render::{
    integrator::cpu::{Selection, Worker},
    prepare::Prepared,
    scene::Scene,
};

/// Share of the largest value in the sum of squares: falls as 1/N where the variance is finite, and stays of the order
/// of one where it is not.
pub fn largest_share(values: &[f64]) -> f64 {
    let largest = values.iter().copied().fold(0.0, f64::max);
    largest * largest / values.iter().map(|v| v * v).sum::<f64>()
}

/// Largest share, of `samples` samples of each of some pixels (column, row), that one sample holds in the sum of
/// squares of its pixel.
pub fn largest_share_of(
    scene: &Scene,
    pixels: impl Iterator<Item = (u32, u32)>,
    samples: u32,
) -> f64 {
    let prepared = Prepared::build(scene);
    let selection = Selection {
        lamps: (0..prepared.lamps.len()).collect(),
        ambient: prepared.needs.ambient(),
        max_events: usize::MAX,
        share_walks: 1,
    };
    let mut worker = Worker::new(&prepared, &selection);
    let mut share = 0f64;
    for (column, row) in pixels {
        let values: Vec<f64> = (0..samples)
            .map(|i| worker.sample(9, column, row, i / 16, i % 16).total())
            .map(|t| t[0] + t[1] + t[2])
            .collect();
        share = share.max(largest_share(&values));
    }
    share
}
