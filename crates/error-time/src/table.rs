//! The table of measurements: one row per render, kept as CSV from run to run.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use uw_render::image::{ImageError, write_atomically};

use super::backend::Backend;

/// One render and its error. The fields are the columns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measurement {
    /// Name of the scene.
    pub scene: String,
    /// Hash of the scene's content.
    pub scene_hash: String,
    /// Width, pixels.
    pub width_px: u32,
    /// Height, pixels.
    pub height_px: u32,
    /// Where it was rendered.
    pub backend: Backend,
    /// Worker threads.
    pub threads: usize,
    /// Samples per pixel.
    pub samples_per_pixel: u32,
    /// Which of the renders that differ in their seeds only, from 0.
    pub repeat: u32,
    /// Seed of the render.
    pub seed: u64,
    /// Version of the program.
    pub version: String,
    /// Reading and preparing the scene, s.
    pub setup_s: f64,
    /// Rendering, s of wall time.
    pub render_s: f64,
    /// Rendering, s of processor time.
    pub cpu_s: f64,
    /// Walks started at the camera.
    pub paths: u64,
    /// Vertices of walks and bridges.
    pub path_vertices: u64,
    /// Relative mean squared error without the reference's expected part.
    pub rel_mse: f64,
    /// The reference's expected part, which has been taken off.
    pub rel_mse_of_reference: f64,
    /// Mean signed relative error, red.
    pub bias_r: f64,
    /// Mean signed relative error, green.
    pub bias_g: f64,
    /// Mean signed relative error, blue.
    pub bias_b: f64,
    /// Standard error of `bias_r` from the noise of the render and of the reference.
    pub bias_standard_error_r: f64,
    /// Standard error of `bias_g`.
    pub bias_standard_error_g: f64,
    /// Standard error of `bias_b`.
    pub bias_standard_error_b: f64,
    /// Seed of the reference.
    pub reference_seed: u64,
    /// Samples per pixel of the reference.
    pub reference_samples_per_pixel: u64,
    /// Version of the program that made the reference.
    pub reference_version: String,
}

impl Measurement {
    /// Mean signed relative error per channel.
    pub fn bias(&self) -> [f64; 3] {
        [self.bias_r, self.bias_g, self.bias_b]
    }

    /// Standard error of [`Measurement::bias`].
    pub fn bias_standard_error(&self) -> [f64; 3] {
        [
            self.bias_standard_error_r,
            self.bias_standard_error_g,
            self.bias_standard_error_b,
        ]
    }

    /// Whether the other row was measured with the same program on the same render and against the same reference.
    pub fn repeats(&self, other: &Self) -> bool {
        let render = |m: &Self| (m.width_px, m.height_px, m.backend, m.threads);
        let sampling = |m: &Self| (m.samples_per_pixel, m.repeat, m.seed);
        let reference = |m: &Self| (m.reference_seed, m.reference_samples_per_pixel);
        self.scene == other.scene
            && self.scene_hash == other.scene_hash
            && self.version == other.version
            && self.reference_version == other.reference_version
            && render(self) == render(other)
            && sampling(self) == sampling(other)
            && reference(self) == reference(other)
    }
}

/// A table that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file is there and cannot be opened.
    #[error("{}: cannot be read: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is not a table of measurements.
    #[error("{}: is not a table of this version of `uw error-time`: {reason}; move it away or choose another folder", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// Line and column, and what is wrong there.
        reason: String,
    },
}

/// Reads the measurements of a file; none where there is no file.
///
/// # Errors
/// A file that cannot be read or is something else.
pub fn read(path: &Path) -> Result<Vec<Measurement>, TableError> {
    let file = match File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(source) => {
            return Err(TableError::Unreadable {
                path: path.to_path_buf(),
                source,
            });
        }
    };
    let rows: Result<Vec<Measurement>, csv::Error> =
        csv::Reader::from_reader(file).into_deserialize().collect();
    rows.map_err(|error| TableError::Content {
        path: path.to_path_buf(),
        reason: error.to_string(),
    })
}

/// Writes the measurements under a temporary name and then renames, so that the file is whole or not there.
///
/// # Errors
/// A file that cannot be written.
pub fn write(path: &Path, rows: &[Measurement]) -> Result<(), ImageError> {
    let system = |source| ImageError::System {
        path: path.to_path_buf(),
        action: "written",
        source,
    };
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).map_err(|e| system(e.into()))?;
    }
    let bytes = writer.into_inner().map_err(|e| system(e.into_error()))?;
    write_atomically(path, |file| file.write_all(&bytes).map_err(system))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(crate) fn measurement() -> Measurement {
        Measurement {
            scene: "s1".to_owned(),
            scene_hash: "00ff".to_owned(),
            width_px: 8,
            height_px: 6,
            backend: Backend::Cpu,
            threads: 2,
            samples_per_pixel: 64,
            repeat: 1,
            seed: u64::MAX - 1,
            version: "0.1.0+ab".to_owned(),
            setup_s: 0.125,
            render_s: 0.75,
            cpu_s: 1.0 / 3.0,
            paths: 1 << 40,
            path_vertices: 1 << 41,
            rel_mse: 1.234_567_890_123_456_7e-3,
            rel_mse_of_reference: 1e-6,
            bias_r: -1e-3,
            bias_g: 0.0,
            bias_b: 2e-3,
            bias_standard_error_r: 1e-3,
            bias_standard_error_g: 1e-3,
            bias_standard_error_b: f64::INFINITY,
            reference_seed: 7,
            reference_samples_per_pixel: 4096,
            reference_version: "0.1.0".to_owned(),
        }
    }

    #[test]
    fn what_is_written_is_read_back_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.csv");
        assert_eq!(read(&path).unwrap(), []);
        let rows = [
            measurement(),
            Measurement {
                scene: "a, \"b\"".to_owned(),
                ..measurement()
            },
        ];
        write(&path, &rows).unwrap();
        assert_eq!(read(&path).unwrap(), rows);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn other_tables_are_refused_with_the_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.csv");
        write(&path, &[measurement()]).unwrap();
        let good = std::fs::read_to_string(&path).unwrap();
        for (text, words) in [
            (good.replace(",8,6,", ",8,six,"), "line: 2"),
            (good.replace("rel_mse,", "error,"), "error"),
            (good.replace(",cpu,", ",abacus,"), "abacus"),
            (
                good.lines().next().unwrap_or_default().replace(',', ";") + "\n1;2\n",
                "unknown field",
            ),
        ] {
            std::fs::write(&path, text).unwrap();
            let message = read(&path).unwrap_err().to_string();
            assert!(
                message.contains("table.csv: is not a table") && message.contains(words),
                "{message}"
            );
        }
    }

    #[test]
    fn a_measurement_is_repeated_by_the_same_render_only() {
        let one = measurement();
        let faster = Measurement {
            cpu_s: 1e-3,
            render_s: 1e-3,
            rel_mse: 0.5,
            ..measurement()
        };
        assert!(one.repeats(&faster));
        let others: [fn(&mut Measurement); 11] = [
            |m| m.scene.push('x'),
            |m| m.scene_hash.push('0'),
            |m| m.width_px += 1,
            |m| m.height_px += 1,
            |m| m.threads += 1,
            |m| m.samples_per_pixel += 1,
            |m| m.repeat += 1,
            |m| m.seed -= 1,
            |m| m.version.push('0'),
            |m| m.reference_seed += 1,
            |m| m.reference_samples_per_pixel += 1,
        ];
        for (index, change) in others.iter().enumerate() {
            let mut other = measurement();
            change(&mut other);
            assert!(!one.repeats(&other), "change {index}");
        }
    }
}
