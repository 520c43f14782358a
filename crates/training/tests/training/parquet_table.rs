//! The same table as Parquet and as text gives the same rows; broken files are refused.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use parquet::data_type::{ByteArray, ByteArrayType, FloatType};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use uw_training::{Error, Offsets, Table};

use crate::dataset;

/// Writes the text table as Parquet in two row groups, the environment as words and all else as floats.
fn write_parquet(path: &Path, text: &str) {
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let rows: Vec<Vec<&str>> = lines.map(|l| l.split(',').collect()).collect();
    let fields: String = header
        .iter()
        .map(|name| match *name {
            "environment" => format!("required binary {name} (UTF8);"),
            _ => format!("required float {name};"),
        })
        .collect();
    let schema = parse_message_type(&format!("message entry {{ {fields} }}")).expect("a schema");
    let file = File::create(path).expect("writable");
    let properties = Arc::new(WriterProperties::builder().build());
    let mut writer =
        SerializedFileWriter::new(file, Arc::new(schema), properties).expect("a writer");
    for part in rows.chunks(rows.len().div_ceil(2)) {
        let mut group = writer.next_row_group().expect("a row group");
        for (k, name) in header.iter().enumerate() {
            let mut column = group.next_column().expect("writable").expect("a column");
            if *name == "environment" {
                let words: Vec<ByteArray> =
                    part.iter().map(|row| ByteArray::from(row[k])).collect();
                column
                    .typed::<ByteArrayType>()
                    .write_batch(&words, None, None)
                    .expect("writable");
            } else {
                let numbers: Vec<f32> = part
                    .iter()
                    .map(|row| row[k].parse().expect("a number"))
                    .collect();
                column
                    .typed::<FloatType>()
                    .write_batch(&numbers, None, None)
                    .expect("writable");
            }
            column.close().expect("closed");
        }
        group.close().expect("closed");
    }
    writer.close().expect("closed");
}

#[test]
fn parquet_and_text_give_the_same_table() {
    let folder = dataset::empty_folder();
    let text = dataset::text(100);
    dataset::write(&folder, &text);
    let from_text = Table::read(&folder, Offsets::Target).expect("a valid table");
    let path = folder.join("dataset.parquet");
    write_parquet(&path, &text);
    // Of the two files in the folder Parquet is read.
    for place in [&path, &folder] {
        let table = Table::read(place, Offsets::Target).expect("a valid table");
        assert_eq!(table.inputs, from_text.inputs);
        assert_eq!(table.contrast, from_text.contrast);
        let (a, b) = (
            table.environments.expect("named"),
            from_text.environments.clone().expect("named"),
        );
        assert_eq!((a.names, a.of_row), (b.names, b.of_row));
    }
}

#[test]
fn what_is_no_parquet_table_is_refused() {
    let folder = dataset::empty_folder();
    let path = folder.join("dataset.parquet");
    std::fs::write(&path, "not a table").expect("writable");
    let refused = Table::read(&path, Offsets::Delta);
    assert!(matches!(refused, Err(Error::Parquet { .. })), "{refused:?}");
    write_parquet(&path, &dataset::text(100).replace("kz_g", "kz_x"));
    let refused = Table::read(&path, Offsets::Delta);
    assert!(
        matches!(refused, Err(Error::MissingColumn { column: "kz_g", .. })),
        "{refused:?}"
    );
}
