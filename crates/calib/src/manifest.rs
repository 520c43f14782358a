//! The list of images of a calibration routine: a CSV file with one image a row.
//!
//! Columns `file,kind,depth_m,distance_m,light_pct` in any order; `level_pct`, the level that the lamps were set to, may stand for
//! `light_pct` where their level curve is known. Rows of kind `depth` look up to the
//! surface and need `depth_m`; rows of kind `contrast` look at the target and need `distance_m` and
//! `light_pct`, and `depth_m` where no picture looks up. The other numbers of a row may be left empty. File names are relative to the manifest;
//! a folder stands for the mean of its frames. The column `exposure` may be added: how long a picture was exposed, where its file does not tell.

use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use csv::StringRecord;
use thiserror::Error;

use crate::json::nearest;
use crate::photo::exposures::{self, OneExposure};
use crate::photo::{Exposed, View};
use crate::vehicle::LevelCurve;

const COLUMNS: [&str; 5] = ["file", "kind", "depth_m", "distance_m", "light_pct"];
/// May stand in the place of the last.
const LEVEL: &str = "level_pct";
/// May be added.
const EXPOSURE: &str = "exposure";

/// Why a manifest cannot be used.
#[derive(Debug, Error)]
pub enum ManifestError {
    /// The manifest cannot be read.
    #[error("{file}: cannot be read: {source}")]
    Read {
        /// Manifest.
        file: String,
        /// The system's answer.
        source: std::io::Error,
    },
    /// The manifest is not a CSV table.
    #[error("{file}: not a usable CSV table: {source}")]
    Csv {
        /// Manifest.
        file: String,
        /// What the CSV reader found.
        source: csv::Error,
    },
    /// A column has no meaning here, or a needed one is not there.
    #[error("{file}:1: {message}")]
    Columns {
        /// Manifest.
        file: String,
        /// What is wrong with the header.
        message: String,
    },
    /// There is no row.
    #[error("{file}: no image is listed below the header")]
    Empty {
        /// Manifest.
        file: String,
    },
    /// A value cannot be used.
    #[error("{file}:{line}: {field} must be {expected}, got {got:?}")]
    Value {
        /// Manifest.
        file: String,
        /// Line, from 1.
        line: u64,
        /// Column.
        field: &'static str,
        /// What would be right.
        expected: &'static str,
        /// What was given.
        got: String,
    },
    /// A listed image is not there.
    #[error(
        "{file}:{line}: file must be an existing image or a folder of frames, got {got:?} (no file {path})"
    )]
    MissingImage {
        /// Manifest.
        file: String,
        /// Line, from 1.
        line: u64,
        /// Name as given.
        got: String,
        /// Where it was looked for.
        path: String,
    },
}

/// What an image of the routine shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RowKind {
    /// Looking up to the surface from a depth.
    Depth {
        /// Depth, m, finite and >= 0.
        depth_m: f64,
    },
    /// Looking at the target from a distance.
    Contrast {
        /// Distance, m, finite and > 0.
        distance_m: f64,
        /// The lamps' light, percent of full intensity, in [0, 100]; 0 is off.
        light_pct: f64,
        /// Depth, m, finite and >= 0, where it is given.
        depth_m: Option<f64>,
    },
}

/// One image of the routine.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Line of the manifest, from 1.
    pub line: u64,
    /// The image, or the folder of its frames; existed when [`Manifest::read`] read the manifest.
    pub image: PathBuf,
    /// Exposure that the manifest states: time · ISO / f-number², or in any other unit that all rows have; finite and > 0.
    pub exposure: Option<f64>,
    /// Exposure over the one that pictures of its kind are brought to, > 0; 1 until [`Manifest::one_exposure`].
    pub over: f64,
    /// What it shows.
    pub kind: RowKind,
}

impl Row {
    /// Its picture, at the exposure that those of its kind are brought to.
    pub fn view(&self) -> View<'_> {
        View {
            path: &self.image,
            distance_m: match self.kind {
                RowKind::Depth { .. } => None,
                RowKind::Contrast { distance_m, .. } => Some(distance_m),
            },
            exposed: Exposed {
                over: self.over,
                ..Exposed::ALIKE
            },
        }
    }
}

/// A manifest that has been read and checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Manifest {
    /// The manifest file.
    pub path: PathBuf,
    /// Its rows in file order, at least one.
    pub rows: Vec<Row>,
}

impl Manifest {
    /// Reads a manifest and checks every row, before any image is opened. `levels` is the light of the lamps by the level that they
    /// are set to, which the column `level_pct` needs.
    pub fn read(path: &Path, levels: Option<&LevelCurve>) -> Result<Self, ManifestError> {
        let manifest = Self::parse(path, levels)?;
        manifest.check_images()?;
        Ok(manifest)
    }

    /// Reads a manifest and checks its rows, but not whether the images are there.
    pub fn parse(path: &Path, levels: Option<&LevelCurve>) -> Result<Self, ManifestError> {
        let file = path.display().to_string();
        let text = fs::File::open(path).map_err(|source| ManifestError::Read {
            file: file.clone(),
            source,
        })?;
        let mut table = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_reader(text);
        let csv_error = |source| ManifestError::Csv {
            file: file.clone(),
            source,
        };
        let header = table.headers().map_err(csv_error)?.clone();
        let columns = Columns::of(&header, levels).map_err(|message| ManifestError::Columns {
            file: file.clone(),
            message,
        })?;
        let folder = path.parent().unwrap_or(Path::new("."));
        let mut rows = Vec::new();
        for record in table.records() {
            let record = record.map_err(csv_error)?;
            rows.push(
                Cells {
                    file: &file,
                    columns,
                    levels: levels.filter(|_| columns.is_level),
                    record: &record,
                }
                .row(folder)?,
            );
        }
        if rows.is_empty() {
            return Err(ManifestError::Empty { file });
        }
        Ok(Self {
            path: path.to_owned(),
            rows,
        })
    }

    /// Brings the pictures of each kind to one exposure ([`Row::over`]), by the column `exposure` and by EXIF: those of the target to `asked` (finite, > 0),
    /// else, as those that look up, to the shortest. Told is what should be known of
    /// that.
    pub fn one_exposure(&mut self, asked: Option<f64>) -> OneExposure {
        exposures::one_exposure(self, asked)
    }

    /// Whether all images are there.
    pub fn check_images(&self) -> Result<(), ManifestError> {
        let folder = self.path.parent().unwrap_or(Path::new("."));
        for row in &self.rows {
            if !row.image.exists() {
                let given = row.image.strip_prefix(folder).unwrap_or(&row.image);
                return Err(ManifestError::MissingImage {
                    file: self.path.display().to_string(),
                    line: row.line,
                    got: given.display().to_string(),
                    path: row.image.display().to_string(),
                });
            }
        }
        Ok(())
    }
}

/// Where a header has its columns.
#[derive(Clone, Copy)]
struct Columns {
    /// Of [`COLUMNS`].
    at: [usize; 5],
    /// Whether the last is [`LEVEL`].
    is_level: bool,
    /// [`EXPOSURE`], where it is there.
    exposure: Option<usize>,
}

impl Columns {
    fn of(header: &StringRecord, levels: Option<&LevelCurve>) -> Result<Self, String> {
        let is_level = header.iter().any(|name| name == LEVEL);
        if is_level && levels.is_none() {
            return Err(format!(
                "column {LEVEL} needs the vehicle's level_curve (`uw camera-fit level` measures it); {} is the lamps' light, percent of full",
                COLUMNS[4]
            ));
        }
        let needed = match is_level {
            true => [&COLUMNS[..4], &[LEVEL]].concat(),
            false => COLUMNS.to_vec(),
        };
        let known = [&needed[..], &[EXPOSURE]].concat();
        for (k, name) in header.iter().enumerate() {
            if is_level && name == COLUMNS[4] {
                return Err(format!("{LEVEL} and {name} say the same: leave one out"));
            }
            if !known.contains(&name) {
                return Err(match nearest(name, &known) {
                    Some(near) => format!("unknown column {name:?}; did you mean {near}?"),
                    None => format!("unknown column {name:?}; columns are {}", known.join(", ")),
                });
            }
            if header.iter().take(k).any(|earlier| earlier == name) {
                return Err(format!("column {name} stands twice"));
            }
        }
        let position = |name: &str| header.iter().position(|column| column == name);
        let mut at = [0; 5];
        for (k, name) in needed.iter().enumerate() {
            let missing = || {
                format!(
                    "column {name} is missing; columns are {}",
                    needed.join(", ")
                )
            };
            at[k] = position(name).ok_or_else(missing)?;
        }
        Ok(Self {
            at,
            is_level,
            exposure: position(EXPOSURE),
        })
    }
}

/// One record with what its errors need.
struct Cells<'a> {
    file: &'a str,
    columns: Columns,
    /// Where the last column is the level that was set.
    levels: Option<&'a LevelCurve>,
    record: &'a StringRecord,
}

impl Cells<'_> {
    fn row(&self, folder: &Path) -> Result<Row, ManifestError> {
        let kind = match self.cell(1) {
            "depth" => {
                self.optional(3, POSITIVE_M)?;
                self.optional(4, PERCENT)?;
                RowKind::Depth {
                    depth_m: self.number(2, DEPTH_M)?,
                }
            }
            "contrast" => RowKind::Contrast {
                depth_m: self.optional(2, DEPTH_M)?,
                distance_m: self.number(3, POSITIVE_M)?,
                light_pct: self.light_pct()?,
            },
            _ => return Err(self.wrong(1, "depth or contrast")),
        };
        let name = self.cell(0);
        if name.is_empty() {
            return Err(self.wrong(0, "the name of an image"));
        }
        Ok(Row {
            line: self.line(),
            image: folder.join(name),
            kind,
            exposure: self.exposure()?,
            over: 1.0,
        })
    }

    fn exposure(&self) -> Result<Option<f64>, ManifestError> {
        let given = self.columns.exposure.and_then(|at| self.record.get(at));
        let Some(given) = given.filter(|given| !given.is_empty()) else {
            return Ok(None);
        };
        let value = f64::from_str(given)
            .ok()
            .filter(|v| *v > 0.0 && v.is_finite());
        let wrong = || ManifestError::Value {
            file: self.file.to_owned(),
            line: self.line(),
            field: EXPOSURE,
            expected: "a finite number > 0, or empty where the file's EXIF tells",
            got: given.to_owned(),
        };
        value.map(Some).ok_or_else(wrong)
    }

    fn light_pct(&self) -> Result<f64, ManifestError> {
        let given = self.number(4, PERCENT)?;
        Ok(self.levels.map_or(given, |curve| curve.light_pct(given)))
    }

    fn cell(&self, column: usize) -> &str {
        self.record.get(self.columns.at[column]).unwrap_or("")
    }

    fn line(&self) -> u64 {
        self.record.position().map_or(0, |position| position.line())
    }

    fn number(&self, column: usize, allowed: Allowed) -> Result<f64, ManifestError> {
        f64::from_str(self.cell(column))
            .ok()
            .filter(|value| (allowed.accepts)(*value))
            .ok_or_else(|| self.wrong(column, allowed.expected))
    }

    fn optional(&self, column: usize, allowed: Allowed) -> Result<Option<f64>, ManifestError> {
        match self.cell(column) {
            "" => Ok(None),
            _ => self.number(column, allowed).map(Some),
        }
    }

    fn wrong(&self, column: usize, expected: &'static str) -> ManifestError {
        ManifestError::Value {
            file: self.file.to_owned(),
            line: self.line(),
            field: match (column, self.levels) {
                (4, Some(_)) => LEVEL,
                _ => COLUMNS[column],
            },
            expected,
            got: self.cell(column).to_owned(),
        }
    }
}

/// What a number may be, in words and as a test.
#[derive(Clone, Copy)]
struct Allowed {
    expected: &'static str,
    accepts: fn(f64) -> bool,
}

const DEPTH_M: Allowed = Allowed {
    expected: "a finite number >= 0 (metres)",
    accepts: |v| v.is_finite() && v >= 0.0,
};
const POSITIVE_M: Allowed = Allowed {
    expected: "a finite number > 0 (metres)",
    accepts: |v| v.is_finite() && v > 0.0,
};
const PERCENT: Allowed = Allowed {
    expected: "a number from 0 to 100 (percent)",
    accepts: |v| (0.0..=100.0).contains(&v),
};

#[cfg(test)]
mod tests;
