//! The mean over clouds is the picture without snow.

use std::sync::atomic::AtomicBool;

use super::super::veil::{Guide, veil};
use super::super::{Source, View, snow};
use super::{opening, prepared, scene};
use crate::backend::Device;
use crate::film::{Film, FilmLayer};
use crate::gpu::{AdapterChoice, Gpu, skipped::skip_test};
use crate::integrator::{Plan, render};
use crate::prepare::Prepared;
use crate::scene::Scene;

static GO_ON: AtomicBool = AtomicBool::new(false);
/// Tiles along the sides of a picture of 48 × 27 pixels.
const TILES: [usize; 2] = [6, 3];

/// Sums over seeds of a tile's change, of its squares, and what share of light the flakes hold of it.
fn means_over_seeds(scene: &Scene, seeds: u32) -> Vec<(f64, f64)> {
    let mut prepared = prepared(scene, |_| {});
    let mut sums = vec![(0.0, 0.0); TILES[0] * TILES[1]];
    for seed in 0..seeds {
        prepared.snow.as_mut().expect("snow").seed = seed;
        let layers = snow(&prepared, false, &GO_ON).expect("seen");
        let mut change = vec![[0.0; 3]; 48 * 27];
        layers.add_to(FilmLayer::Total, &mut change);
        let mut tiles = vec![0.0; sums.len()];
        for (pixel, change) in change.iter().enumerate() {
            let (column, row) = (pixel % 48, pixel / 48);
            tiles[row / 9 * TILES[0] + column / 8] += change[1] / 72.0;
        }
        for (sum, tile) in sums.iter_mut().zip(tiles) {
            sum.0 += tile;
            sum.1 += tile * tile;
        }
    }
    let n = f64::from(seeds);
    let mean = |&(sum, squares): &(f64, f64)| {
        let mean = sum / n;
        (mean, ((squares / n - mean * mean) / (n - 1.0)).sqrt())
    };
    sums.iter().map(mean).collect()
}

/// Mean over the picture of what flakes take the place of.
fn mean_veil(scene: &Scene) -> f64 {
    let prepared = prepared(scene, |snow| snow.share = 1.0);
    let view = View::new(&prepared);
    let of_lamp = |lamp: usize| {
        let source = Source::new(&prepared, lamp).expect("water");
        let guide = Guide::new(&view, &source, 10.0).expect("light");
        let veil = veil(&view, &source, &guide, 1);
        let level = prepared.lamps[lamp].level;
        level * veil.iter().map(|light| light[1]).sum::<f64>() / veil.len() as f64
    };
    (0..2).map(of_lamp).sum()
}

/// Each tile within three standard errors of no change. Of 18 tiles one is beyond that by chance in 5 % of all sets of seeds,
/// two in 0.1 %: one may be. The standard errors are small beside the light that the flakes hold.
fn check_means(scene: &Scene, seeds: u32, error: f64) {
    let held = scene.snow.expect("snow").share * mean_veil(scene);
    let tiles = means_over_seeds(scene, seeds);
    let beyond = tiles
        .iter()
        .filter(|(mean, error)| mean.abs() > 3.0 * error);
    let mean = tiles.iter().map(|tile| tile.0).sum::<f64>() / tiles.len() as f64;
    let errors = tiles.iter().map(|tile| tile.1 * tile.1).sum::<f64>();
    let of_mean = errors.sqrt() / tiles.len() as f64;
    let told: Vec<String> = tiles
        .iter()
        .map(|(mean, error)| format!("{:.2} ({:.4})", mean / error, error / held))
        .collect();
    assert!(beyond.count() <= 1, "z (s.e. of the veil): {told:?}");
    assert!(mean.abs() <= 3.0 * of_mean, "mean {mean}, error {of_mean}");
    assert!(of_mean <= error * held, "error {of_mean} of {held}");
}

#[test]
fn the_mean_of_400_clouds_is_the_water() {
    let water = "a = [0.2, 0.1, 0.05]\nb = [0.4, 0.5, 0.6]\n\
                 snow = { share = 0.5, per_litre = 5, diameter_mm = [0.5, 3] }";
    check_means(&scene(water, ""), 400, 0.01);
}

/// Lens, streak and the drift of a second; flakes of all sizes near the camera.
#[test]
fn blurred_flakes_keep_the_mean_too() {
    let water = "a = [0.2, 0.1, 0.05]\nb = [0.4, 0.5, 0.6]\n\
                 snow = { share = 0.5, per_litre = 5, diameter_mm = [0.5, 3], time_s = 1, drift_m_s = [0.02, 0.05, -0.1] }";
    let camera = scene(water, "");
    let mut blurred = camera.clone();
    let blur = &mut blurred.snow.as_mut().expect("snow").blur;
    (blur.exposure_s, blur.velocity_m_s) = (0.05, glam::DVec3::new(0.5, 0.4, 0.0));
    blurred.camera.opening = opening(0.01, 0.6);
    check_means(&blurred, 400, 0.01);
}

#[test]
fn water_by_wavelength_that_varies_keeps_its_mean() {
    let water = "profile = [{ depth_m = 1.5, jerlov = \"IB\" }, { depth_m = 2.2, jerlov = \"5C\" }]\n\
                 snow = { share = 0.5, per_litre = 5, diameter_mm = [0.5, 3] }\n\
                 plume = [{ center_m = [0.7, -0.3, -2], sigma_m = 0.2, a = [0, 0, 0], b = [2, 2, 2] }]";
    check_means(&scene(water, "[surface]\n"), 100, 0.02);
}

/// What flakes take the place of is what the renderer finds of light scattered once, where nothing else is to be met: its
/// own mean within three standard errors and 0.3 % for the water nearer than flakes and next to the lamps.
#[test]
fn the_veil_is_the_renderers_own() {
    for water in [
        "a = [0.2, 0.1, 0.05]\nb = [0.4, 0.5, 0.6]\nsnow = { per_litre = 1e-3 }",
        "profile = [{ depth_m = 1.5, a = [0.2, 0.1, 0.05], b = [0.1, 0.1, 0.1] }, { depth_m = 2.2, a = [0.2, 0.1, 0.05], \
         b = [0.8, 0.7, 0.6] }]\nsnow = { per_litre = 1e-3 }\n\
         plume = [{ center_m = [0.7, -0.3, -2], sigma_m = 0.2, a = [0, 0, 0], b = [2, 2, 2] }]",
    ] {
        let mut scene = scene(water, "[surface]\nrefractive = false\n");
        scene.quads.clear();
        let prepared = Prepared::build(&scene);
        let view = View::new(&prepared);
        let plan = Plan {
            samples_per_pixel: Some(1024),
            max_bounces: 1,
            ..Plan::new(1)
        };
        let bare = Prepared {
            snow: None,
            ..prepared.clone()
        };
        let (film, _) = render(&bare, &plan, &GO_ON, &|_| {}).expect("rendered");
        for lamp in 0..2 {
            let source = Source::new(&prepared, lamp).expect("water");
            let guide = Guide::new(&view, &source, 200.0).expect("light");
            let own: Vec<_> = (0..16)
                .flat_map(|seed| veil(&view, &source, &guide, seed))
                .collect();
            let theirs = film.layer(FilmLayer::Lamp(lamp));
            for k in 0..3 {
                let mean = |of: &[[f64; 3]]| of.iter().map(|p| p[k]).sum::<f64>() / of.len() as f64;
                let (own, theirs) = (mean(&own), mean(&theirs));
                let error = film.variance_of_mean()[k].sqrt();
                assert!(
                    (own - theirs).abs() <= 3.0 * error + 3e-3 * theirs,
                    "lamp {lamp} channel {k}: {own} {theirs}"
                );
            }
        }
    }
}

/// Every backend shows the same snow, in the picture, the veil and each lamp's layer, which still add up.
#[test]
fn films_show_the_snow_in_the_layers_of_its_light() {
    let water = "a = [0.2, 0.1, 0.05]\nb = [0.4, 0.5, 0.6]\nsnow = { share = 0.5, per_litre = 2 }";
    let with = Prepared::build(&scene(water, ""));
    let without = Prepared {
        snow: None,
        ..with.clone()
    };
    let layers = snow(&with, false, &GO_ON).expect("seen");
    let plan = Plan {
        samples_per_pixel: Some(1),
        ..Plan::new(1)
    };
    let gpu = match Gpu::open(AdapterChoice::Best) {
        Ok(gpu) => Some(Device::from(gpu)),
        Err(error) => {
            skip_test(&error);
            None
        }
    };
    for device in [Device::Cpu, Device::CpuSimd].into_iter().chain(gpu) {
        let film = |scene: &Prepared| -> Film {
            let rendered = device.render(scene, &plan, &GO_ON, &|_| {});
            rendered.expect("rendered").0
        };
        let (with, without) = (film(&with), film(&without));
        for layer in [
            FilmLayer::Total,
            FilmLayer::Backscatter,
            FilmLayer::Lamp(0),
            FilmLayer::Lamp(1),
            FilmLayer::Direct,
            FilmLayer::Ambient,
            FilmLayer::Variance,
        ] {
            let mut expected = without.layer(layer);
            layers.add_to(layer, &mut expected);
            let same =
                |(x, y): (&[f64; 3], &[f64; 3])| (0..3).all(|k| x[k].to_bits() == y[k].to_bits());
            assert!(
                with.layer(layer).iter().zip(&expected).all(same),
                "{layer:?}"
            );
        }
        let [total, first, second] =
            [FilmLayer::Total, FilmLayer::Lamp(0), FilmLayer::Lamp(1)].map(|l| with.layer(l));
        for (i, total) in total.iter().enumerate() {
            let sum = first[i][0] + 0.6 * second[i][0];
            assert!(
                (sum - total[0]).abs() <= 1e-6 * total[0].abs().max(1e-3),
                "{sum} {}",
                total[0]
            );
        }
    }
}
