//! Tables of spectra that users bring: CSV with a wavelength in nm and one or more columns.

use thiserror::Error;

use super::Curve;

/// Wavelengths that a table may hold, nm.
const RANGE_NM: (f64, f64) = (200.0, 3000.0);
/// Widest step between neighbouring wavelengths, nm: beyond, a straight line says nothing of light in water.
const WIDEST_STEP_NM: f64 = 50.0;
/// Largest value.
const LARGEST: f64 = 1e12;

/// Why a table of spectra cannot be used.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum TableError {
    /// A row, or the header, is not what it should be.
    #[error("line {line}: {what}")]
    Line {
        /// Line, counted from 1.
        line: usize,
        /// What it must be and what it is.
        what: String,
    },
    /// There is no header or are not enough rows.
    #[error("must have the header {header} and at least two rows, got {rows} rows")]
    Short {
        /// The columns expected.
        header: String,
        /// Rows found.
        rows: usize,
    },
}

/// Reads the columns named in `columns` after `wavelength_nm`; lines that start with `#` and empty ones are passed over.
///
/// # Errors
/// Another header, cells that are no numbers, wavelengths that do not rise or are not in nm, gaps of more than 50 nm, negative
/// values, values above `largest`.
pub fn read_columns<const N: usize>(
    text: &str,
    columns: [&str; N],
    largest: Option<f64>,
) -> Result<[Curve; N], TableError> {
    let mut expected = vec!["wavelength_nm"];
    expected.extend(columns);
    let mut lines = text
        .lines()
        .enumerate()
        .map(|(i, line)| (i + 1, line.trim_start_matches('\u{feff}').trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let short = |rows| TableError::Short {
        header: expected.join(","),
        rows,
    };
    let (line, header) = lines.next().ok_or_else(|| short(0))?;
    let names: Vec<&str> = header.split(',').map(str::trim).collect();
    let column_of = |name: &str| {
        let column = names.iter().position(|n| n.eq_ignore_ascii_case(name));
        column.ok_or_else(|| TableError::Line {
            line,
            what: format!(
                "the header must have the columns {}, got {header}",
                expected.join(",")
            ),
        })
    };
    let wanted: Vec<usize> = expected
        .iter()
        .map(|name| column_of(name))
        .collect::<Result<_, _>>()?;
    let mut rows: Vec<(f64, [f64; N])> = Vec::new();
    for (line, text) in lines {
        let before = rows.last().map(|row| row.0);
        let row = read_row(text, &wanted, names.len())
            .and_then(|row| check_row::<N>(&row, before, largest.unwrap_or(LARGEST), &columns))
            .map_err(|what| TableError::Line { line, what })?;
        rows.push(row);
    }
    if rows.len() < 2 {
        return Err(short(rows.len()));
    }
    Ok(std::array::from_fn(|k| {
        Curve::new(rows.iter().map(|(nm, values)| (*nm, values[k])).collect())
    }))
}

fn read_row(text: &str, wanted: &[usize], columns: usize) -> Result<Vec<f64>, String> {
    let cells: Vec<&str> = text.split(',').map(str::trim).collect();
    if cells.len() != columns {
        return Err(format!(
            "must have {columns} numbers as the header has, got {}: {text}",
            cells.len()
        ));
    }
    let number = |&column: &usize| {
        let cell = cells[column];
        let value: Option<f64> = cell.parse().ok().filter(|value: &f64| value.is_finite());
        value.ok_or_else(|| format!("must hold finite numbers, got {cell:?}"))
    };
    wanted.iter().map(number).collect()
}

fn check_row<const N: usize>(
    row: &[f64],
    before_nm: Option<f64>,
    largest: f64,
    columns: &[&str; N],
) -> Result<(f64, [f64; N]), String> {
    let nm = row[0];
    if !(RANGE_NM.0..=RANGE_NM.1).contains(&nm) {
        return Err(format!(
            "the wavelength must be in nm, {} to {}, got {nm}",
            RANGE_NM.0, RANGE_NM.1
        ));
    }
    if let Some(before) = before_nm {
        if nm <= before {
            return Err(format!(
                "wavelengths must rise from row to row, got {nm} after {before}"
            ));
        }
        if nm - before > WIDEST_STEP_NM {
            return Err(format!(
                "neighbouring wavelengths must be at most {WIDEST_STEP_NM} nm apart, got {before} and {nm}"
            ));
        }
    }
    for (value, name) in row[1..].iter().zip(columns) {
        if !(0.0..=largest).contains(value) {
            return Err(format!("{name} must be in [0, {largest}], got {value}"));
        }
    }
    Ok((nm, std::array::from_fn(|k| row[k + 1])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_by_name() {
        let text = "# lamp\nwavelength_nm, relative,other\n\n400,0.5,7\n450, 1,8\n";
        let [curve] = read_columns(text, ["relative"], None).expect("valid");
        assert_eq!(curve.nodes(), [(400.0, 0.5), (450.0, 1.0)]);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let cases = [
            ("", "must have the header wavelength_nm,x"),
            ("wavelength_nm,x\n400,1\n", "got 1 rows"),
            (
                "nm,x\n400,1\n410,1\n",
                "line 1: the header must have the columns wavelength_nm,x, got nm,x",
            ),
            (
                "wavelength_nm,x\n0.40,1\n0.41,1\n",
                "line 2: the wavelength must be in nm, 200 to 3000, got 0.4",
            ),
            (
                "wavelength_nm,x\n410,1\n400,1\n",
                "line 3: wavelengths must rise from row to row, got 400 after 410",
            ),
            ("wavelength_nm,x\n400,1\n400,1\n", "got 400 after 400"),
            (
                "wavelength_nm,x\n400,1\n460,1\n",
                "line 3: neighbouring wavelengths must be at most 50 nm apart, got 400 and 460",
            ),
            (
                "# c\nwavelength_nm,x\n400,1\n410,-1\n",
                "line 4: x must be in [0, 2], got -1",
            ),
            (
                "wavelength_nm,x\n400,1\n410,3\n",
                "x must be in [0, 2], got 3",
            ),
            ("wavelength_nm,x\n400,1\n410,nan\n", "got \"nan\""),
            (
                "wavelength_nm,x\n400,1\n410\n",
                "line 3: must have 2 numbers",
            ),
            (
                "wavelength_nm,x\n400,1\n410,1,2\n",
                "line 3: must have 2 numbers",
            ),
        ];
        for (text, expected) in cases {
            let error = read_columns(text, ["x"], Some(2.0)).expect_err(text);
            assert!(error.to_string().contains(expected), "{text}: {error}");
        }
    }
}
