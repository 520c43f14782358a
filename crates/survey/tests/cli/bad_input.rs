//! What cannot be used: exit code 2, a message that helps, and nothing written.

use std::fs;

use serde_json::Value;

use super::support::{Folder, Run, SCENE, shipped};

#[test]
fn scenes_are_refused_with_line_and_field() {
    let folder = Folder::new();
    for (right, wrong, words) in [
        (
            "level_pct = 25.0",
            "level_pc = 25.0",
            &["unknown field", "level_pc", "level_pct"][..],
        ),
        (
            "jerlov = \"IB\"",
            "a = [-0.2, 0.1, 0.1]\nb = [0.1, 0.1, 0.1]",
            &["water.a", "-0.2"],
        ),
        (
            "jerlov = \"IB\"",
            "a = [nan, 0.1, 0.1]\nb = [0.1, 0.1, 0.1]",
            &["water.a", "nan"],
        ),
        (
            "jerlov = \"IB\"",
            "jerlov = \"IX\"",
            &["water.jerlov", "IX", "3C"],
        ),
        (
            "jerlov = \"IB\"",
            "jerlov = \"ib\"",
            &["water.jerlov", "did you mean \"IB\"?"],
        ),
        (
            "[0.5, 0.4, 0.3]",
            "{ texture = \"none.png\", encoding = \"srgb\" }",
            &["none.png"],
        ),
        ("width = 32", "width = 0", &["camera.width", "0"]),
        (
            "forward = [1.0, 0.0, 0.0]\nup",
            "forward = [0.0, 0.0, 0.0]\nup",
            &["camera.forward"],
        ),
        ("[camera]", "[camera", &["TOML"]),
    ] {
        let text = SCENE.replacen(right, wrong, 1);
        assert_ne!(text, SCENE, "{right}");
        folder.write("scene.toml", text);
        folder.refused("render scene.toml -o out.exr --stats out.json", words);
        folder.refused("render scene.toml -o out.exr", &["scene.toml:"]);
    }
    folder.refused("render nowhere.toml -o out.exr", &["nowhere.toml"]);
}

#[test]
fn every_bad_scene_of_the_corpus_is_refused() {
    let corpus = fs::read_dir(shipped("render/tests/bad")).expect("corpus");
    let scenes = corpus.map(|entry| entry.expect("entry").path());
    let scenes: Vec<_> = scenes
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    assert!(scenes.len() > 50, "{} scenes", scenes.len());
    let folder = Folder::new();
    for scene in scenes {
        let output = folder
            .command("render -o out.png --json")
            .arg(&scene)
            .output()
            .expect("the binary starts");
        let stderr = String::from_utf8(output.stderr).expect("text");
        let name = scene.display();
        assert_eq!(output.status.code(), Some(2), "{name}: {stderr}");
        let error: Value = serde_json::from_str(&stderr).expect("one JSON object");
        assert_eq!(error["error"]["code"], "bad_input");
        let message = error["error"]["message"].as_str().unwrap_or_default();
        assert!(message.starts_with(&*name.to_string()), "{name}: {message}");
        assert!(folder.files().is_empty(), "{name}");
    }
}

#[test]
fn a_camera_inside_a_wall_is_allowed() {
    let folder = Folder::new();
    folder.write(
        "scene.toml",
        SCENE.replacen("[0.0, 0.0, 0.0]", "[1.5, 0.0, 0.0]", 1),
    );
    folder.good("render scene.toml -o out.exr --spp 1");
}

#[test]
fn arguments_of_a_render_are_checked_before_it() {
    let folder = Folder::with_scene();
    for (arguments, words) in [
        ("-o out.bmp", &["out.bmp", ".exr, .png, .tif"][..]),
        ("-o out", &[".exr, .png, .tif"]),
        (
            "-o no/such/folder/out.exr",
            &["no/such/folder", "does not exist"],
        ),
        (
            "-o out.exr --stats no/such/out.json",
            &["no/such", "does not exist"],
        ),
        ("-o out.exr --stats ./out.exr", &["--stats", "different"]),
        (
            "-o out.exr --backend gpu --adapter nosuch",
            &["graphics adapter"],
        ),
        ("-o out.exr --backend abacus", &["abacus", "cpu"]),
        (
            "-o out.png --layers depth",
            &["--layers", ".exr", "out.png"],
        ),
        (
            "-o out.exr --layers depth,lamp.middle",
            &["lamp.middle", "lamp.left", "transmittance"],
        ),
        ("-o out.exr --spp 0", &["--spp", "0"]),
        ("-o out.exr --spp many", &["--spp", "many"]),
        ("-o out.exr --spp 1.5", &["--spp", "1.5", "256 or 1e6"]),
        ("-o out.exr --spp 1e12", &["--spp", "1..=1073741824"]),
        (
            "-o out.exr --target-error 5%%",
            &["--target-error", "0.05 or 5%"],
        ),
        ("-o out.exr --width 0", &["--width", "1..=16384", "0 × 0"]),
        ("-o out.exr --height 16384", &["--height", "29127 × 16384"]),
        (
            "-o out.exr --width 16384 --height 16384",
            &["67108864 pixels in all"],
        ),
        ("-o out.exr --width wide", &["--width", "wide"]),
        ("-o out.exr --set water.jerlov", &["--set", "KEY=VALUE"]),
        (
            "-o out.exr --set water.jerlow=3C",
            &[
                "--set water.jerlow=3C",
                "`jerlow`",
                "did you mean `jerlov`?",
            ],
        ),
        (
            "-o out.exr --set water.jerlov=3c",
            &["--set water.jerlov=3c", "did you mean \"3C\"?"],
        ),
        (
            "-o out.exr --set lamp.middle.level_pct=3",
            &["--set lamp.middle.level_pct=3", "0 (left), 1 (right)"],
        ),
        ("-o out.exr --threads 0", &["--threads"]),
        ("-o out.exr --time-limit-s nan", &["--time-limit-s", "> 0"]),
        ("-o out.exr --target-error=-0.1", &["--target-error", "> 0"]),
        ("-o out.exr --seed -1", &["-1"]),
        ("-o out.exr --share-walks 0", &["--share-walks", "0"]),
        ("-o out.exr --sharper", &["--sharper"]),
        ("", &["--output"]),
    ] {
        folder.refused(&format!("render scene.toml {arguments}"), words);
    }
    fs::create_dir(folder.path("taken.exr")).expect("folder");
    folder.refused("render scene.toml -o taken.exr", &["taken.exr", "folder"]);
    let device = "/dev/null";
    folder.refused(
        &format!("phase --model isotropic --sample 1 -o {device}"),
        &[device, "device"],
    );
    folder.refused(
        &format!("render scene.toml -o out.exr --stats {device}"),
        &[device, "device"],
    );
}

/// A limit on the size of files stands for a full disk.
#[cfg(unix)]
#[test]
fn a_full_disk_is_a_failure_and_leaves_nothing() {
    use std::process::Command;
    let folder = Folder::with_scene();
    let script = "trap '' XFSZ; ulimit -f 1; exec \"$0\" render scene.toml -o out.exr --layers all";
    let mut command = Command::new("sh");
    command
        .args(["-c", script, env!("CARGO_BIN_EXE_uw")])
        .current_dir(folder.path(""));
    let run = Run::of(command.output().expect("sh runs"));
    assert_eq!(run.code, Some(1), "{}", run.stderr);
    assert!(run.stderr.contains("out.exr: "), "{}", run.stderr);
    assert_eq!(folder.files(), ["scene.toml"]);
}

#[test]
fn phase_functions_say_their_valid_ranges() {
    let folder = Folder::new();
    folder
        .write("angles.txt", "1\n")
        .write("wide.txt", "1\n181\n")
        .write("words.txt", "a\nb\n");
    let ff = "--model fournier-forand";
    for (arguments, words) in [
        (
            format!("{ff} --n 0.9 --backscatter-fraction 0.01"),
            &["n must be", "0.9"][..],
        ),
        (
            format!("{ff} --n 1.1 --backscatter-fraction 0.5"),
            &["backscatter_fraction must be", "0.5"],
        ),
        (format!("{ff} --n 1.1 --mu 5"), &["mu must be", "5"]),
        (format!("{ff} --n 1.1 --mu nan"), &["mu must be", "NaN"]),
        (format!("{ff} --n 1.1"), &["--backscatter-fraction or --mu"]),
        (
            format!("{ff} --n 1.1 --mu 3.5 --backscatter-fraction 0.01"),
            &["--mu", "cannot be used"],
        ),
        (
            format!("{ff} --n 1.1 --mu 3.5 --g 0.9"),
            &["--g", "--n, --backscatter-fraction, --mu"],
        ),
        (
            "--model henyey-greenstein --g 1".to_owned(),
            &["g must be in (-1, 1), got 1"],
        ),
        ("--model henyey-greenstein".to_owned(), &["needs --g"]),
        (
            "--model isotropic --g 0".to_owned(),
            &["--g", "no parameters"],
        ),
        (
            "--model table --file none.csv".to_owned(),
            &["none.csv", "cannot be read"],
        ),
        ("--model mie".to_owned(), &["mie", "fournier-forand"]),
    ] {
        folder.refused(
            &format!("phase {arguments} --angles-deg angles.txt -o out.csv"),
            words,
        );
    }
    for (task, words) in [
        (
            "--angles-deg wide.txt",
            &["wide.txt:2:", "[0, 180] degrees", "181"][..],
        ),
        ("--angles-deg words.txt", &["words.txt:2:", "\"b\""]),
        ("--angles-deg none.txt", &["none.txt", "cannot be read"]),
        ("--inverse-cdf wide.txt", &["wide.txt:2:", "[0, 1]", "181"]),
        ("--sample -5", &["-5"]),
        ("--sample 5 --angles-deg angles.txt", &["cannot be used"]),
        ("", &["--angles-deg"]),
    ] {
        folder.refused(&format!("phase --model isotropic {task} -o out.csv"), words);
    }
}

#[test]
fn unknown_waters_and_bands_are_answered_with_the_known_ones() {
    let folder = Folder::new();
    for (arguments, words) in [
        ("--jerlov 4C", &["4C", "I IA IB II III 1C 3C 5C 7C 9C"][..]),
        ("--jerlov 3c", &["\"3c\"", "did you mean \"3C\"?"]),
        ("--jerlov 3C --bands eye", &["eye", "camera:imx219"]),
        (
            "--jerlov 3C --bands 600-800,500-600,400-500",
            &["600-800", "700"],
        ),
        (
            "--jerlov 9C --bands measured",
            &["measured", "9C", "IB II III"],
        ),
        ("--list --bands mean", &["--bands", "cannot be used"]),
        ("", &["--jerlov", "--list"]),
    ] {
        folder.refused(&format!("water {arguments}"), words);
    }
}

#[test]
fn pictures_and_manifests_are_refused_by_name() {
    let folder = Folder::with_scene();
    folder
        .write("text.png", "not a picture")
        .write("text.exr", "not a picture");
    folder.refused("stats none.png", &["none.png", "cannot be read"]);
    folder.refused("stats text.png", &["text.png"]);
    folder.refused("stats", &["IMAGE"]);
    folder.refused("sensor none.exr scene.toml -o out.png", &["none.exr"]);
    folder.refused("sensor text.exr scene.toml -o out.png", &["text.exr"]);
    folder.refused(
        "sensor text.exr scene.toml -o out.exr",
        &["out.exr", ".png, .tif or .jpg"],
    );
    folder.refused("sensor text.exr none.toml -o out.png", &["none.toml"]);
    folder.refused("calibrate none.csv -o out.json", &["none.csv"]);
    let header = "file,kind,depth_m,distance_m,light_pct\n";
    let rest = "text.png,contrast,,1,0\ntext.png,contrast,,1,67\n";
    folder.write(
        "manifest.csv",
        format!("{header}none.png,depth,1,,0\n{rest}"),
    );
    folder.refused(
        "calibrate manifest.csv -o out.json",
        &["manifest.csv:2:", "none.png"],
    );
    folder.write(
        "manifest.csv",
        format!("{header}text.png,depth,1,,0\n{rest}"),
    );
    folder.refused(
        "calibrate manifest.csv -o out.json",
        &["manifest.csv:2:", "text.png"],
    );
    folder.write("manifest.csv", format!("{header}text.png,sideways,1,,0\n"));
    folder.refused(
        "calibrate manifest.csv -o out.json",
        &["manifest.csv:2:", "sideways"],
    );
}

#[test]
fn errors_can_be_json_objects() {
    let folder = Folder::new();
    for line in [
        "--json stats none.png",
        "stats --json none.png",
        "render --json",
        "--json conjure",
    ] {
        let run = folder.uw(line);
        assert_eq!((run.code, run.stdout.as_str()), (Some(2), ""), "{line}");
        let error: Value = serde_json::from_str(&run.stderr).expect("one JSON object");
        assert_eq!(error["error"]["code"], "bad_input", "{line}");
        assert!(
            error["error"]["message"]
                .as_str()
                .is_some_and(|message| message.len() > 10),
            "{error}"
        );
    }
}

#[test]
fn help_and_version_are_no_errors() {
    let folder = Folder::new();
    assert!(folder.good("--help").stdout.contains("render"));
    assert!(
        folder
            .good("render --help")
            .stdout
            .contains("--time-limit-s")
    );
    assert_eq!(
        folder.good("--version").stdout,
        format!("uw {}\n", env!("CARGO_PKG_VERSION"))
    );
}

#[test]
fn datasets_that_cannot_be_are_refused_with_what_would_be_right() {
    let folder = Folder::new();
    let config = |text: &str| format!("format = \"uw-dataset/1\"\n{text}\n");
    for (text, words) in [
        ("distance_m = [1.0]", &["unknown field", "distance_m"][..]),
        ("textures = [\"lawn\"]", &["lawn", "hull_red"]),
        ("water_types = [\"IB-II@2\"]", &["water_types", "[0, 1]"]),
        ("light_pct = [0.0, 50.0]", &["calibration_light_pct", "67"]),
        ("exposure = \"automatic\"", &["automatic", "auto"]),
        ("depths_m = [1.0, 3.0, 3.0]", &["depths_m", "3 twice"]),
    ] {
        folder.write("dataset.toml", config(text));
        folder.refused("dataset dataset.toml -o out", words);
    }
    // A hull that ends at the surface does not fill a view from 1 m below it and 6 m away.
    folder.write(
        "dataset.toml",
        config("distances_m = [6.0]\ntextures = [\"hull_red\"]"),
    );
    folder.refused(
        "dataset dataset.toml -o out",
        &["sees past it", "distances_m 6"],
    );
    folder.write("dataset.toml", config(""));
    folder.refused(
        "dataset dataset.toml -o new --shard 3/2",
        &["1 <= i <= n", "3/2"],
    );
    folder.refused("dataset --grid narrow -o new", &["narrow", "paper", "wide"]);
    folder.refused(
        "dataset dataset.toml -o new --resume",
        &["nothing to resume"],
    );
    folder.refused("dataset dataset.toml -o new --merge missing", &["missing"]);
}

#[test]
fn other_files_in_the_place_of_a_scene_are_called_what_they_are() {
    let folder = Folder::with_scene();
    folder.good("render scene.toml -o picture.png --spp 1");
    folder.good("render scene.toml -o picture.exr --spp 1");
    folder
        .write("profile.json", "{\"format\": \"uw-profile/1\"}")
        .write("noise.bin", b"\x01\x02\0\x80");
    for (scene, words) in [
        (
            "picture.png",
            &[
                "picture.png: is a PNG picture, not a scene file",
                "uw-scene/1",
            ][..],
        ),
        (
            "picture.exr",
            &["picture.exr: is an OpenEXR picture, not a scene file"],
        ),
        (
            "profile.json",
            &["profile.json: is a calibration profile, not a scene file"],
        ),
        (
            "noise.bin",
            &["noise.bin: is a binary file, not a scene file"],
        ),
    ] {
        folder.refused(&format!("render {scene} -o out.exr"), words);
    }
    let model = shipped("../assets/models/default.json");
    folder.refused(
        &format!("render {} -o out.exr", model.display()),
        &["default.json: is a model file, not a scene file"],
    );
    let hull = shipped("../assets/scenes/ship_hull.glb");
    folder.refused(
        &format!("render {} -o out.exr", hull.display()),
        &["is a glTF file", "gltf = \"FILE\""],
    );
}
