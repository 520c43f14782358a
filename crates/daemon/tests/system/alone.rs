//! The program without the folder of assets, with what ships by its name, and with a folder that is wrong.

use std::process::{Command, Output};

#[path = "../../../assets/tests/alone/mod.rs"]
mod standalone;

const PROGRAM: &str = env!("CARGO_BIN_EXE_uwguide");

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
#[cfg(target_os = "linux")]
fn a_copy_alone_has_a_model_and_profiles() {
    use std::io::{BufRead, BufReader, Write};
    use std::process::Stdio;

    let folder = tempfile::tempdir().unwrap();
    let copy = standalone::copy(PROGRAM, folder.path());
    let mut daemon = standalone::command(&copy, "--profile 1C --stdio");
    let mut daemon = (daemon.stdin(Stdio::piped()).stdout(Stdio::piped()))
        .spawn()
        .unwrap();
    let mut ask = daemon.stdin.take().unwrap();
    ask.write_all(b"{\"op\": \"info\", \"id\": 1}\n").unwrap();
    let mut reply = String::new();
    let answers = daemon.stdout.take().unwrap();
    BufReader::new(answers).read_line(&mut reply).unwrap();
    assert!(reply.contains("shipped:models/default.json"), "{reply}");
    drop(ask);
    assert!(daemon.wait().unwrap().success());
}

#[test]
fn what_ships_goes_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let mut command = Command::new(PROGRAM);
        command.current_dir(folder.path()).args(arguments);
        command.output().unwrap()
    };
    let good = run(&[
        "--check-config",
        "--model",
        "small_camera",
        "--profile",
        "9C",
    ]);
    assert!(good.status.success(), "{}", told(&good));
    for (arguments, words) in [
        (
            ["--profile", "2C", "--check-config"].as_slice(),
            "--profile: \"2C\" is neither a file nor one of the shipped profiles: 1C, 5C",
        ),
        (
            &["--model", "best", "--no-profile"],
            "--model: \"best\" is neither a file nor one of the shipped models: default",
        ),
        (
            &["--assets", "gone", "--no-profile"],
            "uwguide: gone (--assets) is no folder",
        ),
        (
            &["--assets", ".", "--no-profile"],
            "shipped:models/default.json: cannot be read: no file models/default.json in . (--assets)",
        ),
    ] {
        let refused = run(arguments);
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}");
        assert!(told(&refused).contains(words), "{}", told(&refused));
    }
}

#[test]
fn the_program_alone_says_what_to_do_next() {
    let alone = Command::new(PROGRAM).output().unwrap();
    assert_eq!(alone.status.code(), Some(2));
    assert!(
        told(&alone).contains("  uwguide --profile 1C "),
        "{}",
        told(&alone)
    );
    let of = |arguments: &[&str]| {
        let output = Command::new(PROGRAM).args(arguments).output().unwrap();
        assert!(output.status.success(), "{arguments:?}: {}", told(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    for shell in ["bash", "zsh", "fish"] {
        assert!(
            of(&["completions", shell]).contains("check-config"),
            "{shell}"
        );
    }
    assert!(of(&["man"]).contains("check\\-config"));
}
