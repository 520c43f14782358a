//! The program without the folder of assets, and with one that is wrong.

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use crate::support::{Folder, Run, shipped};

#[path = "../../../assets/tests/alone/mod.rs"]
mod standalone;

/// A small render on the processor; `{scene}` is what is rendered.
const SMALL: &str = "--spp 1 --width 32 --backend cpu-simd --threads 1 --quiet";

#[test]
#[cfg(target_os = "linux")]
fn a_copy_alone_renders_what_the_checkout_does() {
    let folder = Folder::new();
    let copy = standalone::copy(env!("CARGO_BIN_EXE_uw"), &folder.path(""));
    for scene in ["clear_lamp", "flat_hull", "hull_inspection"] {
        let line = format!("render {scene} -o alone.png {SMALL}");
        let run = Run::of(standalone::command(&copy, &line).output().expect("started"));
        assert_eq!(run.code, Some(0), "{scene}: {}", run.stderr);
        let file = shipped(&format!("../assets/scenes/{scene}.toml"));
        folder.good(&format!(
            "render {} -o checkout.png {SMALL}",
            file.display()
        ));
        assert!(
            folder.read("alone.png") == folder.read("checkout.png"),
            "{scene}"
        );
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_copy_alone_begins_the_demonstration() {
    let folder = Folder::new();
    let copy = standalone::copy(env!("CARGO_BIN_EXE_uw"), &folder.path(""));
    let mut demo = standalone::command(&copy, "demo")
        .stderr(Stdio::piped())
        .spawn()
        .expect("started");
    // Nothing is told before model and texture have been read.
    let mut line = String::new();
    let stderr = demo.stderr.take().expect("standard error");
    BufReader::new(stderr).read_line(&mut line).expect("a line");
    demo.kill().expect("ended");
    demo.wait().expect("ended");
    assert!(line.starts_with("1/4 Calibrating"), "{line}");
}

#[test]
fn the_folder_that_is_named_is_the_only_one() {
    let folder = Folder::new();
    folder.good("assets --copy -o mine");
    folder.good(&format!(
        "--assets mine render clear_lamp -o out.png {SMALL}"
    ));
    std::fs::remove_file(folder.path("mine/textures/coral_rock.png")).expect("there");
    std::fs::remove_file(folder.path("mine/models/default.json")).expect("there");
    folder.refused(
        &format!("--assets mine render clear_lamp -o other.png {SMALL}"),
        &[
            "texture",
            "no file textures/coral_rock.png in mine (--assets)",
            "nowhere else",
        ],
    );
    folder.refused(
        "demo --assets mine -o demo",
        &[
            "shipped:models/default.json",
            "no file models/default.json in mine (--assets)",
        ],
    );
    folder.refused(
        &format!("--assets gone render clear_lamp -o other.png {SMALL}"),
        &["gone (--assets) is no folder", "uw assets --copy"],
    );
    for variable in ["UWGUIDE_ASSETS", "UW_ASSETS"] {
        let mut command = folder.command("demo -o demo");
        let run = Run::of(command.env(variable, "gone").output().expect("started"));
        assert_eq!(run.code, Some(2), "{}", run.stderr);
        assert!(
            run.stderr
                .contains(&format!("gone ({variable}) is no folder")),
            "{}",
            run.stderr
        );
    }
}

#[test]
fn scenes_go_by_their_names_and_scenes_of_users_show_shipped_textures() {
    let folder = Folder::new();
    folder.refused(
        "render flat_hul -o out.png",
        &[
            "\"flat_hul\" is neither a file nor one of the shipped scenes",
            "flat_hull",
        ],
    );
    folder.write("inputs.csv", "depth_m\n1\n");
    folder.refused(
        "predict --model best inputs.csv -o out.csv",
        &["--model: \"best\" is neither a file nor one of the shipped models: default"],
    );
    let scene = crate::support::SCENE.replace(
        "reflectance = [0.5, 0.4, 0.3]",
        "reflectance = { texture = \"shipped:textures/gravel.png\" }",
    );
    folder.write("scene.toml", &scene);
    folder.good(&format!("render scene.toml -o out.png {SMALL}"));
    folder.write("scene.toml", scene.replace("gravel", "grovel"));
    folder.refused(
        &format!("render scene.toml -o other.png {SMALL}"),
        &[
            "shipped:textures/grovel.png",
            "no file textures/grovel.png ships",
            "share/uwguide",
        ],
    );
}

#[test]
fn copies_do_not_take_the_place_of_other_files() {
    let folder = Folder::new();
    let run = folder.good("assets --copy -o mine");
    assert!(
        run.stdout
            .lines()
            .any(|line| line == "mine/scenes/flat_hull.toml")
    );
    folder.good("assets --copy -o mine");
    folder.write("mine/scenes/flat_hull.toml", "mine");
    std::fs::remove_file(folder.path("mine/models/default.json")).expect("there");
    folder.refused(
        "assets --copy -o mine",
        &["mine/scenes/flat_hull.toml: is there and differs"],
    );
    assert_eq!(folder.text("mine/scenes/flat_hull.toml"), "mine");
    assert!(!folder.path("mine/models/default.json").exists());
}
