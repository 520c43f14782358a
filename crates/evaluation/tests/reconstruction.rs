//! Views made clean from few samples against renders of many samples.

use std::sync::atomic::AtomicBool;

use uw_calib::vehicle::Vehicle;
use uw_evaluation::operation::render::{Job, render_view};
use uw_media::WaterType;
use uw_render::image::Picture;
use uw_scenery::textures::Pattern;
use uw_twin::environment::{Target, View as Look, WaterBody, scene, sensor};
use uw_twin::measure::{Quality, RenderedView};

/// Root mean square difference over root mean square, green.
fn difference(a: &Picture, b: &Picture) -> f64 {
    let pairs = || a.data.iter().zip(&b.data);
    let squares: f64 = pairs().map(|(a, b)| f64::from(a[1] - b[1]).powi(2)).sum();
    let level: f64 = pairs().map(|(_, b)| f64::from(b[1]).powi(2)).sum();
    (squares / level).sqrt()
}

/// Amplitude of the texture in `wanted` in units of that in `got`: slope of the regression inside patches of 12 × 11
/// pixels, green. The noise of `wanted` does not bias it.
fn amplitude(got: &Picture, wanted: &Picture) -> f64 {
    let (width, height) = (got.width as usize, got.height as usize);
    let (mut product, mut square) = (0.0, 0.0);
    for (left, top) in (0..height)
        .step_by(11)
        .flat_map(|top| (0..width).step_by(12).map(move |left| (left, top)))
    {
        let values = |picture: &Picture| -> Vec<f64> {
            let inside =
                (top..top + 11).flat_map(|y| (left..left + 12).map(move |x| y * width + x));
            let values: Vec<f64> = inside.map(|i| f64::from(picture.data[i][1])).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            values.into_iter().map(|v| v - mean).collect()
        };
        for (x, y) in values(got).into_iter().zip(values(wanted)) {
            product += x * y;
            square += x * x;
        }
    }
    product / square
}

fn mean(picture: &Picture) -> f64 {
    picture.mean()[1]
}

#[test]
fn four_samples_made_clean_are_nearer_to_many_samples_than_those_are_to_themselves() {
    let vehicle = Vehicle {
        width: 120,
        height: 66,
        ..Vehicle::default()
    };
    let assets = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets");
    let target = Target::read(Pattern::Seabed, &assets).expect("texture");
    let water = WaterBody {
        jerlov: WaterType::ALL[3].into(),
        backscatter_fraction: 0.0183,
    };
    let look = Look::Target {
        depth_m: 2.0,
        distance_m: 1.5,
    };
    let scene = scene(&vehicle, &water, &target, look).expect("scene");
    let cancel = AtomicBool::new(false);
    let job = Job {
        samples: [4; 2],
        seed: 5,
        threads: None,
        cancel: &cancel,
    };
    let sensor = sensor(&vehicle, vehicle.exposure);
    let clean = render_view(&scene, &sensor, &job).expect("view");
    let quality = |samples_per_half, seed| Quality {
        samples_per_half,
        seed,
        threads: None,
    };
    let many = RenderedView::render(&scene, quality(32, 11), &cancel).expect("render");
    let few = RenderedView::render(&scene, quality(2, 12), &cancel).expect("render");
    for light_pct in [0.0, 100.0] {
        let wanted = many.picture(light_pct);
        let got = clean.picture(light_pct);
        let (raw, cleaned) = (
            difference(&few.picture(light_pct), &wanted),
            difference(&got, &wanted),
        );
        eprintln!(
            "{light_pct} %: raw {raw:.4}, cleaned {cleaned:.4}, mean {:.4}",
            mean(&got) / mean(&wanted)
        );
        // The picture of 64 samples has a quarter of the raw noise of 4.
        assert!(cleaned < 0.45 * raw, "{light_pct} %: {raw} {cleaned}");
        assert!((mean(&got) / mean(&wanted) - 1.0).abs() < 0.02);
        let amplitude = amplitude(&got, &wanted);
        eprintln!("amplitude of the texture {amplitude:.3}");
        // The raw noise of 4 samples is 0.4 of the level, the texture 0.2, the pixels 7920: the fit knows the amplitude
        // to 0.4/0.2/sqrt(7920) = 0.025.
        assert!((amplitude - 1.0).abs() < 0.08, "{light_pct} %: {amplitude}");
    }
}
