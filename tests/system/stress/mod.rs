//! Numerical stability: scenes at the edges of what a user can write, none of which may give a picture with a value
//! that is not finite or negative.

mod corpus;
mod endings;
mod extreme;

use std::sync::LazyLock;

use proptest::{prelude::*, test_runner::RngSeed};
use uw_render::{
    film::{Film, FilmLayer},
    prepare::Prepared,
};
use uw_tests::{
    gpu::{Backend, PROCESSOR, device},
    plan,
};

use extreme::extremes;

/// The first value of a picture of a scene with one lamp that is no radiance, with its layer.
fn unsound(film: &Film) -> Option<String> {
    let layers = [
        FilmLayer::Total,
        FilmLayer::Ambient,
        FilmLayer::Lamp(0),
        FilmLayer::Direct,
        FilmLayer::Backscatter,
        FilmLayer::Variance,
    ];
    let bad = |value: &f64| !(value.is_finite() && *value >= 0.0);
    layers.into_iter().find_map(|layer| {
        let mut pixels = film.layer(layer).into_iter();
        let pixel = pixels.find(|pixel| pixel.iter().any(bad))?;
        Some(format!("{layer:?}: {pixel:?}"))
    })
}

/// Asked for once, so that it is missed once.
static ADAPTER: LazyLock<Option<Backend>> = LazyLock::new(|| device().map(|_| Backend::Adapter));

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, rng_seed: RngSeed::Fixed(20), ..ProptestConfig::default() })]

    #[test]
    fn every_value_of_every_layer_is_finite_and_not_negative(extreme in extremes()) {
        // An adapter, which compiles kernels for every set of features, is given one case in sixteen.
        let adapter = ADAPTER.filter(|_| extreme.seed % 16 == 0);
        let scene = Prepared::build(&extreme.scene());
        for backend in PROCESSOR.into_iter().chain(adapter) {
            let (film, _) = backend.render_prepared(&scene, &plan(4, extreme.seed));
            prop_assert_eq!(unsound(&film), None, "{}", backend.name());
        }
    }
}
