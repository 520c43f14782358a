//! What goes to the clipboard gives the picture that is shown.

use std::path::Path;

use egui::{Key, Modifiers, OutputCommand};
use egui_kittest::Harness;
use uw_media::Iops;
use uw_render::scene::{Scene, Setting};
use uw_viewer::app::Viewer;
use uw_viewer::model::command::{Wanted, command};
use uw_viewer::model::{Coefficients, OpenScene, Settings, scene_text::scene_text};

use crate::panels::{click, viewer};
use crate::support::{SCENE, repository};

const WANTED: Wanted = Wanted {
    samples: 7,
    size_px: (320, 180),
    seed: 3,
    layer: None,
    denoised: false,
};

/// The words of a command, as a shell divides them; quotes are single ones.
fn words(command: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quoted = false;
    let mut letters = command.chars();
    while let Some(c) = letters.next() {
        match c {
            '\'' => quoted = !quoted,
            '\\' if !quoted => words.last_mut().expect("one").extend(letters.next()),
            ' ' if !quoted => words.push(String::new()),
            c => words.last_mut().expect("one").push(c),
        }
    }
    words
}

/// The scene that a command renders.
fn rendered(command: &str) -> Scene {
    let words = words(command);
    assert_eq!(words[..2], ["uw", "render"]);
    let settings = words.windows(2).filter(|pair| pair[0] == "--set");
    let settings: Vec<Setting> = settings
        .map(|pair| pair[1].parse().expect("valid"))
        .collect();
    Scene::read_with(Path::new(&words[2]), &settings).expect("read")
}

/// Everything that is not an object, with as many digits as count.
fn told(scene: &Scene) -> String {
    let mut camera = scene.camera.clone();
    // Up is made perpendicular to forward anew, which may move its last bit.
    for axis in [&mut camera.right, &mut camera.down] {
        *axis = (1e12 * *axis).round() + glam::DVec3::ZERO;
    }
    format!(
        "{:?} {:?} {:?} {:?} {camera:?} {:?} {:?} {:?}",
        scene.water,
        scene.surface,
        scene.sun,
        scene.sky_radiance,
        scene.lamps,
        scene.sensor,
        scene.render
    )
}

fn opened(folder: &Path) -> (OpenScene, Settings) {
    let path = folder.join("it's mine.toml");
    std::fs::write(&path, SCENE).expect("written");
    OpenScene::read(&path).expect("valid")
}

/// Whatever is set, the command renders it from the file that is open.
#[test]
fn the_command_renders_what_is_set() {
    let folder = tempfile::tempdir().expect("folder");
    let (open, filed) = opened(folder.path());
    type Change = fn(&mut Settings);
    let cases: [(Change, usize); 6] = [
        (|_| (), 0),
        (|s| s.lamps[0].level_pct = 12.5, 1),
        (|s| s.water = Some(Default::default()), 1),
        (
            |s| {
                // The file has a type, which has to go.
                let water = s.water.as_mut().expect("water");
                let (a, b) = ([0.3, 0.1, 0.05], [0.2, 0.25, 0.3]);
                water.coefficients = Coefficients::Direct(Iops { a, b });
            },
            1,
        ),
        (|s| s.camera.set_hfov_deg(75.0), 1),
        (
            |s| {
                s.camera.position_m.z = -2.5;
                s.sensor.noise = Some(uw_render::scene::Noise { a: 1e-3, b: 1e-5 });
                s.max_bounces = 5;
            },
            3,
        ),
    ];
    for (i, (change, count)) in cases.into_iter().enumerate() {
        let mut settings = filed.clone();
        change(&mut settings);
        let text = command(&open, (&filed, &settings), &WANTED).expect("can be said");
        let options = words(&text).iter().filter(|word| *word == "--set").count();
        assert!(
            options <= count.max(usize::from(settings != filed)),
            "{i}: {text}"
        );
        assert!(settings == filed || options > 0, "{i}: {text}");
        let expected = settings.scene().expect("valid");
        assert_eq!(told(&rendered(&text)), told(&expected), "{i}: {text}");
        assert!(
            text.contains(" --spp 7 --width 320 --height 180 --seed 3"),
            "{text}"
        );
    }
}

#[test]
fn what_options_cannot_say_asks_for_a_file() {
    let folder = tempfile::tempdir().expect("folder");
    let (open, filed) = opened(folder.path());
    let said = |open: &OpenScene, change: fn(&mut Settings)| {
        let mut settings = filed.clone();
        change(&mut settings);
        command(open, (&filed, &settings), &WANTED).expect_err("cannot be said")
    };
    assert_eq!(said(&open, |s| s.sun = None), "sun was switched off");
    let more = said(&open, |s| {
        s.lamps.push(uw_viewer::model::open_scene::lamp_beside(s))
    });
    assert_eq!(more, "lamps were added or removed");
    let unsaved = OpenScene {
        path: None,
        ..open.clone()
    };
    assert_eq!(said(&unsaved, |_| ()), "the scene was never saved");
    // The file became another since it was opened.
    std::fs::write(
        open.path.as_ref().expect("a file"),
        SCENE.replace("0.5, 0.4", "0.5, 0.3").replace("IB", "9C"),
    )
    .expect("written");
    assert_eq!(said(&open, |_| ()), "options cannot say what was set");
}

#[test]
fn layers_and_denoising_are_asked_for() {
    let folder = tempfile::tempdir().expect("folder");
    let (open, filed) = opened(folder.path());
    let wanted = Wanted {
        layer: Some("lamp.left".to_owned()),
        denoised: true,
        ..WANTED
    };
    let text = command(&open, (&filed, &filed), &wanted).expect("can be said");
    assert!(text.contains(r"mine.exr' --spp 8 "), "{text}");
    assert!(
        text.ends_with("--seed 3 --layers lamp.left --denoise"),
        "{text}"
    );
}

/// What is copied when a key goes down.
fn copied(harness: &mut Harness<'_, Viewer>, key: Key, modifiers: Modifiers) -> String {
    let press = egui::Event::Key {
        key,
        physical_key: None,
        pressed: true,
        repeat: false,
        modifiers,
    };
    harness.input_mut().events.push(press);
    harness.step();
    let commands = &harness.output().platform_output.commands;
    let mut texts = commands.iter().filter_map(|command| match command {
        OutputCommand::CopyText(text) => Some(text.clone()),
        _ => None,
    });
    texts.next().expect("something was copied")
}

/// The text of every shipped scene, copied with something changed, is read by the renderer from anywhere.
#[test]
fn a_copied_scene_is_the_one_that_is_open() {
    let mut harness = viewer();
    for name in ["flat_hull", "hull_inspection", "flat_reef"] {
        let path = repository().join(format!("assets/scenes/{name}.toml"));
        let (open, mut settings) = OpenScene::read(&path).expect("valid");
        settings.sensor.exposure = uw_render::scene::Exposure::Fixed(2.5);
        let surfaces = open.geometry.len();
        harness.state_mut().open = open;
        harness.state_mut().settings = settings.clone();
        let text = copied(&mut harness, Key::T, Modifiers::COMMAND);
        let anywhere = tempfile::tempdir().expect("folder");
        let scene = Scene::parse(&text, anywhere.path(), "copied").expect("valid");
        assert_eq!(
            told(&scene),
            told(&settings.scene().expect("valid")),
            "{name}"
        );
        let (again, mut read) =
            OpenScene::parse(&text, &anywhere.path().join("c.toml")).expect("valid");
        // Objects name their files from elsewhere.
        assert_eq!(scene_text(&again, &read, Path::new("/")), text, "{name}");
        read.objects = settings.objects.clone();
        read.camera.up = settings.camera.up;
        assert_eq!(read, settings, "{name}");
        assert_eq!(again.geometry.len(), surfaces, "{name}");
    }
}

/// A scene that was never saved is saved first, and its command then copied.
#[test]
fn the_dialog_saves_and_then_copies_the_command() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("first.toml");
    let mut harness = viewer();
    harness.state_mut().open.path = None;
    harness.key_press_modifiers(Modifiers::COMMAND, Key::K);
    harness.run_steps(4);
    let said = harness.state().toasts.all().iter();
    assert_eq!(
        said.filter(|t| t.text.starts_with("Save the scene first: "))
            .count(),
        1
    );
    harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
    harness.event(egui::Event::Text(path.display().to_string()));
    harness.run_steps(2);
    let text = copied(&mut harness, Key::Enter, Modifiers::NONE);
    let start = format!("uw render {} -o first.png --spp ", path.display());
    assert!(text.starts_with(&start), "{text}");
    assert!(!text.contains("--set"), "{text}");
    assert_eq!(harness.state().open.title, "first.toml");
    click(&mut harness, "5C");
    let text = copied(&mut harness, Key::K, Modifiers::COMMAND);
    assert!(text.ends_with("--set water.jerlov=5C"), "{text}");
}
