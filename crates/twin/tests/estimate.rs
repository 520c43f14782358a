//! The estimate of contrast: its expectation at other numbers of paths, and against plain renders.

use std::sync::atomic::AtomicBool;

use uw_assets::assets_dir;
use uw_calib::ImageStats;
use uw_calib::vehicle::Vehicle;
use uw_media::spectral::{Curve, Response, WaterBands, WaterSpectrum};
use uw_render::scene::{Scene, Spectral};
use uw_scenery::textures::Pattern;
use uw_twin::environment::{MEAN, Target, View, WaterBody, scene_in, sensor};
use uw_twin::estimate::pyramid::TexturePyramid;
use uw_twin::estimate::response::CountResponse;
use uw_twin::estimate::statistics::StandardErrors;
use uw_twin::estimate::target_image::TargetImage;
use uw_twin::measure::{Quality, RenderedView};

const LIGHT_PCT: f64 = 60.0;

struct Setup {
    scene: Scene,
    pyramid: TexturePyramid,
    vehicle: Vehicle,
}

impl Setup {
    /// A turbid view in which scattered light, both of the veil and of the target, carries much of the image.
    fn new(width: u32, height: u32) -> Self {
        let vehicle = Vehicle {
            width,
            height,
            exposure: 8.0,
            ..Vehicle::default()
        };
        let (scene, target) = view_in(&vehicle, MEAN);
        Self {
            scene,
            pyramid: TexturePyramid::new(&target.texture, 6.0),
            vehicle,
        }
    }

    fn estimate(&self, seed: u64, paths_per_group: u32) -> ImageStats {
        self.with_errors(seed, paths_per_group).0
    }

    fn with_errors(&self, seed: u64, paths_per_group: u32) -> (ImageStats, StandardErrors) {
        let never = AtomicBool::new(false);
        let image = TargetImage::render(&self.scene, &self.pyramid, seed, paths_per_group, &never)
            .expect("the target fills the view")
            .expect("not cancelled");
        let exposure = self.vehicle.exposure;
        let response = CountResponse::new(&sensor(&self.vehicle, exposure));
        (
            image.statistics(&response, exposure, LIGHT_PCT),
            image.standard_errors(&response, exposure, LIGHT_PCT),
        )
    }

    fn plain_render(&self, seed: u64, samples_per_half: u32) -> ImageStats {
        let quality = Quality {
            samples_per_half,
            seed,
            threads: None,
        };
        let never = AtomicBool::new(false);
        let view = RenderedView::render(&self.scene, quality, &never).expect("a render");
        view.statistics(&sensor(&self.vehicle, self.vehicle.exposure), LIGHT_PCT)
    }
}

/// The vehicle's scene in `bands`, and the target.
fn view_in(vehicle: &Vehicle, bands: WaterBands) -> (Scene, Target) {
    let assets = assets_dir().expect("assets");
    let target = Target::read(Pattern::Seabed, &assets).expect("a texture");
    let water = WaterBody {
        jerlov: "3C".parse().expect("a water"),
        backscatter_fraction: 0.0183,
    };
    let view = View::Target {
        depth_m: 2.0,
        distance_m: 1.0,
    };
    let scene = scene_in(vehicle, &water, bands, &target, view).expect("a scene");
    (scene, target)
}

/// Mean and standard error of the contrast over seeds.
fn over_seeds(setup: &Setup, seeds: u64, paths_per_group: u32) -> ([f64; 3], [f64; 3]) {
    let all: Vec<[f64; 3]> = (0..seeds)
        .map(|s| setup.estimate(1 + 2 * s, paths_per_group).contrast)
        .collect();
    let n = seeds as f64;
    let mean: [f64; 3] = std::array::from_fn(|k| all.iter().map(|c| c[k]).sum::<f64>() / n);
    let error = std::array::from_fn(|k| {
        let spread: f64 = all.iter().map(|c| (c[k] - mean[k]).powi(2)).sum();
        (spread / (n * (n - 1.0))).sqrt()
    });
    (mean, error)
}

#[test]
fn standard_errors_are_the_spread_over_seeds() {
    let setup = Setup::new(160, 96);
    let (seeds, paths) = (40, 128);
    let all: Vec<_> = (0..seeds)
        .map(|s| setup.with_errors(1 + 2 * s, paths))
        .collect();
    let n = seeds as f64;
    for k in 0..3 {
        let mean = all.iter().map(|(stats, _)| stats.contrast[k]).sum::<f64>() / n;
        let squares = all
            .iter()
            .map(|(stats, _)| (stats.contrast[k] - mean).powi(2));
        let spread = (squares.sum::<f64>() / (n - 1.0)).sqrt();
        let told = all.iter().map(|(_, errors)| errors.contrast[k].powi(2));
        let told = (told.sum::<f64>() / n).sqrt();
        // A spread over 40 seeds is known to 11 %: four times that, and a fifth for the pixels that errors are told from.
        assert!(
            (told / spread - 1.0).abs() < 0.6,
            "{k}: told {told}, spread {spread}"
        );
    }
}

#[test]
fn the_expected_contrast_does_not_depend_on_the_number_of_paths() {
    let setup = Setup::new(160, 96);
    let (few, few_error) = over_seeds(&setup, 24, 128);
    let (many, many_error) = over_seeds(&setup, 6, 1024);
    for k in 0..3 {
        let error = few_error[k].hypot(many_error[k]);
        // Four standard errors of three comparisons, and 0.3 % for what the roots of the patches leave.
        assert!(
            (few[k] - many[k]).abs() < 4.0 * error + 0.003 * many[k],
            "{few:?} ± {few_error:?}, {many:?} ± {many_error:?}"
        );
        // The test would not see a bias larger than its own noise: that is to be small.
        assert!(error < 0.02 * many[k], "{error} {many:?}");
    }
}

/// Contrast and mean agree; the plain estimate's own noise is about 1 %.
fn assert_alike(estimate: &ImageStats, plain: &ImageStats) {
    for k in 0..3 {
        let (a, b) = (estimate.contrast[k], plain.contrast[k]);
        assert!((a - b).abs() < 0.1 + 0.03 * b, "{estimate:?} {plain:?}");
        let (a, b) = (estimate.mean[k], plain.mean[k]);
        assert!((a / b - 1.0).abs() < 0.01, "{estimate:?} {plain:?}");
    }
}

#[test]
fn contrast_and_mean_are_those_of_plain_renders() {
    let setup = Setup::new(160, 96);
    let estimate = setup.estimate(3, 1024);
    let plain = setup.plain_render(5, 48);
    assert_alike(&estimate, &plain);
}

/// A curve that is `first` in the shorter half of each box of the camera's response and `second` in the longer one.
fn by_halves(first: f64, second: f64) -> Curve {
    let halves = (0..6).map(|half| 400.0 + 50.0 * f64::from(half));
    let values = [first, second].into_iter().cycle();
    let ends = |(from, value)| [(from, value), (from + 49.999, value)];
    Curve::new(halves.zip(values).flat_map(ends).collect())
}

/// Of each channel one half of the wavelengths goes far and the other does not, and the texture's red and green are
/// opposites: what reaches the camera unscattered, how the rest is spread, and of which colours of the texture it is are far
/// from what three bands make of the water. With the transmittance, the walks or the colours of three bands this fails.
#[test]
fn contrast_and_mean_by_wavelength_are_those_of_plain_renders() {
    let mut setup = Setup::new(120, 72);
    let spectral = Spectral::of(
        WaterSpectrum {
            a: by_halves(0.05, 3.0),
            b: by_halves(0.4, 2.0),
        },
        Response::boxes(),
    );
    let water = setup.scene.water.as_mut().expect("water");
    water.iops = spectral.wideband();
    setup.scene.spectral = Some(spectral);
    let texture = &mut setup.scene.textures[0];
    let opposite = |[r, _, b]: [f32; 3]| [r, 0.6 * (1.0 - r), b];
    let texels: Vec<[f32; 3]> = texture.texels.iter().map(opposite).collect();
    texture.texels = texels.into();
    setup.pyramid = TexturePyramid::new(texture, 6.0);
    let (estimate, plain) = (setup.estimate(3, 2048), setup.plain_render(5, 48));
    assert_alike(&estimate, &plain);
}

/// The camera, lamps and daylight that a vehicle names are those of its scenes, and of the estimate.
#[test]
fn labels_of_a_vehicle_with_spectra_are_those_of_plain_renders() {
    let mut setup = Setup::new(120, 72);
    let even = setup.scene.clone();
    setup.vehicle = Vehicle {
        response: Some("canon5d2".into()),
        lamp_spectrum: Some("led-5000k".into()),
        daylight_spectrum: Some("clear-sky".into()),
        ..setup.vehicle
    };
    setup.scene = view_in(&setup.vehicle, WaterBands::Spectral).0;
    let spectral = setup.scene.spectral.as_ref().expect("by wavelength");
    assert_eq!(spectral.response.name, "canon5d2");
    assert!(spectral.sun.is_some() && spectral.sky.is_some());
    assert!(setup.scene.lamps.iter().all(|lamp| lamp.spectrum.is_some()));
    assert!(even.spectral.is_none() && even.lamps.iter().all(|lamp| lamp.spectrum.is_none()));
    let (estimate, plain) = (setup.estimate(3, 2048), setup.plain_render(5, 48));
    assert_alike(&estimate, &plain);
}
