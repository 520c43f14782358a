//! What becomes of a folder of which a file was damaged: through the program, as a user meets it.

use std::path::{Path, PathBuf};
use std::process::Command;

use uw_survey::dataset::DatasetConfig;

use super::{assert_same, content, tiny};

/// A finished dataset and its configuration.
struct Made {
    _folder: tempfile::TempDir,
    config: PathBuf,
    whole: PathBuf,
    copy: PathBuf,
}

impl Made {
    fn new(config: &DatasetConfig, arguments: &[&str]) -> Self {
        let folder = tempfile::tempdir().expect("folder");
        let made = Self {
            config: folder.path().join("tiny.toml"),
            whole: folder.path().join("whole"),
            copy: folder.path().join("copy"),
            _folder: folder,
        };
        std::fs::write(&made.config, config.to_text().expect("text")).expect("writable");
        let (exit, told) = made.uw(&made.whole, arguments);
        assert_eq!(exit, Some(0), "{told}");
        made
    }

    /// Exit code and standard error of `uw dataset` in `folder`.
    fn uw(&self, folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
        let output = Command::new(env!("CARGO_BIN_EXE_uw"))
            .arg("dataset")
            .arg(&self.config)
            .arg("-o")
            .arg(folder)
            .args(["--quiet", "--threads", "2"])
            .args(arguments)
            .output()
            .expect("uw starts");
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), told)
    }

    /// A fresh copy of the dataset.
    fn copied(&self) -> &Path {
        // There is none the first time.
        let _ = std::fs::remove_dir_all(&self.copy);
        for (name, bytes) in content(&self.whole) {
            let path = self.copy.join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            std::fs::write(path, bytes).expect("written");
        }
        &self.copy
    }
}

/// Flips a bit in the middle of the file.
fn flip_bit(path: &Path) {
    let mut bytes = std::fs::read(path).expect("readable");
    let at = bytes.len() / 2;
    bytes[at] ^= 1 << 4;
    std::fs::write(path, bytes).expect("writable");
}

/// Changes the last digit before the middle of the text.
fn change_digit(path: &Path) {
    let mut bytes = std::fs::read(path).expect("readable");
    let middle = bytes.len().div_ceil(2);
    let mut digits = bytes[..middle].iter();
    let at = digits.rposition(u8::is_ascii_digit).expect("a digit");
    bytes[at] = b'0' + (bytes[at] - b'0' + 1) % 10;
    std::fs::write(path, bytes).expect("writable");
}

/// How a file is damaged.
type Damage = fn(&Path);

#[test]
fn a_damaged_file_is_named_and_made_again() {
    let made = Made::new(&tiny(), &[]);
    let cases: [(&str, Damage, &[&str]); 9] = [
        (
            "renders/II_B0.0183/hull_red_tilt0_d2_z3.sums",
            flip_bit,
            &[],
        ),
        (
            "renders/II_B0.0183/hull_red_tilt0_d2_lamps.sums",
            flip_bit,
            &[],
        ),
        ("renders/5C-7C@0.5_B0.0183/up_z3.sums", flip_bit, &[]),
        // Read for the exposure alone.
        (
            "renders/II_B0.0183/pilot_hull_red_tilt0_d2_lamps.sums",
            flip_bit,
            &["exposure.json"],
        ),
        (
            "images/II_B0.0183/hull_red_tilt0_d0.5.csv",
            change_digit,
            &[],
        ),
        ("exposure.json", change_digit, &[]),
        ("profiles/hull_red_II_B0.0183.json", change_digit, &[]),
        ("dataset.csv", change_digit, &[]),
        ("dataset.parquet", flip_bit, &[]),
    ];
    for (file, damage, removed) in cases {
        let folder = made.copied();
        damage(&folder.join(file));
        for name in removed {
            std::fs::remove_file(folder.join(name)).expect("removed");
        }
        let (exit, told) = made.uw(folder, &[]);
        assert_eq!(exit, Some(0), "{file}: {told}");
        assert!(told.contains(file), "{file}: {told}");
        assert_same(&made.whole, folder);
    }
}

#[test]
fn a_render_under_the_name_of_another_is_not_taken_for_it() {
    let made = Made::new(&tiny(), &[]);
    let folder = made.copied();
    let render = |depth| {
        folder.join(format!(
            "renders/II_B0.0183/hull_red_tilt0_d2_z{depth}.sums"
        ))
    };
    std::fs::copy(render(1), render(3)).expect("copied");
    std::fs::remove_file(folder.join("images/II_B0.0183/hull_red_tilt0_d2.csv")).expect("removed");
    let (exit, told) = made.uw(folder, &[]);
    assert_eq!(exit, Some(0), "{told}");
    assert!(
        told.contains("hull_red_tilt0_d2_z3.sums is damaged"),
        "{told}"
    );
    assert_same(&made.whole, folder);
}

#[test]
fn a_damaged_part_is_named_and_not_taken_over() {
    let made = Made::new(&tiny(), &[]);
    let part = made.copied();
    let damaged = [
        "renders/II_B0.0183/hull_red_tilt0_d2_z3.sums",
        "images/II_B0.0183/hull_red_tilt0_d2.csv",
        "exposure.json",
    ];
    damaged
        .iter()
        .for_each(|file| match file.ends_with("sums") {
            true => flip_bit(&part.join(file)),
            false => change_digit(&part.join(file)),
        });
    let joined = made.whole.with_file_name("joined");
    let (exit, told) = made.uw(&joined, &["--merge", &part.display().to_string()]);
    assert_eq!(exit, Some(0), "{told}");
    for file in damaged {
        let line = format!("{} is damaged", part.join(file).display());
        assert!(told.contains(&line), "{file}: {told}");
    }
    assert_same(&made.whole, &joined);
}

#[test]
fn damaged_pictures_are_made_again_where_pictures_are_asked_for() {
    let config = DatasetConfig {
        water_types: vec!["II".into()],
        distances_m: vec![1.0],
        ..tiny()
    };
    let made = Made::new(&config, &["--keep-images"]);
    for file in ["z1_light50.png", "z3.exr", "pictures.json"] {
        let folder = made.copied();
        let file = format!("images/II_B0.0183/hull_red_tilt0_d1/{file}");
        flip_bit(&folder.join(&file));
        let (exit, told) = made.uw(folder, &["--keep-images"]);
        assert_eq!(exit, Some(0), "{file}: {told}");
        assert!(told.contains(&file), "{file}: {told}");
        assert_same(&made.whole, folder);
    }
}

#[test]
fn a_folder_of_an_earlier_version_is_gone_on_with_and_that_is_told() {
    let made = Made::new(&tiny(), &[]);
    let folder = made.copied();
    for (name, mut bytes) in content(folder) {
        if name.ends_with(".sums") {
            bytes[15] = b'1';
            bytes.truncate(bytes.len() - 4);
        } else if name.starts_with("images/") {
            let text = String::from_utf8(bytes).expect("text");
            let without =
                |line: &str| line.rsplit_once(',').expect("a checksum").0.to_owned() + "\n";
            bytes = text.lines().map(without).collect::<String>().into_bytes();
        } else if name == "exposure.json" {
            let text = String::from_utf8(bytes).expect("text");
            let value: serde_json::Value = serde_json::from_str(&text).expect("JSON");
            bytes = format!("{{\"exposure\":{}}}", value["exposure"]).into_bytes();
        }
        std::fs::write(folder.join(name), bytes).expect("written");
    }
    let (exit, told) = made.uw(folder, &[]);
    assert_eq!(exit, Some(0), "{told}");
    assert!(told.contains("files carry no checksum"), "{told}");
    assert!(!told.contains("damaged"), "{told}");
    for table in ["dataset.csv", "dataset.parquet", "manifest.json"] {
        let read = |folder: &Path| std::fs::read(folder.join(table)).expect("readable");
        assert_eq!(read(&made.whole), read(folder), "{table}");
    }
}

#[test]
fn a_check_fails_where_labels_or_tables_are_false() {
    let config = DatasetConfig {
        water_types: vec!["II".into()],
        ..tiny()
    };
    let made = Made::new(&config, &[]);
    let check = ["--check", "1", "--check-spp", "64", "--check-pixels", "4"];
    let (exit, told) = made.uw(made.copied(), &check);
    assert_eq!(exit, Some(0), "{told}");
    let cases: [(&str, Damage); 5] = [
        ("images/II_B0.0183/hull_red_tilt0_d2.csv", change_digit),
        ("dataset.csv", change_digit),
        ("profiles/hull_red_II_B0.0183.json", change_digit),
        ("renders/II_B0.0183/up_z3.sums", flip_bit),
        (
            "renders/II_B0.0183/pilot_hull_red_tilt0_d2_lamps.sums",
            flip_bit,
        ),
    ];
    for (file, damage) in cases {
        let folder = made.copied();
        damage(&folder.join(file));
        let (exit, told) = made.uw(folder, &check);
        assert_eq!(exit, Some(1), "{file}: {told}");
        assert!(told.contains(file), "{file}: {told}");
    }
}

/// Labels that are false throughout, with every checksum and table in order: what is left to find them is the light.
#[test]
fn a_check_fails_where_well_kept_labels_are_false() {
    let config = DatasetConfig {
        water_types: vec!["II".into()],
        ..tiny()
    };
    let made = Made::new(&config, &[]);
    let folder = made.copied();
    for file in std::fs::read_dir(folder.join("images/II_B0.0183")).expect("tables") {
        let path = file.expect("an entry").path();
        let text = std::fs::read_to_string(&path).expect("text");
        let inside = path.strip_prefix(folder).expect("inside").display();
        let mut all = String::new();
        for line in text.lines() {
            let mut words: Vec<String> = line.split(',').map(str::to_owned).collect();
            words.pop();
            for word in &mut words[6..9] {
                let contrast: f64 = word.parse().expect("a number");
                *word = (2.0 * contrast + 5.0).to_string();
            }
            all += &(words.join(",") + ",");
            let mut hasher = crc32fast::Hasher::new();
            hasher.update(format!("{inside}\0").as_bytes());
            hasher.update(all.as_bytes());
            all += &format!("{}\n", hasher.finalize());
        }
        std::fs::write(&path, all).expect("written");
    }
    let (exit, told) = made.uw(folder, &[]);
    assert_eq!(exit, Some(0), "{told}");
    let check = ["--check", "2", "--check-spp", "64", "--check-pixels", "4"];
    let (exit, told) = made.uw(folder, &check);
    assert_eq!(exit, Some(1), "{told}");
    assert!(told.contains("further from plain renders"), "{told}");
}
