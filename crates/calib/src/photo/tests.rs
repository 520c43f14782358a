//! Pictures that are opened keep the contrast of what they show, whatever is done to them.

use std::path::Path;

use image::RgbImage;

use super::*;
use crate::noise::{NoiseModel, SensorNoise};
use crate::normal::Normal;
use crate::picture::Counts;
use crate::response::LinearNoise;
use crate::stats::Measured;
use crate::vehicle::Vignetting;
use crate::{Encoding, Even};

const SIZE: [u32; 2] = [400, 240];
const NOISE: LinearNoise = LinearNoise { a: 6e-4, b: 1e-5 };

/// Stripes that are softer than a pixel, stored with noise (none for seed 0) at an exposure.
fn picture(exposure: f64, seed: u64) -> RgbImage {
    let mut normal = Normal::new(seed);
    RgbImage::from_fn(SIZE[0], SIZE[1], |x, y| {
        let (x, y) = (f64::from(x), f64::from(y));
        let light = exposure * (0.15 + 0.02 * (0.19 * x + 0.1 * y).sin());
        image::Rgb([0; 3].map(|_: u8| {
            let normal = match seed {
                0 => 0.0,
                _ => normal.next(),
            };
            let seen = light + NOISE.standard_deviation(light) * normal;
            Encoding::Srgb.counts(seen).round() as u8
        }))
    })
}

fn sensor() -> NoiseModel {
    NoiseModel::Sensor(SensorNoise::new(Encoding::Srgb, NOISE).unwrap())
}

/// A picture that was exposed `over` times as long as it is brought to.
fn view(path: &Path, over: f64) -> View<'_> {
    View {
        path,
        distance_m: None,
        exposed: Exposed {
            over,
            ..Exposed::ALIKE
        },
    }
}

fn measured(treatment: &Treatment, path: &Path, over: f64, noise: &NoiseModel) -> Measured {
    let opened = treatment.open(&view(path, over)).unwrap();
    opened.measure(noise).unwrap()
}

/// The contrast without noise and the mean of a picture that was made of `seen`, over those of one made of `clean`.
fn kept(treatment: &Treatment, (seen, over): (&RgbImage, f64), clean: &RgbImage) -> Vec<[f64; 2]> {
    let folder = tempfile::tempdir().unwrap();
    let [of_seen, of_clean] = ["seen.png", "clean.png"].map(|name| folder.path().join(name));
    seen.save(&of_seen).unwrap();
    clean.save(&of_clean).unwrap();
    let right = measured(treatment, &of_clean, 1.0, &sensor()).grid.stats;
    let share = |noise: &NoiseModel| {
        let got = measured(treatment, &of_seen, over, noise);
        let contrast = got.detail.unwrap().contrast[1] / right.contrast[1];
        [contrast, got.grid.stats.mean[1] / right.mean[1]]
    };
    [sensor(), NoiseModel::Picture].iter().map(share).collect()
}

fn close(shares: &[[f64; 2]]) {
    for [contrast, mean] in shares {
        assert!((contrast - 1.0).abs() < 0.03, "{shares:?}");
        assert!((mean - 1.0).abs() < 0.01, "{shares:?}");
    }
}

#[test]
fn another_exposure_is_brought_to_the_counts_of_one() {
    for over in [0.4, 2.5] {
        close(&kept(
            &Treatment::default(),
            (&picture(over, 7), over),
            &picture(1.0, 0),
        ));
    }
}

#[test]
fn pixels_at_full_scale_stay_there_at_any_exposure() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bright.png");
    picture(8.0, 7).save(&path).unwrap();
    let got = measured(&Treatment::default(), &path, 8.0, &sensor())
        .detail
        .unwrap();
    assert!(got.saturated[1] > 0.3, "{got:?}");
}

#[test]
fn resampling_takes_off_as_much_noise_as_is_counted_with() {
    // Some places fall on pixels, some between them.
    let way = |x: f64, y: f64| Some([1.07 * x + 0.013 * y, 0.013 * x + 1.04 * y]);
    let to = [SIZE[0] * 9 / 10, SIZE[1] * 9 / 10];
    let treatment = Treatment {
        undistortion: Some(Undistortion::new(
            50.0,
            Resampling::new(SIZE, to, way),
            Vec::new(),
        )),
        ..Treatment::default()
    };
    close(&kept(&treatment, (&picture(1.0, 7), 1.0), &picture(1.0, 0)));
    close(&kept(&treatment, (&picture(2.0, 7), 2.0), &picture(1.0, 0)));
}

#[test]
fn the_mean_of_frames_has_the_noise_of_one_over_their_number() {
    let folder = tempfile::tempdir().unwrap();
    let frames = folder.path().join("frames");
    std::fs::create_dir(&frames).unwrap();
    for seed in 1..=6 {
        let frame = picture(1.0, seed);
        frame.save(frames.join(format!("{seed}.png"))).unwrap();
    }
    let clean = folder.path().join("clean.png");
    picture(1.0, 0).save(&clean).unwrap();
    let plain = Treatment::default();
    let right = measured(&plain, &clean, 1.0, &sensor()).grid.stats.contrast[1];
    let one = measured(&plain, &frames.join("1.png"), 1.0, &sensor())
        .detail
        .unwrap();
    let all = measured(&plain, &frames, 1.0, &sensor()).detail.unwrap();
    assert!(
        (all.contrast[1] / right - 1.0).abs() < 0.02,
        "{} {right}",
        all.contrast[1]
    );
    let share = all.noise[1] / one.noise[1];
    assert!((share - 6f64.powf(-0.5)).abs() < 0.01, "{share}");
}

#[test]
fn what_is_masked_has_no_say() {
    let mask = "format = \"uw-mask/1\"\nwidth = 400\nheight = 240\n[[polygon]]\npoints = [[0, 150], [150, 240], [0, 240]]\n";
    let treatment = Treatment {
        mask: Some(Mask::parse(mask, "mask.toml").unwrap()),
        ..Treatment::default()
    };
    // A white corner with black stripes, where the mask is.
    let covered = |exposure: f64| {
        let mut covered = picture(exposure, 7);
        for y in 151..240 {
            for x in 0..(y - 151) * 150 / 90 {
                covered.put_pixel(x, y, image::Rgb([if x % 9 == 0 { 0 } else { 255 }; 3]));
            }
        }
        covered
    };
    for over in [1.0, 2.0] {
        close(&kept(&treatment, (&covered(over), over), &picture(1.0, 0)));
    }
    let covered = covered(1.0);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("covered.png");
    covered.save(&path).unwrap();
    let got = measured(&treatment, &path, 1.0, &NoiseModel::Picture);
    assert_eq!(got.detail.unwrap().saturated, [0.0; 3]);
    let left_out = got
        .grid
        .patches
        .iter()
        .filter(|patch| patch.mean[0].is_nan());
    assert_eq!(left_out.count(), 4);
    // Where nothing of the grid is left that is said.
    let all = mask.replace(
        "[0, 150], [150, 240], [0, 240]",
        "[0, 0], [400, 0], [400, 239], [0, 239]",
    );
    let treatment = Treatment {
        mask: Some(Mask::parse(&all, "mask.toml").unwrap()),
        ..Treatment::default()
    };
    let view = View {
        path: &path,
        distance_m: None,
        exposed: Exposed::ALIKE,
    };
    let error = treatment
        .open(&view)
        .unwrap()
        .measure(&sensor())
        .unwrap_err();
    assert!(
        error.to_string().contains("covered.png: no patch"),
        "{error}"
    );
}

#[test]
fn pictures_of_another_size_than_mask_or_camera_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("seen.png");
    picture(1.0, 0).save(&path).unwrap();
    let mask = "format = \"uw-mask/1\"\nwidth = 40\nheight = 24\n[[polygon]]\npoints = [[0, 0], [9, 0], [0, 9]]\n";
    let same = |x: f64, y: f64| Some([x, y]);
    for (treatment, words) in [
        (
            Treatment {
                mask: Some(Mask::parse(mask, "mask.toml").unwrap()),
                ..Treatment::default()
            },
            "the mask's 40 x 24 pixels (mask.toml), got 400 x 240",
        ),
        (
            Treatment {
                undistortion: Some(Undistortion::new(
                    50.0,
                    Resampling::new([80, 60], [40, 24], same),
                    Vec::new(),
                )),
                ..Treatment::default()
            },
            "the 80 x 60 pixels of the camera's file, got 400 x 240",
        ),
    ] {
        let view = View {
            path: &path,
            distance_m: None,
            exposed: Exposed::ALIKE,
        };
        let error = treatment.open(&view).unwrap_err().to_string();
        assert!(
            error.contains("seen.png") && error.contains(words),
            "{error}"
        );
    }
}

#[test]
fn a_turned_picture_is_measured_as_it_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("turned.jpg");
    let mut jpeg = std::io::Cursor::new(Vec::new());
    picture(1.0, 0)
        .write_to(&mut jpeg, image::ImageFormat::Jpeg)
        .unwrap();
    let turned = exif::tests::short(::exif::Tag::Orientation, 6);
    std::fs::write(&path, exif::tests::with_exif(&jpeg.into_inner(), &[turned])).unwrap();
    let got = measured(&Treatment::default(), &path, 1.0, &sensor());
    assert_eq!([got.grid.width, got.grid.height], [240, 400]);
    assert!(Shot::of_file(&path).turned);
}

/// Mean over the patches of a picture of the variance of light in them, of pixels and of means over 4 × 4 of them times 16.
fn variances(counts: &Counts) -> [f64; 2] {
    let side = [counts.width / 10, counts.height / 6];
    let light = |x: usize, y: usize| Encoding::Srgb.light(counts.pixels[y * counts.width + x][1]);
    let mut found = [0.0; 2];
    for patch in 0..60 {
        let corner = [patch % 10 * side[0], patch / 10 * side[1]];
        for (of, window) in found.iter_mut().zip([1, 4]) {
            let pixels = (window * window) as f64;
            let [columns, rows] = side.map(|side| side / window);
            let mean = |i: usize| {
                let (x, y) = (i % columns * window, i / columns * window);
                let inside = 0..window * window;
                let light =
                    |j: usize| light(corner[0] + x + j % window, corner[1] + y + j / window);
                inside.map(light).sum::<f64>() / pixels
            };
            let means: Vec<f64> = (0..columns * rows).map(mean).collect();
            let n = means.len() as f64;
            let middle = means.iter().sum::<f64>() / n;
            let square: f64 = means.iter().map(|mean| (mean - middle).powi(2)).sum();
            *of += pixels * square / (n - 1.0) / 60.0;
        }
    }
    found
}

#[test]
fn what_a_picture_has_of_the_stored_noise_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let (path, frames) = (folder.path().join("grey.png"), folder.path().join("frames"));
    std::fs::create_dir(&frames).unwrap();
    let lens = Vignetting::new([-0.3, 0.0, 0.0]).unwrap();
    let lens = Even::new(lens, Encoding::Srgb);
    let grey = |even: Option<&Even>, exposure: f64, seed: u64| {
        let mut normal = Normal::new(seed);
        RgbImage::from_fn(SIZE[0], SIZE[1], |x, y| {
            let share =
                |even: &Even| even.share([x, y].map(|v| v as usize), SIZE.map(|v| v as usize));
            let light = 0.15 * exposure * even.map_or(1.0, share);
            let seen = light + NOISE.standard_deviation(light) * normal.next();
            image::Rgb([Encoding::Srgb.counts(seen).round() as u8; 3])
        })
    };
    let smaller = Resampling::new(SIZE, [200, 120], |x, y| Some([2.0 * x, 2.0 * y]));
    let turned = |x: f64, y: f64| Some([1.07 * x + 0.013 * y, 0.013 * x + 1.04 * y]);
    let turned = Resampling::new(SIZE, [360, 216], turned);
    let ways = [None, Some(smaller), Some(turned)];
    for (way, even) in ways
        .into_iter()
        .flat_map(|way| [(way.clone(), None), (way, Some(lens.clone()))])
    {
        let treatment = Treatment {
            even,
            undistortion: way.map(|way| Undistortion::new(50.0, way, Vec::new())),
            ..Treatment::default()
        };
        for (path, over) in [(&path, 0.5), (&path, 1.0), (&frames, 2.0)] {
            if path.is_dir() {
                for seed in 1..=3 {
                    let frame = grey(treatment.even.as_ref(), over, seed);
                    frame.save(path.join(format!("{seed}.png"))).unwrap();
                }
            } else {
                grey(treatment.even.as_ref(), over, 9).save(path).unwrap();
            }
            let counts = treatment.open(&view(path, over)).unwrap().counts();
            let stored =
                |of: PatchOrigin| (NOISE.a * 0.15 * of.share + NOISE.b) / (of.share * of.share);
            let patches = (0..60).map(|i| match &counts.origin {
                Some(origin) => origin.patch(i),
                None => PatchOrigin::STORED,
            });
            let told = patches.fold([0.0; 2], |[pixel, means], of| {
                [
                    pixel + of.left * stored(of) / 60.0,
                    means + stored(of) / of.pixels / 60.0,
                ]
            });
            let found = variances(&counts);
            for (told, found) in told.iter().zip(found) {
                assert!((found / told - 1.0).abs() < 0.12, "{over}: {found} {told}");
            }
        }
    }
}

/// With the sensitivity a signal's noise grows as the signal does: at twice the sensitivity and half the time it is that of half the light.
#[test]
fn a_sensitivity_tells_the_light_behind_a_signal() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("view.png");
    picture(1.0, 7).save(&path).unwrap();
    for (over, gain, share) in [(1.0, 2.0, 0.5), (4.0, 4.0, 1.0), (2.0, 1.0, 2.0)] {
        let view = View {
            path: &path,
            distance_m: None,
            exposed: Exposed { over, gain },
        };
        let counts = Treatment::default().open(&view).unwrap().counts();
        let of = counts.origin.expect("another exposure").patch(31);
        assert_eq!(
            of,
            PatchOrigin {
                share,
                ..PatchOrigin::STORED
            }
        );
    }
}
