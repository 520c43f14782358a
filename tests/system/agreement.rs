//! Estimates with standard errors beside what they should be.

use uw_render::irradiance::{DepthIrradiance, IrradiancePlan};
use uw_render::prepare::Prepared;
use uw_render::scene::Scene;
use uw_tests::discrete_ordinates::Travel;
use uw_tests::gpu::{Backend, everywhere};
use uw_tests::measure_prepared;
use uw_tests::same_numbers::{Means, PART, assert_same_irradiances, assert_same_radiances};
use uw_tests::tiles::spread;

/// Departure of an irradiance from its reference that is let pass besides standard errors.
pub(crate) const IRRADIANCE_MARGIN: f64 = 0.002;
/// The same of a radiance in one direction.
const RADIANCE_MARGIN: f64 = 0.01;

/// An estimate beside what it should be.
pub(crate) struct Comparison {
    pub(crate) what: String,
    pub(crate) value: f64,
    pub(crate) standard_error: f64,
    pub(crate) reference: f64,
    pub(crate) margin: f64,
}

impl Comparison {
    fn z(&self) -> f64 {
        (self.value - self.reference) / self.standard_error
    }

    fn relative_error(&self) -> f64 {
        self.standard_error / self.reference
    }
}

/// Every estimate within three standard errors and its margin, and the set of deviations no wider than standard errors
/// say. `independent` is the number of values that share no random numbers.
pub(crate) fn assert_agreement(comparisons: &[Comparison], independent: usize) {
    for c in comparisons {
        println!(
            "{}: {:.6e} ± {:.3} %, reference {:.6e}, off by {:+.3} %, z {:+.2}",
            c.what,
            c.value,
            100.0 * c.relative_error(),
            c.reference,
            100.0 * (c.value / c.reference - 1.0),
            c.z()
        );
    }
    let z: Vec<f64> = comparisons.iter().map(Comparison::z).collect();
    let (rms, largest) = spread(&z);
    let widest = comparisons
        .iter()
        .map(Comparison::relative_error)
        .fold(0.0, f64::max);
    println!(
        "{} values: rms z {rms:.2}, largest {largest:.2}, widest error {:.2} %",
        z.len(),
        100.0 * widest
    );
    for c in comparisons {
        let allowed = 3.0 * c.standard_error + c.margin * c.reference;
        assert!(
            (c.value - c.reference).abs() < allowed,
            "{}: {} ± {}, {}",
            c.what,
            c.value,
            c.standard_error,
            c.reference
        );
    }
    // Spread of an rms of this many values: 1/sqrt(2n).
    assert!(
        rms < 1.0 + 4.0 / (2.0 * independent as f64).sqrt(),
        "rms z {rms}"
    );
}

/// Measured quantities of one channel beside references by number of the depth and name; `what` tells them apart.
pub(crate) fn compare(
    measured: &[DepthIrradiance],
    channel: usize,
    what: &str,
    reference: impl Fn(usize, &str) -> Option<f64>,
) -> Vec<Comparison> {
    let mut comparisons = Vec::new();
    for (level, row) in measured.iter().enumerate() {
        for (name, estimate) in row.quantities() {
            let Some(reference) = reference(level, name) else {
                continue;
            };
            comparisons.push(Comparison {
                what: format!("{name} at {} m, {what}", row.depth_m),
                value: estimate.value[channel],
                standard_error: estimate.standard_error[channel],
                reference,
                margin: if name == "L_u" {
                    RADIANCE_MARGIN
                } else {
                    IRRADIANCE_MARGIN
                },
            });
        }
    }
    comparisons
}

/// Sensors at `depths_m` measure what `references` makes comparisons with: on the vector units with `samples` directions per
/// depth and hemisphere, on other backends by what the vector units measure.
pub(crate) fn assert_sensors_agree(
    what: &str,
    scene: &Scene,
    depths_m: &[f64],
    (samples, seed): (u32, u64),
    references: impl Fn(&[DepthIrradiance]) -> Vec<Comparison>,
) {
    let plan = |samples| IrradiancePlan {
        depths_m: depths_m.to_vec(),
        samples,
        seed,
        threads: None,
        max_bounces: 0,
    };
    let scene = &Prepared::build(scene);
    everywhere(|backend| match backend {
        Backend::VectorUnits => {
            let measured = backend.irradiances_prepared(scene, &plan(samples));
            let comparisons = references(&measured.expect("measured"));
            // Hemispheres and one direction at each depth; quantities and channels share directions.
            assert_agreement(&comparisons, 3 * depths_m.len());
        }
        _ => assert_same_irradiances(backend, what, scene, &plan(samples / PART)),
    });
}

/// Equal pixels that look along one direction, against light that travels so at a depth, m.
pub(crate) struct View {
    pub(crate) scene: Prepared,
    pub(crate) at: (f64, Travel),
    pub(crate) reference: f64,
    pub(crate) seed: u64,
}

/// `views` show their references in one channel: on the vector units with `samples` of each pixel, on other backends by what
/// the vector units see.
pub(crate) fn assert_views_agree(views: &[View], channel: usize, samples: u32) {
    everywhere(|backend| match backend {
        Backend::VectorUnits => {
            let compared = |view: &View| {
                let seen = measure_prepared(backend, &view.scene, samples, 0, view.seed);
                compare_radiance(seen, channel, view.at, view.reference)
            };
            let comparisons: Vec<_> = views.iter().map(compared).collect();
            assert_agreement(&comparisons, comparisons.len());
        }
        _ => {
            for view in views {
                let what = format!("{:?}", view.at);
                let sampled = (samples / PART, 0, view.seed);
                assert_same_radiances(backend, &what, &view.scene, sampled);
            }
        }
    });
}

/// What pixels see of light that travels so at a depth, m, in one channel; `seen` is their mean and its error.
fn compare_radiance(
    seen: Means,
    channel: usize,
    (depth_m, travel): (f64, Travel),
    reference: f64,
) -> Comparison {
    Comparison {
        what: format!(
            "{depth_m} m, light travelling {:.2} down at {}°",
            travel.down, travel.azimuth_deg
        ),
        value: seen.0[channel],
        standard_error: seen.1[channel],
        reference,
        margin: RADIANCE_MARGIN,
    }
}

/// Two ways to the same means: within four standard errors, which are below 2 %.
pub(crate) fn assert_same_means(backend: Backend, one: Means, other: Means) {
    for k in 0..3 {
        let z = (one.0[k] - other.0[k]) / one.1[k].hypot(other.1[k]);
        println!("  channel {k}: {} {}, z {z:+.2}", one.0[k], other.0[k]);
        let errors = [one.1[k] / one.0[k], other.1[k] / other.0[k]];
        assert!(
            z.abs() < 4.0 && errors.iter().all(|e| *e < 0.02 * backend.noise()),
            "channel {k}: z {z}, relative errors {errors:?}"
        );
    }
}
