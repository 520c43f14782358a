//! A folder of its own for each test, and the binary run inside it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;

/// A target 1.5 m ahead in clear water, lit by two lamps of which the right one is dimmed, and by the sky.
pub const SCENE: &str = r#"
format = "uw-scene/1"
[water]
jerlov = "IB"
phase = { model = "fournier-forand", n = 1.10, backscatter_fraction = 0.0183 }
[surface]
height_m = 2.0
[sky]
radiance = [0.1, 0.2, 0.3]
[camera]
position_m = [0.0, 0.0, 0.0]
forward = [1.0, 0.0, 0.0]
up = [0.0, 0.0, 1.0]
hfov_deg = 60.0
width = 32
height = 18
[[lamp]]
name = "left"
position_m = [0.0, 0.3, 0.0]
forward = [1.0, 0.0, 0.0]
intensity = [10.0, 10.0, 10.0]
level_pct = 100.0
half_angle_deg = 60.0
[[lamp]]
name = "right"
position_m = [0.0, -0.3, 0.0]
forward = [1.0, 0.0, 0.0]
intensity = [8.0, 10.0, 12.0]
level_pct = 25.0
half_angle_deg = 60.0
[[object]]
plane = { center_m = [1.5, 0.0, 0.0], normal = [-1.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], size_m = [8.0, 8.0] }
reflectance = [0.5, 0.4, 0.3]
[sensor]
exposure = { auto_mean = 0.4 }
noise = { a = 1e-3, b = 1e-5 }
[render]
samples_per_pixel = 4
"#;

/// An empty folder that is gone after the test.
pub struct Folder(TempDir);

/// What a run of the binary left behind.
pub struct Run {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().expect("temporary folder"))
    }

    /// A folder with [`SCENE`] in `scene.toml`.
    pub fn with_scene() -> Self {
        let folder = Self::new();
        folder.write("scene.toml", SCENE);
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> &Self {
        fs::write(self.path(name), content).expect("writable");
        self
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    pub fn text(&self, name: &str) -> String {
        String::from_utf8(self.read(name)).expect("text")
    }

    /// Names of all files, hidden ones included.
    pub fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).expect("folder");
        let mut names: Vec<String> = entries
            .map(|entry| {
                entry
                    .expect("entry")
                    .file_name()
                    .to_string_lossy()
                    .into_owned()
            })
            .collect();
        names.sort();
        names
    }

    /// The binary with the words of `line` as arguments, ready to start.
    pub fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_uw"));
        command
            .args(line.split_whitespace())
            .current_dir(self.0.path())
            .stdin(Stdio::null());
        command
    }

    /// Runs the binary with the words of `line` as arguments.
    pub fn uw(&self, line: &str) -> Run {
        Run::of(self.command(line).output().expect("the binary starts"))
    }

    /// Runs the binary and expects it to succeed.
    pub fn good(&self, line: &str) -> Run {
        let run = self.uw(line);
        assert_eq!(run.code, Some(0), "uw {line}: {}", run.stderr);
        run
    }

    /// Runs the binary and expects exit code 2, the words on standard error, and no file more or less.
    pub fn refused(&self, line: &str, words: &[&str]) {
        let before = self.files();
        let run = self.uw(line);
        assert_eq!(run.code, Some(2), "uw {line}: {}", run.stderr);
        for word in words {
            assert!(
                run.stderr.contains(word),
                "uw {line}: {word:?} not in {}",
                run.stderr
            );
        }
        assert_eq!(run.stdout, "", "uw {line}");
        assert_eq!(self.files(), before, "uw {line}");
    }
}

impl Run {
    pub fn of(output: Output) -> Self {
        let text = |bytes| String::from_utf8(bytes).expect("text");
        Self {
            code: output.status.code(),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
        }
    }

    /// Rows of numbers below the header of a CSV on standard output.
    pub fn rows(&self) -> Vec<Vec<f64>> {
        numbers(&self.stdout)
    }
}

/// Rows of numbers below the header of a CSV text; what is no number becomes NaN.
pub fn numbers(text: &str) -> Vec<Vec<f64>> {
    let row = |line: &str| {
        line.split(',')
            .map(|field| field.parse().unwrap_or(f64::NAN))
            .collect()
    };
    text.lines().skip(1).map(row).collect()
}

/// A file of this repository, by its path from `crates/`.
pub fn shipped(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}
