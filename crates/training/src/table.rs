//! Stage 2: the dataset file as rows of numbers, checked field by field.

use std::collections::HashMap;
use std::fs::File;
use std::path::{Path, PathBuf};

use crate::Error;
use crate::card::Pictures;
use crate::columns::{ENVIRONMENT, INPUTS, OUTPUT_NAMES, OUTPUTS, Offsets, STD_ERRORS, inputs};
use crate::parquet_file::ParquetFile;

/// Fewest rows that are accepted; a smaller table is a mistake, not a dataset.
pub const LEAST_ROWS: usize = 10;

/// Files that are looked for when the dataset is given as a folder; the first one there is read.
pub const FILES_IN_FOLDER: [&str; 2] = ["dataset.parquet", "dataset.csv"];

/// A dataset in memory.
#[derive(Clone, Debug)]
pub struct Table {
    /// How candidate distance and lamp level are given in `inputs`.
    pub offsets: Offsets,
    /// Input values per row, in the order and units of [`inputs`]; all finite.
    pub inputs: Vec<[f32; INPUTS]>,
    /// Contrast after the move per row, R, G, B in 8-bit counts; all finite.
    pub contrast: Vec<[f32; OUTPUTS]>,
    /// Where each row comes from; `None` when the file has no such column.
    pub environments: Option<Environments>,
    /// Standard errors of the inputs `std_*` per row, 8-bit counts, infinite where unknown; `None` when the file has no
    /// such columns.
    pub std_errors: Option<Vec<[f32; OUTPUTS]>>,
    /// What its manifest says about the pictures.
    pub pictures: Option<Pictures>,
}

/// The environments (texture, water and backscatter) of a table's rows.
#[derive(Clone, Debug)]
pub struct Environments {
    /// Different environments, in order of first appearance.
    pub names: Vec<String>,
    /// Per row the index into `names`.
    pub of_row: Vec<usize>,
}

/// The file that holds the dataset: `path` itself, or one of [`FILES_IN_FOLDER`] in the folder `path`.
pub fn dataset_file(path: &Path) -> PathBuf {
    if !path.is_dir() {
        return path.to_path_buf();
    }
    let files = FILES_IN_FOLDER.map(|name| path.join(name));
    let there = files.iter().find(|file| file.is_file());
    there.unwrap_or(&files[1]).clone()
}

impl Table {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.inputs.len()
    }

    /// Reads a dataset: a Parquet file (by its ending), a CSV file with a header, or a folder that holds one of
    /// [`FILES_IN_FOLDER`]. Columns other than the inputs, the outputs and `environment` are ignored.
    ///
    /// # Errors
    /// When the file cannot be read, a column is missing or doubled, a field is not a finite
    /// number (with its line), or there are fewer than [`LEAST_ROWS`] rows.
    pub fn read(path: &Path, offsets: Offsets) -> Result<Self, Error> {
        let path = dataset_file(path);
        if path.extension().is_some_and(|e| e == "parquet") {
            return Self::read_parquet(&path, offsets);
        }
        let file = File::open(&path).map_err(|source| Error::Read {
            path: path.clone(),
            source,
        })?;
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_reader(std::io::BufReader::with_capacity(1 << 16, file));
        let csv_error = |source| Error::Csv {
            path: path.clone(),
            source,
        };
        let header = reader.headers().map_err(csv_error)?.clone();
        let names: Vec<&str> = header.iter().collect();
        let layout = Layout::find(&path, &names, offsets)?;

        let mut rows = RowsSoFar::default();
        let mut record = csv::StringRecord::new();
        while reader.read_record(&mut record).map_err(csv_error)? {
            let line = record.position().map_or(0, csv::Position::line);
            rows.push(
                &layout,
                &Row {
                    path: &path,
                    line,
                    record: &record,
                },
            )?;
        }
        rows.finish(&path, &layout, offsets)
    }

    fn read_parquet(path: &Path, offsets: Offsets) -> Result<Self, Error> {
        let file = ParquetFile::open(path)?;
        let names = file.names();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let layout = Layout::find(path, &names, offsets)?;
        let mut rows = RowsSoFar {
            inputs: columns(path, &file, &layout.inputs)?,
            contrast: columns(path, &file, &layout.contrast)?,
            std_errors: match &layout.std_errors {
                Some(wanted) => parquet_errors(&file, wanted)?,
                None => Vec::new(),
            },
            ..RowsSoFar::default()
        };
        if let Some(at) = layout.environment {
            for (row, name) in file.words(at)?.into_iter().enumerate() {
                if name.is_empty() {
                    return Err(Error::EmptyEnvironment {
                        path: path.to_path_buf(),
                        line: row as u64 + 1,
                    });
                }
                let index = rows.environment(&name);
                rows.of_row.push(index);
            }
        }
        rows.finish(path, &layout, offsets)
    }
}

/// Columns of numbers as rows, all finite.
fn columns<const N: usize>(
    path: &Path,
    file: &ParquetFile<'_>,
    wanted: &[(&'static str, usize)],
) -> Result<Vec<[f32; N]>, Error> {
    let mut rows: Vec<[f32; N]> = Vec::new();
    for (k, &(column, at)) in wanted.iter().enumerate() {
        let values = file.numbers(at)?;
        if let Some(row) = values.iter().position(|v| !v.is_finite()) {
            return Err(Error::NotFinite {
                path: path.to_path_buf(),
                line: row as u64 + 1,
                column,
                got: values[row].to_string(),
            });
        }
        rows.resize(values.len(), [0.0; N]);
        rows.iter_mut()
            .zip(values)
            .for_each(|(row, value)| row[k] = value);
    }
    Ok(rows)
}

/// Standard errors, which need not be known: infinite where they are no numbers.
fn parquet_errors(
    file: &ParquetFile<'_>,
    wanted: &[(&'static str, usize); OUTPUTS],
) -> Result<Vec<[f32; OUTPUTS]>, Error> {
    let mut rows: Vec<[f32; OUTPUTS]> = Vec::new();
    for (k, &(_, at)) in wanted.iter().enumerate() {
        let values = file.numbers(at)?;
        rows.resize(values.len(), [f32::INFINITY; OUTPUTS]);
        rows.iter_mut()
            .zip(values)
            .for_each(|(row, value)| row[k] = known(Some(value)));
    }
    Ok(rows)
}

/// A standard error, infinite where there is none.
fn known(error: Option<f32>) -> f32 {
    error
        .filter(|error| error.is_finite())
        .unwrap_or(f32::INFINITY)
}

/// Name and position in the file of every column that is read.
struct Layout {
    inputs: Vec<(&'static str, usize)>,
    contrast: [(&'static str, usize); OUTPUTS],
    std_errors: Option<[(&'static str, usize); OUTPUTS]>,
    environment: Option<usize>,
}

impl Layout {
    fn find(path: &Path, header: &[&str], offsets: Offsets) -> Result<Self, Error> {
        let needed = |column: &'static str, hint| {
            position(path, header, column)?.ok_or_else(|| Error::MissingColumn {
                path: path.to_path_buf(),
                column,
                hint,
                found: header.join(", "),
            })
        };
        let mut found = Self {
            inputs: inputs(offsets)
                .into_iter()
                .map(|input| (input.name, 0))
                .collect(),
            contrast: OUTPUT_NAMES.map(|name| (name, 0)),
            std_errors: std_errors(path, header)?,
            environment: position(path, header, ENVIRONMENT)?,
        };
        for (name, at) in &mut found.inputs {
            let hint = match *name {
                "delta_distance" | "delta_light" => Some("or train with --inputs target"),
                "target_distance" | "target_light" => Some("or train with --inputs delta"),
                _ => None,
            };
            *at = needed(name, hint)?;
        }
        for (name, at) in &mut found.contrast {
            *at = needed(name, None)?;
        }
        Ok(found)
    }
}

/// Where the standard errors of `std_*` stand in the header, if all of them do.
fn std_errors(
    path: &Path,
    header: &[&str],
) -> Result<Option<[(&'static str, usize); OUTPUTS]>, Error> {
    let mut found = STD_ERRORS.map(|name| (name, 0));
    for (name, at) in &mut found {
        match position(path, header, name)? {
            Some(column) => *at = column,
            None => return Ok(None),
        }
    }
    Ok(Some(found))
}

/// Where `column` stands in the header, if it does.
fn position(path: &Path, header: &[&str], column: &'static str) -> Result<Option<usize>, Error> {
    let mut columns = (0..header.len()).filter(|&at| header[at] == column);
    let first = columns.next();
    match columns.next() {
        None => Ok(first),
        Some(_) => Err(Error::DuplicateColumn {
            path: path.to_path_buf(),
            column,
        }),
    }
}

/// One line of the file.
struct Row<'a> {
    path: &'a Path,
    line: u64,
    record: &'a csv::StringRecord,
}

impl Row<'_> {
    fn field(&self, at: usize) -> &str {
        self.record.get(at).unwrap_or_default()
    }

    /// The value of a column; what overflows a 32-bit float is not finite either.
    fn number(&self, (column, at): (&'static str, usize)) -> Result<f32, Error> {
        let text = self.field(at);
        match text.parse::<f32>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(Error::NotFinite {
                path: self.path.to_path_buf(),
                line: self.line,
                column,
                got: text.to_owned(),
            }),
        }
    }

    fn numbers<const N: usize>(
        &self,
        columns: &[(&'static str, usize)],
    ) -> Result<[f32; N], Error> {
        let mut values = [0.0; N];
        for (value, column) in values.iter_mut().zip(columns) {
            *value = self.number(*column)?;
        }
        Ok(values)
    }
}

/// The rows read until now.
#[derive(Default)]
struct RowsSoFar {
    inputs: Vec<[f32; INPUTS]>,
    contrast: Vec<[f32; OUTPUTS]>,
    std_errors: Vec<[f32; OUTPUTS]>,
    index_of: HashMap<String, usize>,
    names: Vec<String>,
    of_row: Vec<usize>,
}

impl RowsSoFar {
    fn push(&mut self, layout: &Layout, row: &Row<'_>) -> Result<(), Error> {
        self.inputs.push(row.numbers(&layout.inputs)?);
        self.contrast.push(row.numbers(&layout.contrast)?);
        if let Some(columns) = &layout.std_errors {
            let error = |&(_, at): &(&str, usize)| known(row.field(at).parse().ok());
            self.std_errors.push(columns.each_ref().map(error));
        }
        if let Some(at) = layout.environment {
            let name = row.field(at);
            if name.is_empty() {
                return Err(Error::EmptyEnvironment {
                    path: row.path.to_path_buf(),
                    line: row.line,
                });
            }
            let index = self.environment(name);
            self.of_row.push(index);
        }
        Ok(())
    }

    /// The index of an environment, new or seen before.
    fn environment(&mut self, name: &str) -> usize {
        if let Some(&index) = self.index_of.get(name) {
            return index;
        }
        let index = self.names.len();
        self.names.push(name.to_owned());
        self.index_of.insert(name.to_owned(), index);
        index
    }

    fn finish(self, path: &Path, layout: &Layout, offsets: Offsets) -> Result<Table, Error> {
        if self.inputs.len() < LEAST_ROWS {
            return Err(Error::TooFewRows {
                path: path.to_path_buf(),
                least: LEAST_ROWS,
                got: self.inputs.len(),
            });
        }
        let (names, of_row) = (self.names, self.of_row);
        Ok(Table {
            offsets,
            inputs: self.inputs,
            contrast: self.contrast,
            environments: layout.environment.map(|_| Environments { names, of_row }),
            std_errors: layout.std_errors.map(|_| self.std_errors),
            pictures: None,
        })
    }
}
