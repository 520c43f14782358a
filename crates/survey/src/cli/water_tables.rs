//! `uw water-tables`: the water file of a known water, for predictions by physics.

use std::path::{Path, PathBuf};

use clap::{ArgGroup, Args};
use uw_guidance::physics::WaterFile;
use uw_guidance::physics::file::WATER_FORMAT;
use uw_media::Iops;
use uw_media::phase::FournierForand;
use uw_media::spectral::Response;

use super::error::{CliError, note};
use super::output;
use super::progress::ProgressDisplay;
use super::values::triple;
use super::water_spectrum::read_water;
use uw_calib::vehicle::{Vehicle, VehicleFile};
use uw_twin::environment::{JerlovWater, PARTICLE_INDEX};
use uw_twin::estimate::water_tables::{
    KnownWater, TablePlan, USUAL_REFLECTANCE, sensor_numbers, spaced_distances_m,
    water_tables_watched,
};

/// Arguments of `uw water-tables`.
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("of").required(true)))]
pub(super) struct WaterTablesArguments {
    /// Jerlov type, or a mixture of two such as IB-II@0.5, in three bands.
    #[arg(long, group = "of", value_name = "TYPE")]
    jerlov: Option<JerlovWater>,
    /// Absorption of red, green and blue, 1/m, such as 0.36,0.07,0.04; with --b.
    #[arg(long, group = "of", value_name = "R,G,B", requires = "b", value_parser = triple)]
    a: Option<[f64; 3]>,
    /// A table with the columns wavelength_nm, a_per_m and b_per_m; what three bands (600-700, 500-600, 400-500 nm) make of it.
    #[arg(long, group = "of", value_name = "FILE")]
    spectrum: Option<String>,
    /// Scattering of red, green and blue, 1/m.
    #[arg(long, value_name = "R,G,B", requires = "a", value_parser = triple)]
    b: Option<[f64; 3]>,
    /// Share of the light that is scattered by more than 90 degrees.
    #[arg(long, default_value_t = 0.0183)]
    backscatter_fraction: f64,
    /// Distances that predictions may be asked for: nearest and farthest, m.
    #[arg(long, default_values_t = [0.5, 3.0], num_args = 2, value_names = ["NEAR", "FAR"])]
    distances_m: Vec<f64>,
    /// Depths of daylight, m, such as 1,3,5.
    #[arg(long, default_values_t = [1.0, 3.0, 5.0], value_delimiter = ',')]
    depths_m: Vec<f64>,
    /// There is no daylight (night, or deep): the water file holds at any depth.
    #[arg(long, conflicts_with = "depths_m")]
    dark: bool,
    /// Number of distances, spaced evenly in their logarithm.
    #[arg(long, default_value_t = 12, value_parser = clap::value_parser!(u32).range(2..=100))]
    views: u32,
    /// The vehicle looks down at the bottom rather than ahead at a wall.
    #[arg(long)]
    bottom: bool,
    /// Mean reflectance of targets: some of their light comes back to them.
    #[arg(long, default_value_t = USUAL_REFLECTANCE)]
    reflectance: f32,
    /// Paths per view and source, in thousands.
    #[arg(long, default_value_t = 128, value_parser = clap::value_parser!(u32).range(8..=8192))]
    kilo_paths: u32,
    /// Seed of all random numbers.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The vehicle, its spectra left out: a shipped one's name or a file (uw-vehicle/1).
    #[arg(long, value_name = "NAME|FILE", default_value = "default")]
    vehicle: String,
    /// Water file to write.
    #[arg(short, long)]
    output: PathBuf,
}

impl WaterTablesArguments {
    /// Makes the tables and writes them.
    pub(super) fn run(&self) -> Result<(), CliError> {
        output::check_writable(&self.output)?;
        self.check()?;
        let vehicle = self.vehicle()?;
        let water = KnownWater {
            iops: self.iops()?,
            backscatter_fraction: self.backscatter_fraction,
            bottom: self.bottom,
            reflectance: self.reflectance,
        };
        FournierForand::new(PARTICLE_INDEX, self.backscatter_fraction).map_err(CliError::input)?;
        let plan = self.plan();
        let sources = 1 + plan.depths_m.len();
        note(format_args!(
            "uw: {} distances x {sources} sources of light",
            self.views
        ));
        let progress = ProgressDisplay::start(false, true);
        let scene = |depth_m, distance_m| water.scene(&vehicle, depth_m, distance_m);
        let tables = water_tables_watched(&plan, scene, |share| {
            progress.update(Some(share), String::new);
            true
        });
        progress.finish();
        let tables = tables.map_err(CliError::failed)?;
        let file = WaterFile {
            format: WATER_FORMAT.to_owned(),
            made_by: format!("uw water-tables {}", env!("CARGO_PKG_VERSION")),
            water: water.numbers(),
            sensor: sensor_numbers(&vehicle, vehicle.encoding),
            tables,
            sights: Vec::new(),
            fit: None,
        };
        output::to_file(&self.output, |out| write!(out, "{}", file.to_json()))
    }

    fn vehicle(&self) -> Result<Vehicle, CliError> {
        let file = VehicleFile::find(&self.vehicle, Path::new(""))
            .map_err(|error| CliError::input(format_args!("--vehicle: {error}")))?;
        match file.vehicle.needs_wavelengths() {
            Some(field) => Err(CliError::input(format_args!(
                "--vehicle: {}: {field} counts by wavelength alone, and water tables have three bands; leave it out",
                self.vehicle
            ))),
            None => Ok(file.vehicle),
        }
    }

    fn check(&self) -> Result<(), CliError> {
        let [near, far] = self.distances_m[..] else {
            return Err(CliError::input("--distances-m must be two numbers"));
        };
        if !(near >= 0.2 && far > near && far <= 10.0) {
            return Err(CliError::input(format!(
                "--distances-m must be 0.2 <= NEAR < FAR <= 10 (m), got {near} {far}"
            )));
        }
        let rising = self.depths_m.windows(2).all(|pair| pair[0] < pair[1]);
        let right = self.depths_m.iter().all(|z| (0.1..=60.0).contains(z));
        if !(rising && right) {
            return Err(CliError::input(format!(
                "--depths-m must rise from 0.1 to 60 (m), got {:?}",
                self.depths_m
            )));
        }
        if !(0.0..1.0).contains(&self.reflectance) {
            return Err(CliError::input(format!(
                "--reflectance must be in [0, 1), got {}",
                self.reflectance
            )));
        }
        Ok(())
    }

    fn iops(&self) -> Result<Iops, CliError> {
        let iops = match (self.jerlov, &self.spectrum, self.a, self.b) {
            (Some(kind), ..) => kind.iops().map_err(CliError::input)?,
            (_, Some(path), ..) => three_bands(path)?,
            (_, _, Some(a), Some(b)) => Iops { a, b },
            _ => return Err(CliError::input("give --jerlov, --spectrum, or --a and --b")),
        };
        if let Some(wrong) = iops
            .a
            .iter()
            .chain(&iops.b)
            .find(|v| !(**v >= 0.0 && v.is_finite()))
        {
            return Err(CliError::input(format!(
                "--a and --b must be finite and >= 0 (1/m), got {wrong}"
            )));
        }
        Ok(iops)
    }

    fn plan(&self) -> TablePlan {
        TablePlan {
            distances_m: spaced_distances_m(self.distances_m[0], self.distances_m[1], self.views),
            depths_m: match self.dark {
                true => Vec::new(),
                false => self.depths_m.clone(),
            },
            reflectance: self.reflectance,
            paths_per_group: 1024 * self.kilo_paths / 8,
            seed: self.seed,
        }
    }
}

/// What the three boxes make of a table, near zero range as the types of `--jerlov`.
fn three_bands(path: &str) -> Result<Iops, CliError> {
    let water = read_water(path)?;
    let boxes = Response::boxes();
    if let Some((outside, channel)) = boxes.not_covered(water.range_nm()) {
        return Err(CliError::input(format!(
            "{path}: must cover 400 to 700 nm, but {:.0} % of channel {channel} lies beyond",
            100.0 * outside
        )));
    }
    Ok(water.near_zero_range(&boxes))
}
