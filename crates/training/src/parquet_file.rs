//! Stage 2, Parquet: columns by name, turned into the rows that the text table gives.

use std::fs::File;
use std::path::Path;

use parquet::column::reader::{ColumnReader, get_typed_column_reader};
use parquet::data_type::{ByteArrayType, DoubleType, FloatType};
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};

use crate::Error;

/// A Parquet file open for reading.
pub(crate) struct ParquetFile<'p> {
    path: &'p Path,
    reader: SerializedFileReader<File>,
}

impl<'p> ParquetFile<'p> {
    /// Opens a file.
    pub(crate) fn open(path: &'p Path) -> Result<Self, Error> {
        let file = File::open(path).map_err(|source| Error::Read {
            path: path.to_path_buf(),
            source,
        })?;
        let reader = SerializedFileReader::new(file).map_err(|e| damaged(path, &e))?;
        Ok(Self { path, reader })
    }

    /// Names of the columns in order.
    pub(crate) fn names(&self) -> Vec<String> {
        let schema = self.reader.metadata().file_metadata().schema_descr();
        schema
            .columns()
            .iter()
            .map(|c| c.name().to_owned())
            .collect()
    }

    /// All values of column `at`, which holds numbers.
    pub(crate) fn numbers(&self, at: usize) -> Result<Vec<f32>, Error> {
        self.collect(at, |reader, rows| match reader {
            ColumnReader::FloatColumnReader(_) => {
                let mut values = Vec::with_capacity(rows);
                get_typed_column_reader::<FloatType>(reader).read_records(
                    rows,
                    None,
                    None,
                    &mut values,
                )?;
                Ok(values)
            }
            ColumnReader::DoubleColumnReader(_) => {
                let mut values = Vec::with_capacity(rows);
                get_typed_column_reader::<DoubleType>(reader).read_records(
                    rows,
                    None,
                    None,
                    &mut values,
                )?;
                Ok(values.into_iter().map(|v| v as f32).collect())
            }
            _ => Err(ParquetError::General(
                "it must hold floating-point numbers".to_owned(),
            )),
        })
    }

    /// All values of column `at`, which holds words.
    pub(crate) fn words(&self, at: usize) -> Result<Vec<String>, Error> {
        self.collect(at, |reader, rows| match reader {
            ColumnReader::ByteArrayColumnReader(_) => {
                let mut values = Vec::with_capacity(rows);
                get_typed_column_reader::<ByteArrayType>(reader).read_records(
                    rows,
                    None,
                    None,
                    &mut values,
                )?;
                let words = values.iter().map(|v| v.as_utf8().map(str::to_owned));
                words.collect()
            }
            _ => Err(ParquetError::General("it must hold words".to_owned())),
        })
    }

    fn collect<T>(
        &self,
        at: usize,
        read: impl Fn(ColumnReader, usize) -> Result<Vec<T>, ParquetError>,
    ) -> Result<Vec<T>, Error> {
        let mut all = Vec::new();
        for group in 0..self.reader.num_row_groups() {
            let part = self.reader.get_row_group(group).and_then(|group| {
                let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
                let values = read(group.get_column_reader(at)?, rows)?;
                if values.len() == rows {
                    Ok(values)
                } else {
                    let (got, column) = (values.len(), group.metadata().column(at).column_path());
                    Err(ParquetError::General(format!(
                        "column {column} has {got} values in {rows} rows; none may be missing"
                    )))
                }
            });
            all.extend(part.map_err(|e| damaged(self.path, &e))?);
        }
        Ok(all)
    }
}

fn damaged(path: &Path, error: &ParquetError) -> Error {
    Error::Parquet {
        path: path.to_path_buf(),
        reason: error.to_string(),
    }
}
