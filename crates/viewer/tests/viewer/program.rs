//! The real program on a virtual screen.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Instant;

use uw_render::image::{Counts, read_frame};

use crate::support::{PATIENCE, SCENE, must_have_gpu, repository};

/// A virtual screen that ends with its owner.
struct Screen {
    server: Child,
    name: String,
}

impl Drop for Screen {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

impl Screen {
    /// `None` where there is no Xvfb.
    fn start() -> Option<Self> {
        let mut server = Command::new("Xvfb")
            .args([
                "-displayfd",
                "1",
                "-screen",
                "0",
                "1280x800x24",
                "-nolisten",
                "tcp",
            ])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .ok()?;
        let mut line = String::new();
        let out = server.stdout.take()?;
        BufReader::new(out).read_line(&mut line).ok()?;
        let name = format!(":{}", line.trim());
        Some(Self { server, name })
    }
}

fn wait(mut program: Child) -> std::process::Output {
    let start = Instant::now();
    while program.try_wait().expect("waitable").is_none() {
        if start.elapsed() > PATIENCE {
            // The output then tells why.
            let _ = program.kill();
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    program.wait_with_output().expect("output")
}

fn viewer(screen: &Screen, arguments: &[&str], runtime: &Path) -> std::process::Output {
    let program = Command::new(env!("CARGO_BIN_EXE_viewer"))
        .args(arguments)
        .env("DISPLAY", &screen.name)
        .env_remove("WAYLAND_DISPLAY")
        .env("XDG_RUNTIME_DIR", runtime)
        .env("XDG_STATE_HOME", runtime.join("state"))
        .env("UW_ASSETS", repository().join("assets"))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("built");
    wait(program)
}

#[test]
fn the_program_opens_a_window_renders_and_takes_a_screenshot() {
    let Some(screen) = Screen::start() else {
        assert!(
            !must_have_gpu(),
            "UW_REQUIRE_GPU is set and there is no Xvfb"
        );
        eprintln!("skipped: no Xvfb");
        return;
    };
    let folder = tempfile::tempdir().expect("folder");
    let (scene, shot) = (
        folder.path().join("scene.toml"),
        folder.path().join("shot.png"),
    );
    std::fs::write(&scene, SCENE).expect("written");
    let text = |path: &Path| path.display().to_string();
    let (scene, shot_name) = (text(&scene), text(&shot));
    // What lasts from other runs is neither read nor written.
    let state = folder.path().join("state/uw-viewer");
    std::fs::create_dir_all(&state).expect("made");
    let choices = r#"{"brightness": "light", "panel": "inspect"}"#;
    std::fs::write(state.join("window.json"), choices).expect("written");
    let arguments = [
        "--scene",
        &scene,
        "--screenshot",
        &shot_name,
        "--after-samples",
        "2",
        "--backend",
        "cpu",
    ];
    let output = viewer(&screen, &arguments, folder.path());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    if !output.status.success() && said.contains("cannot open a window") && !must_have_gpu() {
        eprintln!("skipped: {said}");
        return;
    }
    assert!(
        output.status.success(),
        "{:?}: {said}",
        output.status.code()
    );
    let kept = std::fs::read_to_string(state.join("window.json"));
    assert_eq!(kept.expect("there"), choices);
    assert_eq!(std::fs::read_dir(&state).expect("there").count(), 1);
    let frame = read_frame(&shot).expect("a picture");
    assert_eq!((frame.width, frame.height), (1280, 720));
    let Counts::Bits8(counts) = frame.counts else {
        panic!("8 bits are written");
    };
    // The wall in the middle of the picture: lit, and bluish in this water; the panel on the left is grey.
    let pixel = |x: usize, y: usize| {
        let at = 3 * (y * 1280 + x);
        [counts[at], counts[at + 1], counts[at + 2]]
    };
    let [r, g, b] = pixel(820, 360);
    assert!(g > 40 && b > 40 && r < b, "{r} {g} {b}");
    let [r, g, b] = pixel(355, 690);
    assert!(
        r.abs_diff(g) < 8 && g.abs_diff(b) < 8 && r < 60,
        "{r} {g} {b}"
    );
}

#[test]
fn unusable_arguments_and_files_end_with_code_2() {
    let Some(screen) = Screen::start() else {
        assert!(
            !must_have_gpu(),
            "UW_REQUIRE_GPU is set and there is no Xvfb"
        );
        return;
    };
    let folder = tempfile::tempdir().expect("folder");
    let cases: [(&[&str], &str); 4] = [
        (&["--scene", "none.toml", "--backend", "cpu"], "none.toml"),
        (&["--size", "1x1"], "320x240"),
        (&["--backend", "abacus"], "abacus"),
        (&["--after-samples", "3"], "--screenshot"),
    ];
    for (arguments, expected) in cases {
        let output = viewer(&screen, arguments, folder.path());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(expected), "{said}");
    }
}

#[test]
fn without_a_screen_the_message_says_what_to_do() {
    let folder = tempfile::tempdir().expect("folder");
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, SCENE).expect("written");
    // None at all, an empty one, and one that nobody serves.
    for display in [None, Some(""), Some(":64999")] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_viewer"));
        command
            .args(["--backend", "cpu", "--scene"])
            .arg(&scene)
            .env_remove("DISPLAY")
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            .env("XDG_RUNTIME_DIR", folder.path())
            .env("UW_ASSETS", repository().join("assets"))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command.envs(display.map(|name| ("DISPLAY", name)));
        let output = wait(command.spawn().expect("built"));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{display:?}: {said}");
        let render = format!("uw render {}", scene.display());
        for part in ["viewer: ", "DISPLAY", "xvfb-run", &render] {
            assert!(said.contains(part), "{display:?}: {part} is not in {said}");
        }
        for part in [".rs", "panicked", "registry", "RUST_BACKTRACE"] {
            assert!(!said.contains(part), "{display:?}: {said}");
        }
        assert_eq!(said.lines().count(), 1, "{said}");
    }
}
