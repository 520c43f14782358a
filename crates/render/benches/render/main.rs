//! The renderer, part by part and as a whole, on scenes with fixed seeds. Rates are rays, path vertices, samples or pixels
//! per second.
//!
//! `cargo bench -p uw-render -- WORDS` runs those whose name contains WORDS.

mod features;
mod gpu;
mod paths;
mod picture;
mod scaling;
mod scenes;
mod traversal;

use std::time::Duration;

use criterion::Criterion;
use uw_render::scene::SceneError;

fn main() -> Result<(), SceneError> {
    let mut criterion = Criterion::default()
        .sample_size(20)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_millis(1500))
        .configure_from_args();
    traversal::bench(&mut criterion);
    paths::bench(&mut criterion)?;
    features::bench(&mut criterion)?;
    scaling::bench(&mut criterion)?;
    picture::bench(&mut criterion)?;
    gpu::bench(&mut criterion)?;
    criterion.final_summary();
    Ok(())
}
