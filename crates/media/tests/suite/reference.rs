//! Reads the reference numbers of `tests/data`.

use std::collections::HashMap;

/// Rows of a CSV file as maps from column name to text.
pub(crate) fn rows(file: &str) -> Vec<HashMap<String, String>> {
    let path = format!("{}/tests/data/{file}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let rows: Vec<_> = lines
        .map(|line| {
            let cells = line.split(',').map(str::to_owned);
            names
                .iter()
                .map(|name| (*name).to_owned())
                .zip(cells)
                .collect()
        })
        .collect();
    assert!(!rows.is_empty(), "{path} holds no rows");
    rows
}

/// A number of a row.
pub(crate) fn number(row: &HashMap<String, String>, name: &str) -> f64 {
    row[name]
        .parse()
        .unwrap_or_else(|_| panic!("{name}: {:?}", row[name]))
}

/// Fails unless `got` is within `tolerance` of `expected`, relative to it.
#[track_caller]
pub(crate) fn assert_relative(got: f64, expected: f64, tolerance: f64, what: &str) {
    let error = (got - expected).abs();
    assert!(
        error <= tolerance * expected.abs(),
        "{what}: got {got}, expected {expected}, relative error {:.2e} above {tolerance:.0e}",
        error / expected.abs()
    );
}
