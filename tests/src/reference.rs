//! Reference numbers kept in `data/`.

use crate::{discrete_ordinates::Travel, file, tiles::Tiles};

/// Reads `data/reference_NAME.csv`: tile means and standard errors of a converged picture.
///
/// # Panics
/// When the file is missing or malformed.
pub fn tiles(name: &str) -> Tiles {
    let mut tiles = Tiles {
        mean: Vec::new(),
        standard_error: Vec::new(),
    };
    for row in fields(&format!("reference_{name}")) {
        let v: Vec<f64> = row.iter().map(|x| number(x)).collect();
        tiles.mean.push([v[2], v[3], v[4]]);
        tiles.standard_error.push([v[5], v[6], v[7]]);
    }
    tiles
}

/// A row of `data/rt_irradiance_rayleigh.csv`.
#[derive(Clone, Debug, PartialEq)]
pub struct IrradianceRow {
    /// Single scattering albedo.
    pub albedo: f64,
    /// Optical depth.
    pub optical_depth: f64,
    /// E_d, E_u, E_od, E_ou or L_u.
    pub quantity: String,
    /// W/m², L_u in W/(m² sr).
    pub reference: f64,
    /// Mean over the seven models of Mobley et al. 1993, where they published one.
    pub published_mean: Option<f64>,
}

/// A row of `data/rt_radiance_rayleigh.csv`.
#[derive(Clone, Debug, PartialEq)]
pub struct RadianceRow {
    /// Single scattering albedo.
    pub albedo: f64,
    /// Optical depth of the camera.
    pub optical_depth: f64,
    /// Zenith angle of the view, degrees: 0 looks up.
    pub view_zenith_deg: f64,
    /// Azimuth of the view from that of the sunlight's travel, degrees.
    pub view_azimuth_deg: f64,
    /// W/(m² sr).
    pub reference: f64,
}

impl RadianceRow {
    /// The direction in which the light that is seen travels.
    pub fn travel(&self) -> Travel {
        Travel {
            down: self.view_zenith_deg.to_radians().cos(),
            azimuth_deg: self.view_azimuth_deg + 180.0,
        }
    }
}

/// Irradiances of the Rayleigh problem under unit sun at 60°.
pub fn rayleigh_irradiances() -> Vec<IrradianceRow> {
    fields("rt_irradiance_rayleigh")
        .iter()
        .map(|f| IrradianceRow {
            albedo: number(&f[0]),
            optical_depth: number(&f[1]),
            quantity: f[2].clone(),
            reference: number(&f[3]),
            published_mean: (!f[5].is_empty()).then(|| number(&f[5])),
        })
        .collect()
}

/// Radiances of the Rayleigh problem under unit sun at 60°.
pub fn rayleigh_radiances() -> Vec<RadianceRow> {
    fields("rt_radiance_rayleigh")
        .iter()
        .map(|f| RadianceRow {
            albedo: number(&f[0]),
            optical_depth: number(&f[1]),
            view_zenith_deg: number(&f[2]),
            view_azimuth_deg: number(&f[3]),
            reference: number(&f[4]),
        })
        .collect()
}

/// Fields of the rows of `data/NAME.csv` below its header.
fn fields(name: &str) -> Vec<Vec<String>> {
    let path = file(&format!("data/{name}.csv"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let row = |line: &str| line.split(',').map(str::to_owned).collect();
    text.lines().skip(1).map(row).collect()
}

fn number(field: &str) -> f64 {
    field
        .parse()
        .unwrap_or_else(|e| panic!("{field:?} is no number: {e}"))
}
