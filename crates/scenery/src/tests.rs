use super::colour::srgb_code;
use super::noise::{hash, unit};
use super::*;

fn assets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets")
}

#[test]
fn small_scenery_is_written_whole_and_the_same_twice() {
    let options = Options {
        main_texture_px: 32,
        texture_px: 16,
        ..Options::default()
    };
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let [first, second] = folders
        .each_ref()
        .map(|folder| write_all(folder.path(), &options).unwrap());
    let textures = Pattern::ALL.len() + Pattern::OF_SITES.len();
    assert_eq!(first.len(), textures + 2 + sites::all(1).len() + 1);
    for (one, other) in first.iter().zip(&second) {
        assert!(
            fs::read(one).unwrap() == fs::read(other).unwrap(),
            "{}",
            one.display()
        );
    }
    for folder in ["textures", "scenes", "benchmarks"] {
        let listed = fs::read_dir(folders[0].path().join(folder))
            .unwrap()
            .count();
        assert_eq!(
            listed,
            first
                .iter()
                .filter(|path| path.parent().unwrap().ends_with(folder))
                .count()
        );
    }
}

#[test]
fn unusable_options_and_folders_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refusal = |options| write_all(folder.path(), &options).unwrap_err().to_string();
    let small = Options {
        texture_px: 8,
        ..Options::default()
    };
    assert_eq!(
        refusal(small),
        "texture_px must be between 16 and 16384, got 8"
    );
    let poor = Options {
        jpeg_quality: 0,
        ..Options::default()
    };
    assert_eq!(
        refusal(poor),
        "jpeg_quality must be between 1 and 100, got 0"
    );
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);

    let file = folder.path().join("file");
    fs::write(&file, "not a folder").unwrap();
    let tiny = Options {
        main_texture_px: 16,
        texture_px: 16,
        ..Options::default()
    };
    assert!(matches!(
        write_all(&file, &tiny),
        Err(SceneryError::Folder { .. })
    ));
}

#[test]
fn shipped_textures_are_what_the_generator_draws() {
    let options = Options::default();
    for pattern in Pattern::ALL.into_iter().chain(Pattern::OF_SITES) {
        let path = assets()
            .join("textures")
            .join(format!("{}.png", pattern.name()));
        let shipped = image::open(&path).unwrap().to_rgb8();
        let main = matches!(pattern, Pattern::HullRed | Pattern::Seabed);
        let width = if main {
            options.main_texture_px
        } else {
            options.texture_px
        };
        assert_eq!(shipped.dimensions(), (width, width), "{}", path.display());
        let tile = Tile {
            size_m: pattern.tile_m(),
            seed: options.seed,
        };
        for i in 0..2000 {
            let [column, row] = [1, 2].map(|k| (unit(hash(i, 0, 77), k) * width as f32) as u32);
            let drawn = pattern.texel(&tile, width, column, row).map(srgb_code);
            assert_eq!(
                shipped.get_pixel(column, row).0,
                drawn,
                "{} at {column}, {row}",
                pattern.name()
            );
        }
    }
}

#[test]
fn shipped_models_are_what_the_generator_builds() {
    let seed = Options::default().seed;
    // The geometry stands before the texture, so files with different textures agree up to there.
    let geometry = |bytes: &[u8]| {
        let file = gltf::Gltf::from_slice(bytes).unwrap();
        let gltf::image::Source::View { view, .. } = file.images().next().unwrap().source() else {
            panic!("the texture is not embedded")
        };
        file.blob.as_ref().unwrap()[..view.offset()].to_vec()
    };
    for model in [models::ship_hull(seed), models::seabed(seed)] {
        let path = assets().join("scenes").join(format!("{}.glb", model.name));
        let texture = model.pattern.draw(&model.tile, 16);
        let built = gltf_writer::glb_bytes(&model, &texture, 92).unwrap();
        assert!(
            geometry(&fs::read(&path).unwrap()) == geometry(&built),
            "{} differs from the generator's model",
            path.display()
        );
    }
}

#[test]
fn shipped_sites_are_what_the_generator_builds() {
    for site in sites::all(Options::default().seed) {
        let path = assets().join("scenes").join(format!("{}.glb", site.name));
        let built = gltf_writer::site_glb_bytes(&site).unwrap();
        assert!(fs::read(&path).unwrap() == built, "{}", path.display());
    }
}

/// Every site has relief: a grid of rays from its scene's camera meets it at ranges that differ by more than a metre, with the
/// water between growing more than twofold.
#[test]
fn sites_have_range() {
    for site in sites::all(Options::default().seed) {
        let path = assets().join("scenes").join(format!("{}.toml", site.name));
        let scene = uw_render::scene::Scene::read(&path).unwrap();
        let geometry = uw_render::prepare::Geometry::build(&scene);
        let camera = &scene.camera;
        let (width, height) = (f64::from(camera.width), f64::from(camera.height));
        let mut ranges: Vec<f64> = (1..12)
            .flat_map(|i| (1..8).map(move |j| [f64::from(i) / 12.0, f64::from(j) / 8.0]))
            .filter_map(|[u, v]| {
                let ray = camera.ray(u * width, v * height);
                let none = uw_render::prepare::Primitive::None;
                geometry.closest(ray.origin_m, ray.direction, 30.0, none)
            })
            .map(|hit| hit.t)
            .collect();
        ranges.sort_by(f64::total_cmp);
        let (near, far) = (ranges[ranges.len() / 10], ranges[ranges.len() * 9 / 10]);
        assert!(ranges.len() > 30, "{}: {}", site.name, ranges.len());
        assert!(
            far > 2.0 * near && far > near + 1.0,
            "{}: {near} {far}",
            site.name
        );
    }
}

#[test]
fn the_shipped_plate_is_what_the_generator_builds() {
    let path = assets().join(BUMPY_PLATE);
    let built = bumpy_plate_bytes(Options::default().seed).unwrap();
    assert!(fs::read(&path).unwrap() == built, "{}", path.display());
}

/// Rays at the plate meet it wherever they go, seams between tiles included, and near the plane that it stands for.
#[test]
fn the_bumpy_plate_has_no_gaps_and_the_flat_ones_picture() {
    use glam::DVec3;
    use uw_render::prepare::{Geometry, Primitive};
    let path = assets().join("benchmarks/s1_mesh.toml");
    let scene = uw_render::scene::Scene::read(&path).unwrap();
    let triangles: usize = scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
    assert_eq!((triangles, scene.quads.len()), (100_352, 0));
    // Its picture is that of the flat plate, to the rounding of an 8-bit sRGB code (0.45 % of full scale at most).
    let flat = uw_render::scene::Scene::read(&path.with_file_name("s1_clear.toml")).unwrap();
    let [bumpy, flat] = [&scene, &flat].map(|scene| &scene.textures[0]);
    assert_eq!(
        (bumpy.width, bumpy.height, bumpy.filter),
        (flat.width, flat.height, flat.filter)
    );
    let texels = bumpy
        .texels
        .iter()
        .flatten()
        .zip(flat.texels.iter().flatten());
    let largest = texels.map(|(b, f)| (b - f).abs()).fold(0.0, f32::max);
    assert!(largest < 4.5e-3, "{largest}");
    let geometry = Geometry::build(&scene);
    let (mut nearest, mut farthest) = (f64::INFINITY, 0.0_f64);
    for (i, j) in (1..80).flat_map(|i| (1..80).map(move |j| (i, j))) {
        // Every twentieth line lies on a seam.
        let [y, z] = [i, j].map(|i| f64::from(i - 40) / 10.0);
        let hit = geometry.closest(DVec3::new(0.0, y, z), DVec3::X, 3.0, Primitive::None);
        let range_m = hit.unwrap_or_else(|| panic!("nothing at y {y}, z {z}")).t;
        (nearest, farthest) = (nearest.min(range_m), farthest.max(range_m));
    }
    assert!(
        nearest > 1.97 && nearest < 1.99 && farthest > 2.01 && farthest < 2.03,
        "{nearest} {farthest}"
    );
}

#[test]
fn shipped_scenes_find_their_files() {
    let scenes = assets().join("scenes");
    let mut found = 0;
    for entry in fs::read_dir(&scenes).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        found += 1;
        let scene: toml::Table = fs::read_to_string(&path).unwrap().parse().unwrap();
        for object in scene["object"].as_array().unwrap() {
            let file = object
                .get("gltf")
                .unwrap_or_else(|| &object["reflectance"]["texture"]);
            let file = scenes.join(file.as_str().unwrap());
            assert!(
                file.is_file(),
                "{} names {}",
                path.display(),
                file.display()
            );
        }
    }
    assert_eq!(found, 15);
}
