//! The pictures that `--keep-images` writes.

use uw_calib::ImageStats;
use uw_render::image::{ExrImage, LayerData};
use uw_survey::dataset::{RunOptions, Shard, merge};

use super::{assert_same, options, run, tiny};

/// The values of a layer in colour.
fn colour<'a>(image: &'a ExrImage, layer: &str) -> &'a [[f32; 3]] {
    match image.layer(layer) {
        Some(LayerData::Colour(values)) => values,
        other => panic!("{layer} is {other:?}"),
    }
}

#[test]
fn kept_images_are_those_of_the_labels_and_travel_with_their_part() {
    let folder = tempfile::tempdir().expect("folder");
    let (whole, merged) = (folder.path().join("whole"), folder.path().join("merged"));
    let keep = |shard| RunOptions {
        keep_images: true,
        ..options(2, shard)
    };
    let mut config = tiny();
    // So many that what noise of the paths adds to a picture's contrast is less than what the label allows.
    config.accuracy.least_paths = 32_768;
    config.accuracy.most_paths = 32_768;
    run(&config, &whole, &keep(Shard::WHOLE));
    let parts = [1, 2].map(|index| folder.path().join(format!("part-{index}")));
    for (index, part) in (1..).zip(&parts) {
        run(&config, part, &keep(Shard { index, count: 2 }));
    }
    merge(&config, &merged, &parts, &|_| {}).expect("parts of one dataset");
    run(&config, &merged, &options(1, Shard::WHOLE));
    assert_same(&whole, &merged);

    let group = whole.join("images/II_B0.0183/hull_red_tilt0_d2");
    let statistics = std::fs::read_to_string(group.with_extension("csv")).expect("statistics");
    assert_eq!(statistics.lines().count(), 4);
    for line in statistics.lines() {
        let row: Vec<f64> = line.split(',').map(|v| v.parse().expect(line)).collect();
        let picture = group.join(format!("z{}_light{}.png", row[0], row[1]));
        let stats = ImageStats::from_file(&picture).expect("a picture");
        for k in 0..3 {
            let (mean, mean_error) = (row[3 + k], row[9 + k]);
            let mean_off = (stats.mean[k] - mean).abs();
            assert!(mean_off < 0.3 + 3.0 * mean_error, "{line} {stats:?}");
            // The label takes the noise of the paths out, which the picture shows.
            let (contrast, contrast_error) = (row[6 + k], row[12 + k]);
            let contrast_off = (stats.contrast[k] - contrast).abs();
            assert!(
                contrast_off < 0.1 * contrast + 3.0 * contrast_error,
                "{line} {stats:?}"
            );
        }
    }

    let image = ExrImage::read(&group.join("z3.exr")).expect("an image");
    let (ambient, lamps) = (colour(&image, "ambient"), colour(&image, "lamps"));
    let veils = ["ambient.backscatter", "lamps.backscatter"].map(|name| colour(&image, name));
    let mean = |values: &[[f32; 3]], k: usize| values.iter().map(|v| v[k]).sum::<f32>();
    for k in 0..3 {
        for (all, veil) in [ambient, lamps].into_iter().zip(veils) {
            let share = mean(veil, k) / mean(all, k);
            assert!((0.01..0.9).contains(&share), "{k} {share}");
        }
        for (i, sum) in image.picture.data.iter().enumerate() {
            let parts = ambient[i][k] + lamps[i][k];
            assert!((sum[k] - parts).abs() <= 1e-6 * parts.abs(), "{i} {k}");
        }
    }
    match image.layer("depth") {
        Some(LayerData::Scalar(depths)) => {
            assert!(depths.iter().all(|d| (d - 2.0).abs() < 1e-5), "{depths:?}");
        }
        other => panic!("depth is {other:?}"),
    }
}
