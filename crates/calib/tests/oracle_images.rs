//! Statistics of two pictures against values computed independently (see `data/README.md`).

use std::path::{Path, PathBuf};

use uw_calib::{
    CorrectedSample, NoiseSource, PatchGrid, Profile, RoutineOptions, calibrate_manifest,
    from_manifest,
};

/// The tables print 10 significant digits of values below 256, so 1e-6 leaves room for nothing but rounding.
const TOLERANCE_COUNTS: f64 = 1e-6;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name)
}

fn assert_close(got: [f64; 3], want: &[f64], what: &str) {
    assert_eq!(want.len(), 3, "{what}");
    for k in 0..3 {
        assert!(
            (got[k] - want[k]).abs() < TOLERANCE_COUNTS,
            "{what}: got {got:?}, want {want:?}"
        );
    }
}

fn tabulated(image: &str, field: &str) -> Vec<f64> {
    let text = std::fs::read(data("image_stats.json")).unwrap();
    let table: serde_json::Value = serde_json::from_slice(&text).unwrap();
    table["images"][image][field]
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_f64().unwrap())
        .collect()
}

#[test]
fn image_statistics_equal_the_tabulated_ones() {
    for image in ["s2_turbid", "s3_lamp"] {
        let grid = PatchGrid::from_file(&data(&format!("{image}.png"))).unwrap();
        assert_eq!((grid.width, grid.height), (1280, 720));
        assert_close(grid.stats.mean, &tabulated(image, "mean_rgb"), image);
        assert_close(
            grid.stats.contrast,
            &tabulated(image, "patch_std_mean_rgb"),
            image,
        );
    }
}

#[test]
fn every_patch_equals_the_tabulated_one() {
    for image in ["s2_turbid", "s3_lamp"] {
        let grid = PatchGrid::from_file(&data(&format!("{image}.png"))).unwrap();
        let mut table = csv::Reader::from_path(data(&format!("{image}_patches.csv"))).unwrap();
        let mut compared = 0;
        for record in table.deserialize::<(usize, usize, [f64; 3], [f64; 3])>() {
            let (row, column, mean, std) = record.unwrap();
            let patch = grid.patches[row * 10 + column];
            assert_close(
                patch.mean,
                &mean,
                &format!("{image} row {row} column {column}"),
            );
            assert_close(
                patch.std,
                &std,
                &format!("{image} row {row} column {column}"),
            );
            compared += 1;
        }
        assert_eq!(compared, 60);
    }
}

#[test]
fn the_same_bytes_in_memory_give_the_same_numbers() {
    let bytes = std::fs::read(data("s2_turbid.png")).unwrap();
    let in_memory = PatchGrid::from_encoded(&bytes, "s2").unwrap();
    assert_eq!(
        in_memory,
        PatchGrid::from_file(&data("s2_turbid.png")).unwrap()
    );
}

#[test]
fn grey_alpha_and_sixteen_bits_are_read_as_defined() {
    let dir = tempfile::tempdir().unwrap();
    let level = |x: u32, y: u32| ((x * 7 + y * 13) % 256) as u8;
    let grey = image::GrayImage::from_fn(40, 24, |x, y| image::Luma([level(x, y)]));
    let rgba = image::RgbaImage::from_fn(40, 24, |x, y| {
        let v = level(x, y);
        image::Rgba([v, v, v, (x * 6) as u8])
    });
    let deep = image::ImageBuffer::<image::Rgb<u16>, Vec<u16>>::from_fn(40, 24, |x, y| {
        image::Rgb([u16::from(level(x, y)) * 257; 3])
    });
    grey.save(dir.path().join("grey.png")).unwrap();
    rgba.save(dir.path().join("rgba.png")).unwrap();
    deep.save(dir.path().join("deep.tif")).unwrap();
    let want = PatchGrid::from_file(&dir.path().join("grey.png"))
        .unwrap()
        .stats;
    assert!(want.contrast[0] > 10.0 && want.contrast[0] == want.contrast[2]);
    for name in ["rgba.png", "deep.tif"] {
        let got = PatchGrid::from_file(&dir.path().join(name)).unwrap().stats;
        assert_close(got.contrast, &want.contrast, name);
        assert_close(got.mean, &want.mean, name);
    }
}

#[test]
fn a_manifest_of_images_becomes_a_profile() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["s2_turbid.png", "s3_lamp.png"] {
        std::fs::copy(data(name), dir.path().join(name)).unwrap();
    }
    let manifest = dir.path().join("routine.csv");
    std::fs::write(
        &manifest,
        "file,kind,depth_m,distance_m,light_pct\n\
         s3_lamp.png,depth,4.0,,0\n\
         s2_turbid.png,depth,0.5,,0\n\
         s2_turbid.png,contrast,3.0,1.0,0\n\
         s3_lamp.png,contrast,3.0,1.0,100\n",
    )
    .unwrap();
    let profile: Profile = calibrate_manifest(&manifest, "test 1").unwrap();
    let (deep, shallow) = (
        tabulated("s3_lamp", "mean_rgb"),
        tabulated("s2_turbid", "mean_rgb"),
    );
    let ratio: Vec<f64> = (0..3).map(|k| deep[k] / shallow[k]).collect();
    assert_close(profile.k_z(4.0).unwrap(), &ratio, "k_z");
    assert_close(
        profile.k_c_on(1.0).unwrap(),
        &tabulated("s3_lamp", "patch_std_mean_rgb"),
        "on",
    );
    assert_close(
        profile.k_c_off(1.0).unwrap(),
        &tabulated("s2_turbid", "patch_std_mean_rgb"),
        "off",
    );
    assert_eq!(profile.source().images, 4);
    // The profile says for which size of pictures it holds, and its file too.
    assert_eq!(profile.rig().size_px(), Some([1280.0, 720.0]));
    let path = dir.path().join("profile.json");
    profile.write(&path).unwrap();
    assert_eq!(Profile::read(&path).unwrap(), profile);
    // All pictures of the target are from one depth, which those that look up do not change.
    assert_eq!(profile.contrast_depth_m(), Some([3.0, 3.0]));
    // One distance is enough for the lamps only.
    let warnings = profile.warnings();
    assert!(
        warnings.len() == 1 && warnings[0].contains("one distance only (1 m)"),
        "{warnings:?}"
    );
}

#[test]
fn depths_of_the_target_that_are_mixed_or_not_given_are_told() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["s2_turbid.png", "s3_lamp.png"] {
        std::fs::copy(data(name), dir.path().join(name)).unwrap();
    }
    let made = |off: &str, on: &str| {
        let manifest = dir.path().join("routine.csv");
        let rows = format!(
            "file,kind,depth_m,distance_m,light_pct\ns2_turbid.png,depth,0.5,,0\ns2_turbid.png,depth,5,,0\n\
             s2_turbid.png,contrast,{off},1.0,0\ns3_lamp.png,contrast,{on},1.0,100\n"
        );
        std::fs::write(&manifest, rows).unwrap();
        from_manifest(&manifest, "test 1", &RoutineOptions::default()).unwrap()
    };
    let told = |off, on| {
        let made = made(off, on);
        let of_depth = made.warnings.into_iter().filter(|w| w.contains("depth"));
        (
            made.profile.contrast_depth_m(),
            of_depth.collect::<Vec<_>>().join(" "),
        )
    };
    assert_eq!(told("3.0", "3.4"), (Some([3.0, 3.4]), String::new()));
    let (depths, warning) = told("1", "4");
    assert_eq!(depths, Some([1.0, 4.0]));
    assert!(
        warning.contains("from depths of 1 to 4 m: K_c mixes"),
        "{warning}"
    );
    let (depths, warning) = told("3.0", "");
    assert_eq!(depths, None);
    assert!(warning.contains("is not given for all"), "{warning}");
}

/// Texture, noise alone and a lamp's glare, as a routine has them.
#[test]
fn contrasts_without_noise_come_with_the_profile_and_pictures_without_detail_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let mut state = 1_u64;
    let mut noise = || {
        // The sum of four uniform numbers (xorshift64, Marsaglia 2003): a variance of 12 counts.
        let mut sum = 0.0;
        for _ in 0..4 {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            sum += (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
        }
        6.0 * sum
    };
    let mut write = |name: &str, light: &dyn Fn(f64, f64) -> f64| {
        let picture = image::GrayImage::from_fn(240, 144, |x, y| {
            let counts = light(f64::from(x), f64::from(y)) + noise();
            image::Luma([counts.round().clamp(0.0, 255.0) as u8])
        });
        picture.save(dir.path().join(name)).unwrap();
    };
    let detail = |x: f64, y: f64| 8.0 * (0.4 * x).sin() * (0.5 * y).cos();
    write("up.png", &|_, _| 120.0);
    write("near.png", &|x, y| 90.0 + detail(x, y));
    write("far.png", &|_, _| 0.0);
    write("glare.png", &|x, y| {
        if x < 12.0 { 400.0 } else { 90.0 + detail(x, y) }
    });
    let manifest = dir.path().join("routine.csv");
    std::fs::write(
        &manifest,
        "file,kind,depth_m,distance_m,light_pct\nup.png,depth,0.5,,0\nnear.png,contrast,3,1,0\nfar.png,contrast,3,2,0\n\
         near.png,contrast,3,1,50\nglare.png,contrast,3,0.5,50\n",
    )
    .unwrap();
    let made = from_manifest(&manifest, "test 1", &RoutineOptions::default()).unwrap();
    let corrected = made.profile.corrected().unwrap();
    assert_eq!(corrected.source, NoiseSource::Picture);
    let places = |samples: &[CorrectedSample]| -> Vec<f64> {
        samples.iter().map(|sample| sample.distance_m).collect()
    };
    assert_eq!(places(&corrected.off), [1.0, 2.0]);
    assert_eq!(places(&corrected.on), [0.5, 1.0]);
    // The published contrast has the noise of sqrt(12 + 1/12) counts in it, the other is that of 8 sin cos: 4.
    let [near, far] = [corrected.off[0], corrected.off[1]];
    assert!((made.profile.k_c_off(1.0).unwrap()[0] - 5.3).abs() < 0.2);
    assert!((near.k_c[0] - 4.0).abs() < 0.2, "{near:?}");
    assert!(made.profile.k_c_off(2.0).unwrap()[0] > 1.5);
    assert!(far.k_c[0] <= far.floor[0] && far.floor[0] < 1.5, "{far:?}");
    let told = made.warnings.join("\n");
    assert!(
        told.contains("at the noise floor") && told.contains("far.png (line 4; R, G, B)"),
        "{told}"
    );
    assert!(
        told.contains("full scale") && told.contains("glare.png (line 6; R, G, B)"),
        "{told}"
    );
    assert!(
        !told.contains("near.png") && !told.contains("up.png"),
        "{told}"
    );
}

#[test]
fn contrast_images_of_different_sizes_make_no_profile() {
    let dir = tempfile::tempdir().unwrap();
    for (name, width) in [("wide.png", 60), ("narrow.png", 40)] {
        let picture = image::GrayImage::from_fn(width, 24, |x, y| image::Luma([(x * y) as u8]));
        picture.save(dir.path().join(name)).unwrap();
    }
    let manifest = dir.path().join("routine.csv");
    // The size of those that look up does not matter: only their mean counts.
    let rows = |second: &str| {
        format!(
            "file,kind,depth_m,distance_m,light_pct\nnarrow.png,depth,0.5,,0\n\
             wide.png,contrast,3.0,1.0,0\n{second},contrast,3.0,1.0,100\n"
        )
    };
    std::fs::write(&manifest, rows("wide.png")).unwrap();
    let profile = calibrate_manifest(&manifest, "test 1").unwrap();
    assert_eq!(profile.rig().size_px(), Some([60.0, 24.0]));
    std::fs::write(&manifest, rows("narrow.png")).unwrap();
    let error = calibrate_manifest(&manifest, "test 1").unwrap_err();
    let message = error.to_string();
    assert!(
        message.contains("routine.csv:4") && message.contains("60 x 24 and 40 x 24 pixels"),
        "{message}"
    );
}

#[test]
fn files_that_are_no_images_are_refused_with_their_name() {
    let dir = tempfile::tempdir().unwrap();
    let text = dir.path().join("text.png");
    std::fs::write(&text, "no picture").unwrap();
    let truncated = dir.path().join("cut.png");
    let bytes = std::fs::read(data("s2_turbid.png")).unwrap();
    std::fs::write(&truncated, &bytes[..bytes.len() / 2]).unwrap();
    for path in [text, truncated, dir.path().join("gone.png")] {
        let message = PatchGrid::from_file(&path).unwrap_err().to_string();
        assert!(message.contains(&path.display().to_string()), "{message}");
    }
}
