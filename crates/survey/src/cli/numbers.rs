//! Columns of numbers as text: reading the first column of a file, printing to a number of significant digits.

use std::fs;
use std::io::{self, Read};
use std::ops::RangeInclusive;
use std::path::Path;

use super::error::CliError;

/// Reads the first column of a text or CSV file, `-` for standard input. Blank lines and lines that start with
/// `#` are passed over, and so is one header line. `name` and `unit` are for messages.
pub(crate) fn read_column(
    path: &Path,
    name: &str,
    unit: &str,
    range: &RangeInclusive<f64>,
) -> Result<Vec<f64>, CliError> {
    let (source, text) = if path == Path::new("-") {
        let mut text = String::new();
        let read = io::stdin().read_to_string(&mut text);
        ("standard input".to_owned(), read.map(|_| text))
    } else {
        (path.display().to_string(), fs::read_to_string(path))
    };
    let text =
        text.map_err(|error| CliError::input(format!("{source}: cannot be read: {error}")))?;
    parse_column(&text, name, unit, range)
        .map_err(|error| CliError::input(format!("{source}{error}")))
}

fn parse_column(
    text: &str,
    name: &str,
    unit: &str,
    range: &RangeInclusive<f64>,
) -> Result<Vec<f64>, String> {
    let mut values = Vec::new();
    let mut may_be_header = true;
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let field = line.split([',', ';', '\t', ' ']).next().unwrap_or_default();
        match field.trim_matches('"').parse::<f64>() {
            Ok(value) if range.contains(&value) => values.push(value),
            Err(_) if may_be_header => {}
            _ => {
                let (from, to) = (range.start(), range.end());
                return Err(format!(
                    ":{}: {name} must be a number in [{from}, {to}]{unit}, got {field:?}",
                    index + 1
                ));
            }
        }
        may_be_header = false;
    }
    if values.is_empty() {
        return Err(format!(": must hold one {name} per line, got none"));
    }
    Ok(values)
}

/// A number to `digits` significant digits without trailing zeros, `inf` and `NaN` as such.
pub(crate) fn significant(value: f64, digits: usize) -> String {
    let scientific = format!("{value:.*e}", digits.saturating_sub(1));
    // Rust reads every number that it prints.
    let rounded = scientific.parse::<f64>().unwrap_or(value);
    let magnitude = rounded.abs();
    if !rounded.is_finite() || magnitude == 0.0 || (1e-5..1e15).contains(&magnitude) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_significant_digits() {
        for (value, digits, expected) in [
            (0.1, 12, "0.1"),
            (0.388_000_000_000_000_06, 12, "0.388"),
            (1.0 / 3.0, 9, "0.333333333"),
            (1.234_567_890_123_456e-7, 12, "1.23456789012e-7"),
            (2.0e20 / 3.0, 12, "6.66666666667e19"),
            (-123_456.789_012, 9, "-123456.789"),
            (99_999.999_99, 9, "100000"),
            (0.0, 12, "0"),
            (f64::INFINITY, 12, "inf"),
        ] {
            assert_eq!(significant(value, digits), expected);
        }
    }

    #[test]
    fn a_column_may_have_a_header_comments_and_neighbours() {
        let text = "\u{feff}# angles\nangle_deg,weight\n\n0.1,7\n 1e-6 ;x\n180\t3\n\"2\",\n";
        let column = parse_column(text, "angle_deg", " degrees", &(0.0..=180.0));
        assert_eq!(column, Ok(vec![0.1, 1e-6, 180.0, 2.0]));
    }

    #[test]
    fn what_is_no_number_in_the_range_is_refused_with_its_line() {
        let read = |text| parse_column(text, "angle_deg", " degrees", &(0.0..=180.0));
        for (text, line, got) in [
            ("1\n2\nthree\n", 3, "three"),
            ("a\nb\n", 2, "b"),
            ("angle\nNaN\n", 2, "NaN"),
            ("NaN\n", 1, "NaN"),
            ("-1\n", 1, "-1"),
            ("1\n180.1\n", 2, "180.1"),
        ] {
            let expected =
                format!(":{line}: angle_deg must be a number in [0, 180] degrees, got {got:?}");
            assert_eq!(read(text), Err(expected));
        }
        for text in ["", "angle_deg\n", "# 1\n"] {
            assert_eq!(
                read(text),
                Err(": must hold one angle_deg per line, got none".to_owned())
            );
        }
    }
}
