//! The tables in `assets/water`, embedded in the library. See the README there for their sources.

/// Petzold's average particle phase function.
pub(crate) const PETZOLD: &str = include_str!("../../../assets/water/petzold_average_particle.csv");
/// a and b of the ten Jerlov types, misprints repaired.
pub(crate) const JERLOV: &str = include_str!("../../../assets/water/jerlov_iop.csv");
/// The same table as printed.
pub(crate) const JERLOV_PUBLISHED: &str =
    include_str!("../../../assets/water/jerlov_iop_published.csv");
/// The repaired table resampled to 10 nm.
pub(crate) const JERLOV_10NM: &str = include_str!("../../../assets/water/jerlov_iop_10nm.csv");
/// Measured a and b of six Jerlov types.
pub(crate) const MEASURED: &str =
    include_str!("../../../assets/water/williamson_hollins_2022_iop.csv");
/// Types of each 10 m of depth, by the type at the surface.
pub(crate) const DEPTH_PROFILES: &str =
    include_str!("../../../assets/water/jerlov_depth_profiles.csv");
/// a and b of pure water.
pub(crate) const PURE_WATER: &str = include_str!("../../../assets/water/pure_water.csv");
/// Relative absorption of phytoplankton.
pub(crate) const CHLOROPHYLL: &str =
    include_str!("../../../assets/water/chlorophyll_absorption.csv");
/// Spectral responses of three cameras.
pub(crate) const CAMERAS: &str = include_str!("../../../assets/water/camera_responses.csv");
/// Spectral responses of eleven more.
pub(crate) const MORE_CAMERAS: &str =
    include_str!("../../../assets/spectra/camera_responses_rawtoaces.csv");
/// Relative spectra of lamps and daylight.
pub(crate) const ILLUMINANTS: &str = include_str!("../../../assets/spectra/lamp_spectra.csv");
/// Sun and sky by zenith angle.
pub(crate) const CLEAR_SKY: &str = include_str!("../../../assets/water/solar_clear_sky.csv");
/// Reflectances that linear sRGB mixes.
pub(crate) const RGB_PRIMARIES: &str = include_str!("../../../assets/spectra/rgb_primaries.csv");

/// One row of an embedded table.
pub(crate) struct TableRow {
    columns: Vec<&'static str>,
    cells: Vec<&'static str>,
}

impl TableRow {
    /// The cell under a column name, where the table has that column.
    pub(crate) fn text_if_there(&self, column: &str) -> Option<&'static str> {
        let i = self.columns.iter().position(|name| *name == column)?;
        self.cells.get(i).copied()
    }

    /// The cell under a column name; the embedded tables have every column that is asked for.
    pub(crate) fn text(&self, column: &str) -> &'static str {
        self.text_if_there(column)
            .unwrap_or_else(|| panic!("embedded table without column {column}"))
    }

    /// As [`TableRow::text`], as a number.
    pub(crate) fn number(&self, column: &str) -> f64 {
        let text = self.text(column);
        text.parse()
            .unwrap_or_else(|_| panic!("embedded table holds {text:?} under {column}"))
    }
}

/// The rows of an embedded table (none of its cells holds a comma).
pub(crate) fn rows(table: &'static str) -> impl Iterator<Item = TableRow> {
    let mut lines = table.lines().filter(|line| !line.starts_with('#'));
    let columns: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    lines.map(move |line| TableRow {
        columns: columns.clone(),
        cells: line.split(',').collect(),
    })
}
