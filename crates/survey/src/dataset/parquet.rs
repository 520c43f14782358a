//! The table as Parquet: columns with units and meanings, one row group.

use std::io::Write;
use std::sync::Arc;

use parquet::basic::{Compression, ConvertedType, GzipLevel, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, FloatType};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{Type, TypePtr};

use super::table::{Column, Entries, WORDS, numbers};
use super::{DatasetError, PARQUET_TABLE};

/// All entries as the bytes of a file.
pub(super) fn bytes(entries: &[Entries]) -> Result<Vec<u8>, DatasetError> {
    let mut bytes = Vec::new();
    fill(&mut bytes, entries).map_err(|e| {
        DatasetError::Inconsistent(format!("{PARQUET_TABLE}: cannot be encoded: {e}"))
    })?;
    Ok(bytes)
}

fn fill(out: &mut (impl Write + Send), entries: &[Entries]) -> Result<(), ParquetError> {
    let properties = WriterProperties::builder()
        .set_compression(Compression::GZIP(GzipLevel::default()))
        .set_created_by(concat!("uw ", env!("CARGO_PKG_VERSION")).to_owned())
        .set_key_value_metadata(Some(descriptions()))
        .build();
    let mut file = SerializedFileWriter::new(out, schema()?, Arc::new(properties))?;
    let mut group = file.next_row_group()?;
    for word in 0..WORDS.len() {
        let values: Vec<ByteArray> = entries
            .iter()
            .flat_map(|e| {
                std::iter::repeat_n(ByteArray::from(e.words[word].as_str()), e.rows.len())
            })
            .collect();
        if let Some(mut column) = group.next_column()? {
            column
                .typed::<ByteArrayType>()
                .write_batch(&values, None, None)?;
            column.close()?;
        }
    }
    for number in 0..numbers().len() {
        let values: Vec<f32> = entries
            .iter()
            .flat_map(|e| e.rows.iter().map(move |row| row[number]))
            .collect();
        if let Some(mut column) = group.next_column()? {
            column
                .typed::<FloatType>()
                .write_batch(&values, None, None)?;
            column.close()?;
        }
    }
    group.close()?;
    file.close()?;
    Ok(())
}

fn schema() -> Result<TypePtr, ParquetError> {
    let words = WORDS.iter().map(|c| {
        Type::primitive_type_builder(c.name, Physical::BYTE_ARRAY)
            .with_repetition(Repetition::REQUIRED)
            .with_converted_type(ConvertedType::UTF8)
            .build()
    });
    let numbers = numbers();
    let numbers = numbers.iter().map(|c| {
        Type::primitive_type_builder(c.name, Physical::FLOAT)
            .with_repetition(Repetition::REQUIRED)
            .build()
    });
    let fields: Result<Vec<TypePtr>, ParquetError> =
        words.chain(numbers).map(|t| t.map(Arc::new)).collect();
    Ok(Arc::new(
        Type::group_type_builder("entry")
            .with_fields(fields?)
            .build()?,
    ))
}

/// Unit and meaning of every column, as the file's key-value metadata.
fn descriptions() -> Vec<KeyValue> {
    let describe = |c: &Column| {
        let unit = if c.unit.is_empty() { "word" } else { c.unit };
        KeyValue::new(c.name.to_owned(), format!("{unit}; {}", c.meaning))
    };
    WORDS.iter().chain(&numbers()).map(describe).collect()
}
