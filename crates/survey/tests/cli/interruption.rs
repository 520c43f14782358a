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

/// Waits until the process has written a file, which may take long on a busy machine.
fn wait_for(folder: &Folder, file: &str) {
    for _ in 0..600 {
        if folder.path(file).exists() {
            return;
        }
        sleep(Duration::from_millis(100));
    }
    panic!("{file} has not come in a minute");
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

#[test]
fn finished_rungs_are_kept_and_not_rendered_again() {
    let folder = Folder::with_scene();
    let size = "--width 8 --height 6 --references refs";
    folder.good(&format!(
        "error-time --make-references scene.toml --spp 16 {size} --quiet"
    ));
    let ladder =
        format!("error-time scene.toml -o out --backends cpu --threads 1 --repeats 1 {size}");
    let child = start(&folder, &format!("{ladder} --spp 4,100000000"));
    wait_for(&folder, "out/error_time.csv");
    let run = stop(child, "-INT");
    assert_eq!(run.code, Some(130), "{}", run.stderr);
    assert!(
        run.stderr.contains("interrupted after 1 of 2 renders")
            && run.stderr.contains("goes on from there"),
        "{}",
        run.stderr
    );
    assert!(!folder.path("out/error_time.png").exists());
    let run = folder.good(&format!("{ladder} --spp 4"));
    assert!(
        run.stderr.contains("0 renders made, 1 found in the table"),
        "{}",
        run.stderr
    );
    let child = start(
        &folder,
        &format!("error-time --make-references scene.toml --spp 100000000 {size}"),
    );
    let run = stop(child, "-TERM");
    assert_eq!(run.code, Some(130), "{}", run.stderr);
    assert!(
        run.stderr.contains("interrupted after 0 of 1 references"),
        "{}",
        run.stderr
    );
    // The old reference is as good as before.
    folder.good(&format!("{ladder} --spp 4"));
}
