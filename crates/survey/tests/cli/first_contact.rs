//! What a new user meets: the program alone, its report on the machine, completions and manual pages.

use serde_json::Value;

use crate::support::Folder;

#[test]
fn the_program_alone_says_what_to_do_next() {
    let folder = Folder::new();
    let run = folder.uw("");
    assert_eq!(run.code, Some(2));
    assert_eq!(run.stdout, "");
    let commands: Vec<&str> = (run.stderr.lines())
        .filter_map(|line| line.strip_prefix("  uw "))
        .collect();
    assert_eq!(commands.len(), 4, "{}", run.stderr);
    // What it says to do is understood: the first word is a command that has help.
    for command in commands {
        let name = command.split(' ').next().expect("a word");
        folder.good(&format!("{name} --help"));
    }
    let json = folder.uw("--json");
    assert_eq!(json.code, Some(2));
    let error: Value = serde_json::from_str(&json.stderr).expect("one object");
    assert_eq!(error["error"]["code"], "bad_input");
}

#[test]
fn the_doctor_tells_where_files_come_from() {
    let folder = Folder::new();
    folder.good("assets --copy -o mine");
    let report = |line: &str| -> Value {
        serde_json::from_str(&folder.good(line).stdout).expect("one object")
    };
    let told = report("--json doctor --assets mine");
    let files = &told["assets"]["files"];
    let names = files["mine (--assets)"].as_array().expect("files");
    assert_eq!(files.as_object().expect("places").len(), 1, "{files}");
    assert!(names.contains(&"models/default.json".into()));
    assert_eq!(told["version"], env!("CARGO_PKG_VERSION"));
    assert!(told["processor"]["threads"].as_u64() >= Some(1));
    assert!(told["adapters"].is_array());
    if cfg!(target_os = "linux") {
        let memory = |name: &str| told["memory"][name].as_u64().expect("bytes");
        assert!(memory("available_bytes") <= memory("total_bytes"));
        assert!(memory("total_bytes") > 1 << 27);
    }
    let text = folder.good("doctor").stdout;
    for words in [
        "processor ",
        "vector units ",
        "adapter ",
        "shipped files ",
        "(beside the program): ",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
}

#[test]
fn the_doctor_fails_and_tells_all_where_files_are_missing() {
    let folder = Folder::new();
    folder.good("assets --copy -o mine");
    std::fs::remove_file(folder.path("mine/vehicles/default.toml")).expect("there");
    let run = folder.uw("doctor --assets mine");
    assert_eq!(run.code, Some(1), "{}", run.stderr);
    assert!(
        run.stderr
            .contains("no file vehicles/default.toml in mine (--assets)"),
        "{}",
        run.stderr
    );
    assert!(run.stdout.contains("processor "), "{}", run.stdout);
}

#[test]
fn completions_and_manual_pages_know_every_command() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish"] {
        let script = folder.good(&format!("completions {shell}")).stdout;
        assert!(
            script.contains("water-tables") && script.contains("target-error"),
            "{shell}"
        );
    }
    folder.refused("completions tcsh", &["tcsh", "bash", "fish", "zsh"]);
    folder.good("man -o pages");
    let page = folder.text("pages/uw-render.1");
    assert!(
        page.starts_with(".ie") && page.contains("target\\-error"),
        "{page}"
    );
    let pages = std::fs::read_dir(folder.path("pages"))
        .expect("pages")
        .count();
    assert!(pages >= 20, "{pages}");
    assert!(folder.good("man").stdout.contains(".SH SUBCOMMANDS"));
}
