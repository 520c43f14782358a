//! Ctrl-C and SIGTERM during a render.
#![cfg(unix)]

use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use super::support::{Folder, Run, SCENE};

/// Long enough for the process to start and to render a few rows, on a busy machine too.
const A_WHILE: Duration = Duration::from_millis(1500);

fn start(folder: &Folder, line: &str) -> Child {
    let mut command = folder.command(line);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().expect("the binary starts")
}

fn stop(child: Child, signal: &str) -> Run {
    sleep(A_WHILE);
    let sent = Command::new("kill")
        .args([signal, &child.id().to_string()])
        .status();
    assert!(sent.expect("kill runs").success());
    Run::of(child.wait_with_output().expect("the binary ends"))
}

#[test]
fn what_was_finished_is_kept() {
    for signal in ["-INT", "-TERM"] {
        let folder = Folder::with_scene();
        let child = start(
            &folder,
            "render scene.toml -o out.png --time-limit-s 600 --stats out.json",
        );
        let run = stop(child, signal);
        assert_eq!(run.code, Some(130), "{}", run.stderr);
        assert!(
            run.stderr.contains("interrupted: out.png holds"),
            "{}",
            run.stderr
        );
        assert_eq!(folder.files(), ["out.json", "out.png", "scene.toml"]);
        assert!(folder.text("out.json").contains("\"interrupted\": true"));
        folder.good("stats out.png");
    }
}

#[test]
fn half_a_picture_is_not_written() {
    let folder = Folder::new();
    let large = SCENE
        .replace("width = 32", "width = 1600")
        .replace("height = 18", "height = 1200")
        .replace("\"IB\"", "\"9C\"");
    folder.write("large.toml", large);
    let child = start(
        &folder,
        "render large.toml -o out.exr --time-limit-s 600 --threads 1 --json",
    );
    let run = stop(child, "-INT");
    assert_eq!(run.code, Some(130), "{}", run.stderr);
    let error: serde_json::Value = serde_json::from_str(&run.stderr).expect("one JSON object");
    assert_eq!(error["error"]["code"], "interrupted");
    let message = error["error"]["message"].as_str().unwrap_or_default();
    assert!(message.contains("nothing has been written"), "{message}");
    assert_eq!(folder.files(), ["large.toml"]);
}

#[test]
fn half_a_table_is_not_written() {
    let folder = Folder::with_scene();
    let child = start(
        &folder,
        "irradiance scene.toml --depths-m 1 --samples 100000000 -o out.csv --json",
    );
    let run = stop(child, "-INT");
    assert_eq!(run.code, Some(130), "{}", run.stderr);
    assert!(
        run.stderr.contains("nothing has been written"),
        "{}",
        run.stderr
    );
    assert_eq!(folder.files(), ["scene.toml"]);
}
