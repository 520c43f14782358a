//! Reference numbers kept in `data/`.

use uw_media::phase::{FournierForand, Phase, Tabulated};

use crate::{
    discrete_ordinates::{Level, Travel},
    file,
    same_numbers::Means,
    tiles::Tiles,
};

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

/// A water of `data/rt_layered.csv`, of refractive index 1.34, under a flat surface, a black sky and a sun of 1 W/m² on a
/// plane perpendicular to its beam.
pub struct LayeredCase {
    /// Its name.
    pub name: String,
    /// The water at some depths, straight lines between them; 0.1 mm in the table is a jump.
    pub levels: Vec<Level>,
    /// Phase function at all depths.
    pub phase: Phase,
    /// What is known of its light.
    pub rows: Vec<LayeredRow>,
    /// Zenith angle of the sun in air, degrees.
    pub sun_zenith_deg: f64,
}

/// A row of `data/rt_layered.csv`.
#[derive(Clone, Debug, PartialEq)]
pub struct LayeredRow {
    /// Depth, m.
    pub depth_m: f64,
    /// E_d, E_u, E_ou or L_u.
    pub quantity: String,
    /// W/m², L_u in W/(m² sr).
    pub reference: f64,
    /// Uncertainty relative to it.
    pub relative_uncertainty: f64,
}

impl LayeredCase {
    /// Depths of the rows, increasing, m.
    pub fn depths_m(&self) -> Vec<f64> {
        let mut depths_m: Vec<f64> = self.rows.iter().map(|row| row.depth_m).collect();
        depths_m.dedup();
        depths_m
    }

    /// The row of a quantity at a depth.
    pub fn row(&self, depth_m: f64, quantity: &str) -> Option<&LayeredRow> {
        let is_this = |row: &&LayeredRow| row.depth_m == depth_m && row.quantity == quantity;
        self.rows.iter().find(is_this)
    }
}

/// Irradiances in layered waters.
pub fn layered_irradiances() -> Vec<LayeredCase> {
    let mut cases: Vec<LayeredCase> = Vec::new();
    for f in fields("rt_layered") {
        assert_eq!(f[3], "1.34", "refractive index of {}", f[0]);
        if cases.last().is_none_or(|case| case.name != f[0]) {
            cases.push(LayeredCase {
                name: f[0].clone(),
                phase: layered_phase(&f[1]),
                sun_zenith_deg: number(&f[2]),
                levels: levels(&f[4]),
                rows: Vec::new(),
            });
        }
        cases.last_mut().expect("just added").rows.push(LayeredRow {
            depth_m: number(&f[5]),
            quantity: f[6].clone(),
            reference: number(&f[7]),
            relative_uncertainty: number(&f[8]),
        });
    }
    cases
}

/// The phase functions of that table.
fn layered_phase(name: &str) -> Phase {
    match name {
        "petzold" => Phase::Tabulated(Tabulated::petzold()),
        "fournier_forand n=1.10 B=0.0183" => {
            Phase::FournierForand(FournierForand::new(1.10, 0.0183).expect("valid"))
        }
        other => panic!("unknown phase function {other}"),
    }
}

/// Levels written depth:a:b.
fn levels(text: &str) -> Vec<Level> {
    let mut levels: Vec<Level> = Vec::new();
    for level in text.split(' ') {
        let numbers: Vec<f64> = level.split(':').map(number).collect();
        let [mut depth_m, a, b] = numbers[..] else {
            panic!("{level:?} is no level")
        };
        if let Some(above) = levels.last()
            && depth_m - above.depth_m < 1.5e-4
        {
            depth_m = above.depth_m;
        }
        levels.push(Level { depth_m, a, b });
    }
    levels
}

/// Reads `data/NAME.csv`: means of channels and their standard errors, W/(m² sr), and the scenes that they are of.
///
/// # Panics
/// When the file is missing or malformed.
pub fn means(name: &str) -> Vec<(String, Means)> {
    let row = |f: &Vec<String>| {
        let three = |first: usize| [0, 1, 2].map(|k| number(&f[first + k]));
        (f[6..].join(","), (three(0), three(3)))
    };
    fields(name).iter().map(row).collect()
}

/// Writes such a file.
///
/// # Panics
/// When it cannot be written.
pub fn write_means<'a>(name: &str, rows: impl Iterator<Item = (&'a str, Means)>) {
    let mut text = "mean_r,mean_g,mean_b,error_r,error_g,error_b,scene\n".to_owned();
    for (scene, (mean, error)) in rows {
        for number in mean.iter().chain(&error) {
            text += &format!("{number:.6e},");
        }
        text += scene;
        text.push('\n');
    }
    let path = file(&format!("data/{name}.csv"));
    std::fs::write(&path, text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
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
