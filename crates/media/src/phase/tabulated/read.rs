//! Reading and checking the rows of a phase function table.

use std::path::Path;

use super::{Forward, Row, Tabulated};
use crate::error::MediaError;

impl Tabulated {
    /// From a CSV file with two columns, angle in degrees and phase function in any unit. Lines that
    /// start with `#` are comments; one line of column names may come before the numbers.
    pub fn from_csv(path: &Path) -> Result<Self, MediaError> {
        let source_name = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|error| MediaError::BadTable {
            source_name: source_name.clone(),
            problem: format!("cannot be read: {error}"),
        })?;
        Self::from_csv_text(&text, &source_name)
    }

    /// As [`Tabulated::from_csv`], from text; `source_name` is what errors call it.
    pub fn from_csv_text(text: &str, source_name: &str) -> Result<Self, MediaError> {
        Self::build(&parse(text, source_name)?, Forward::FromTable, source_name)
    }
}

fn parse(text: &str, source_name: &str) -> Result<Vec<Row>, MediaError> {
    let mut rows = Vec::new();
    let mut may_be_header = true;
    for (i, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        match parse_line(line) {
            Some((angle_deg, value)) => rows.push(Row {
                angle_deg,
                value,
                number: i + 1,
            }),
            None if may_be_header => {}
            None => {
                return Err(bad_row(
                    source_name,
                    i + 1,
                    format!("must be two numbers, angle_deg,value, got {line:?}"),
                ));
            }
        }
        may_be_header = false;
    }
    Ok(rows)
}

fn parse_line(line: &str) -> Option<(f64, f64)> {
    let (angle, value) = line.split_once(',')?;
    Some((angle.trim().parse().ok()?, value.trim().parse().ok()?))
}

/// At least two rows, angles increasing in [0, 180], values finite and >= 0, not all 0.
pub(super) fn check_rows(rows: &[Row], source_name: &str) -> Result<(), MediaError> {
    if rows.len() < 2 {
        return Err(MediaError::BadTable {
            source_name: source_name.to_owned(),
            problem: format!("needs at least two rows, got {}", rows.len()),
        });
    }
    for row in rows {
        if !(0.0..=180.0).contains(&row.angle_deg) {
            let problem = format!(
                "the angle must be in [0, 180] degrees, got {}",
                row.angle_deg
            );
            return Err(bad_row(source_name, row.number, problem));
        }
        if !(row.value.is_finite() && row.value >= 0.0) {
            let problem = format!("the value must be finite and >= 0, got {}", row.value);
            return Err(bad_row(source_name, row.number, problem));
        }
    }
    for pair in rows.windows(2) {
        if pair[1].angle_deg <= pair[0].angle_deg {
            let problem = format!(
                "angles must increase, got {} after {}",
                pair[1].angle_deg, pair[0].angle_deg
            );
            return Err(bad_row(source_name, pair[1].number, problem));
        }
    }
    Ok(())
}

fn bad_row(source_name: &str, row: usize, problem: String) -> MediaError {
    MediaError::BadRow {
        source_name: source_name.to_owned(),
        row,
        problem,
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::PhaseFunction;
    use super::*;

    fn error(text: &str) -> Result<(), String> {
        Tabulated::from_csv_text(text, "vsf.csv")
            .map(|_| ())
            .map_err(|e| e.to_string())
    }

    #[test]
    fn reads_comments_header_and_rows() -> Result<(), MediaError> {
        let text = "# my station\nangle_deg,vsf\n1, 50\n10,1\n\n180,0.01\n";
        let table = Tabulated::from_csv_text(text, "vsf.csv")?;
        assert!(table.value(1e-5) > 20.0 * table.value(0.01));
        Ok(())
    }

    #[test]
    fn says_which_row_is_wrong_and_why() {
        let cases = [
            ("1,2\n", "vsf.csv: needs at least two rows, got 1"),
            ("", "vsf.csv: needs at least two rows, got 0"),
            (
                "a,b\n1,2\nx,3\n",
                "vsf.csv, row 3: must be two numbers, angle_deg,value, got \"x,3\"",
            ),
            (
                "1,2\n181,1\n",
                "vsf.csv, row 2: the angle must be in [0, 180] degrees, got 181",
            ),
            (
                "5,2\n5,1\n",
                "vsf.csv, row 2: angles must increase, got 5 after 5",
            ),
            (
                "1,2\n2,-1\n",
                "vsf.csv, row 2: the value must be finite and >= 0, got -1",
            ),
            (
                "1,2\n2,NaN\n",
                "vsf.csv, row 2: the value must be finite and >= 0, got NaN",
            ),
            (
                "0,0\n180,0\n",
                "vsf.csv: the integral must be finite and > 0, got 0",
            ),
            (
                "1,100\n10,0.01\n",
                "vsf.csv: the first two rows fall as the angle to the power -4.002, whose integral \
                 from 0° on is infinite; it must be > -2, or the table must start at 0°",
            ),
        ];
        for (text, expected) in cases {
            assert_eq!(error(text), Err(expected.to_owned()));
        }
        assert!(Tabulated::from_csv(Path::new("no/such/file.csv")).is_err());
    }
}
