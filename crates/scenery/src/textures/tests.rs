use super::*;
use crate::colour::REFLECTANCE_RANGE;
use uw_calib::{PatchGrid, patch_statistics};

const SEED: u32 = 1;

fn tile(pattern: Pattern) -> Tile {
    Tile {
        size_m: pattern.tile_m(),
        seed: SEED,
    }
}

#[test]
fn names_lead_back_to_their_patterns() {
    for pattern in Pattern::ALL {
        assert_eq!(Pattern::from_name(pattern.name()), Some(pattern));
    }
    assert_eq!(Pattern::from_name("hull_blue"), None);
}

#[test]
fn the_same_seed_draws_the_same_picture_and_another_seed_another() {
    for pattern in Pattern::ALL {
        let picture = pattern.draw(&tile(pattern), 48);
        // One thread instead of many.
        let alone = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .unwrap();
        assert_eq!(
            picture,
            alone.install(|| pattern.draw(&tile(pattern), 48)),
            "{}",
            pattern.name()
        );
        let other = pattern.draw(
            &Tile {
                seed: SEED + 1,
                ..tile(pattern)
            },
            48,
        );
        let changed = picture
            .texels
            .iter()
            .zip(&other.texels)
            .filter(|(a, b)| a != b)
            .count();
        assert!(
            changed > picture.texels.len() / 2,
            "{}: {changed} texels changed",
            pattern.name()
        );
    }
}

#[test]
fn reflectances_are_plausible_and_use_their_range() {
    for pattern in Pattern::ALL {
        let texels = pattern.draw(&tile(pattern), 96).texels;
        let values: Vec<f32> = texels.iter().flatten().copied().collect();
        let [low, high] = REFLECTANCE_RANGE;
        assert!(
            values
                .iter()
                .all(|v| (low - 1e-6..=high + 1e-6).contains(v)),
            "{}",
            pattern.name()
        );
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        assert!(
            (0.04..0.45).contains(&mean),
            "{}: mean reflectance {mean}",
            pattern.name()
        );
    }
}

/// Mean absolute difference between horizontal and vertical neighbours `step` texels apart.
fn difference(pattern: Pattern, width: u32, points: impl Iterator<Item = (u32, bool)>) -> f32 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (line, vertical) in points {
        for along in 0..width {
            let at = |across: u32| {
                let across = across % width;
                let (column, row) = if vertical {
                    (across, along)
                } else {
                    (along, across)
                };
                pattern.texel(&tile(pattern), width, column, row)
            };
            let (here, next) = (at(line), at(line + 1));
            sum += (0..3).map(|k| (here[k] - next[k]).abs()).sum::<f32>();
            count += 3.0;
        }
    }
    sum / count
}

#[test]
fn tiles_repeat_without_a_seam() {
    const WIDTH: u32 = 900;
    for pattern in Pattern::ALL {
        for vertical in [true, false] {
            let across_edge = difference(pattern, WIDTH, [(WIDTH - 1, vertical)].into_iter());
            // Some lines of a pattern are features (board joints, foam edges): compare with the
            // roughest of a sample of lines, not only with their mean.
            let lines: Vec<f32> = (1..=12)
                .map(|i| difference(pattern, WIDTH, [(i * 73, vertical)].into_iter()))
                .collect();
            let mean = lines.iter().sum::<f32>() / lines.len() as f32;
            let roughest = lines.iter().copied().fold(0.0, f32::max);
            assert!(
                across_edge < 1.3 * roughest
                    && across_edge < 2.0 * mean
                    && across_edge > 0.3 * mean,
                "{}: {across_edge} across the edge, {mean} (up to {roughest}) inside",
                pattern.name()
            );
        }
    }
}

/// What a camera with a field of view of 60° would see of a pattern at a distance without water: 16:9,
/// exposed to a mean linear signal of 0.4, sRGB, statistics in 8-bit counts.
fn seen(pattern: Pattern, distance_m: f32, corner_m: TilePoint) -> PatchGrid {
    const WIDTH: usize = 160;
    const HEIGHT: usize = 90;
    const TWO_TAN_30_DEG: f32 = 1.154_700_5;
    let pixel_m = distance_m * TWO_TAN_30_DEG / WIDTH as f32;
    let tile = tile(pattern);
    // Each pixel is the mean of places about 3 mm apart.
    let points = (pixel_m / 0.003).round().max(1.0) as usize;
    let pixel = |i: usize| {
        let mut sum = [0.0; 3];
        for point in 0..points * points {
            let shift = [point % points, point / points].map(|k| (k as f32 + 0.5) / points as f32);
            let at = [
                corner_m[0] + ((i % WIDTH) as f32 + shift[0]) * pixel_m,
                corner_m[1] + ((i / WIDTH) as f32 + shift[1]) * pixel_m,
            ];
            let reflectance = pattern.reflectance_at(&tile, at);
            (0..3).for_each(|k| sum[k] += reflectance[k] / (points * points) as f32);
        }
        sum
    };
    let linear: Vec<Reflectance> = (0..WIDTH * HEIGHT).into_par_iter().map(pixel).collect();
    let mean = linear.iter().flatten().sum::<f32>() / (3 * linear.len()) as f32;
    let counts = |i: usize| linear[i].map(|v| f64::from(srgb_code(0.4 * v / mean)));
    patch_statistics(WIDTH, HEIGHT, counts).unwrap()
}

#[test]
fn the_hull_shows_little_contrast_and_the_seabed_much() {
    for (distance_m, corner_m) in [
        (0.5, [3.1, 2.2]),
        (0.5, [4.2, 4.6]),
        (1.0, [0.4, 0.3]),
        (3.0, [1.1, 1.7]),
    ] {
        let contrast = |pattern| seen(pattern, distance_m, corner_m).stats.contrast;
        let (hull, seabed) = (contrast(Pattern::HullRed), contrast(Pattern::Seabed));
        for k in 0..3 {
            assert!(
                seabed[k] > 2.0 * hull[k],
                "channel {k}, {distance_m} m: hull {hull:?}, seabed {seabed:?}"
            );
            // Flat paint would show nothing but quantisation, 0.29 counts.
            assert!(hull[k] > 2.0, "channel {k}, {distance_m} m: hull {hull:?}");
        }
    }
}

#[test]
fn no_part_of_a_close_view_is_featureless() {
    for pattern in Pattern::ALL {
        for patch in seen(pattern, 0.5, [2.0, 1.3]).patches {
            let best = patch.std.iter().copied().fold(0.0, f64::max);
            assert!(
                best > 1.0,
                "{}: a patch with a contrast of {best} counts",
                pattern.name()
            );
        }
    }
}
