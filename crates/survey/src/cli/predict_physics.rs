//! `uw predict --water`: contrast by physics, from one picture.

use std::path::{Path, PathBuf};

use clap::Args;
use csv::{ReaderBuilder, Trim};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use uw_calib::detail::channel_names;
use uw_calib::photo::{Exposed, Shot};
use uw_calib::picture::Counts;
use uw_calib::{Treatment, View};
use uw_guidance::Candidate;
use uw_guidance::physics::{Contrast, LinearPicture, Predictor, Sight, WaterFile};

use super::error::{CliError, note};
use super::numbers::significant;
use super::output;
use super::photo::PhotoArguments;
use crate::treatment::ideal_camera;

/// Significant digits of the predictions, which are known to a percent at best.
const DIGITS: usize = 6;

/// The picture, where it was taken, and the places asked for.
#[derive(Debug, Args)]
pub(super) struct PhysicsArguments {
    /// With --water: the present picture, a PNG, TIFF or JPEG of the water file's camera.
    #[arg(long, requires = "water")]
    image: Option<PathBuf>,
    /// With --water: distance to the target at which it was taken, m.
    #[arg(long, requires = "water")]
    distance_m: Option<f64>,
    /// With --water: lamp level at which it was taken, percent.
    #[arg(long, requires = "water")]
    light_pct: Option<f64>,
    /// With --water: depth, m; default the middle one of the water file.
    #[arg(long, requires = "water")]
    depth_m: Option<f64>,
    /// With --water: CSV table with the columns distance_m and light_pct.
    #[arg(long, requires = "water")]
    candidates: Option<PathBuf>,
    /// With --water: CSV table of pictures that the vehicle took of the same target before, with the columns file (beside the table), distance_m, light_pct
    /// and, where it was not --depth-m, depth_m.
    #[arg(long, requires = "water")]
    earlier: Option<PathBuf>,
    /// With --water: camera that took the pictures, a scene file whose [camera] has their size, lens (distortion or fisheye) and port, or a calibration (*.yaml, *.xml) of ROS, OpenCV, Kalibr or Metashape. They are read as the water
    /// file's ideal camera would have taken them.
    #[arg(long, value_name = "NAME|FILE", requires = "water")]
    camera: Option<PathBuf>,
    /// With --water: what of the pictures is not the target, polygons (*.toml, uw-mask/1) or a picture whose dark pixels are left out.
    #[arg(long, value_name = "FILE", requires = "water")]
    mask: Option<PathBuf>,
}

/// A picture as the water file's camera would have taken it.
struct Taken {
    counts: Counts,
    /// 8-bit counts.
    contrast: [f64; 3],
}

/// A row of --earlier.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct EarlierPicture {
    file: PathBuf,
    distance_m: f64,
    light_pct: f64,
    depth_m: Option<f64>,
}

impl PhysicsArguments {
    /// Predicts all candidates, then writes them to `to`.
    pub(super) fn run(&self, water: &Path, to: &Path) -> Result<(), CliError> {
        let file = WaterFile::read(water).map_err(CliError::input)?;
        let (Some(image), Some(distance_m), Some(light_pct), Some(table)) = (
            &self.image,
            self.distance_m,
            self.light_pct,
            &self.candidates,
        ) else {
            return Err(CliError::input(
                "--water needs --image, --distance-m, --light-pct and --candidates",
            ));
        };
        let here = Candidate {
            distance_m,
            light_pct,
        };
        check(&file, &here).map_err(|(field, told)| {
            CliError::input(format!("--{} {told}", field.replace('_', "-")))
        })?;
        let candidates = read(&file, table)?;
        let depth_m = self.depth(&file)?;
        let treatment = self.treatment(&file)?;
        let picture = picture(&file, image, &treatment, distance_m)?;
        let response = file.sensor.response();
        let linear = LinearPicture::of_counts(&picture.counts, file.sensor.encoding);
        let place = file.place(&response, depth_m);
        let earlier = match &self.earlier {
            Some(table) => earlier(&file, table, depth_m, &treatment)?,
            None => Vec::new(),
        };
        let sights = [&earlier[..], &file.sights];
        let predictor = Predictor::on_the_way(place, &linear, (&here, picture.contrast), sights);
        let known = known(&predictor, image)?;
        let found: Vec<Contrast> = candidates.iter().map(|at| predictor.contrast(at)).collect();
        write(to, &candidates, &found, known)
    }

    /// What makes the pictures those of the water file's camera.
    fn treatment(&self, file: &WaterFile) -> Result<Treatment, CliError> {
        let sensor = &file.sensor;
        let ideal = ideal_camera(&file.rig());
        let known = (ideal.as_ref(), sensor.even(), sensor.encoding);
        let photo = PhotoArguments::new(self.camera.clone(), self.mask.clone());
        photo.treatment(known, &file.tables.distances_m())
    }

    fn depth(&self, file: &WaterFile) -> Result<f64, CliError> {
        match self.depth_m {
            None => Ok(file
                .tables
                .depth_range_m()
                .map_or(0.0, |(least, most)| 0.5 * (least + most))),
            Some(depth_m) => match check_depth(file, depth_m) {
                Ok(()) => Ok(depth_m),
                Err(told) => Err(CliError::input(format!("--depth-m {told}"))),
            },
        }
    }
}

/// What is wrong with a depth.
fn check_depth(file: &WaterFile, depth_m: f64) -> Result<(), String> {
    match file.tables.depth_range_m() {
        Some((least, most)) if !(least..=most).contains(&depth_m) => Err(format!(
            "must be from {least} to {most} m, of which the water file knows the daylight, got {depth_m}"
        )),
        None if !(depth_m >= 0.0 && depth_m.is_finite()) => {
            Err(format!("must be finite and >= 0, got {depth_m}"))
        }
        _ => Ok(()),
    }
}

/// What the pictures of a table show, taken at `depth_m` where it does not say otherwise.
fn earlier(
    file: &WaterFile,
    table: &Path,
    depth_m: f64,
    treatment: &Treatment,
) -> Result<Vec<Sight>, CliError> {
    let response = file.sensor.response();
    let folder = table.parent().unwrap_or(Path::new(""));
    let mut sights = Vec::new();
    for (line, row) in rows::<EarlierPicture>(table)? {
        let wrong = |field: &str, told: String| {
            CliError::input(format!("{}:{line}: {field} {told}", table.display()))
        };
        let from = Candidate {
            distance_m: row.distance_m,
            light_pct: row.light_pct,
        };
        check(file, &from).map_err(|(field, told)| wrong(field, told))?;
        let depth_m = row.depth_m.unwrap_or(depth_m);
        check_depth(file, depth_m).map_err(|told| wrong("depth_m", told))?;
        let picture = picture(file, &folder.join(&row.file), treatment, row.distance_m)?;
        let linear = LinearPicture::of_counts(&picture.counts, file.sensor.encoding);
        let sight = Sight::new(&file.place(&response, depth_m), &linear, &from);
        match sight.tells_any() {
            true => sights.push(sight),
            false => note(format_args!(
                "uw: warning: {}:{line}: {} is passed over: it shows no detail but noise or full scale, or what no target can show there in the water file's light",
                table.display(),
                row.file.display()
            )),
        }
    }
    Ok(sights)
}

fn picture(
    file: &WaterFile,
    image: &Path,
    treatment: &Treatment,
    distance_m: f64,
) -> Result<Taken, CliError> {
    // The mean of frames has less noise than the water file's sensor.
    if image.is_dir() {
        return Err(CliError::input(format!(
            "{}: must be one picture, got a folder",
            image.display()
        )));
    }
    let view = View {
        path: image,
        distance_m: Some(distance_m),
        exposed: exposed(file, image),
    };
    let opened = treatment.open(&view).map_err(CliError::input)?;
    let counts = opened.counts().filled();
    let (width, height) = (file.sensor.width_px, file.sensor.height_px);
    if (counts.width, counts.height) != (width, height) {
        return Err(CliError::input(format!(
            "{}: the picture must have {width} x {height} pixels, for which the water file was made, got {} x {}",
            image.display(),
            counts.width,
            counts.height
        )));
    }
    let grid = opened
        .measure_as(|counts| counts)
        .map_err(CliError::input)?;
    Ok(Taken {
        counts,
        contrast: grid.stats.contrast,
    })
}

/// How a picture was exposed beside the water file's; alike where one of them is not known.
fn exposed(file: &WaterFile, image: &Path) -> Exposed {
    let name = image.display();
    let exposed = file.exposed(&Shot::of_file(image));
    match (exposed.map(|exposed| exposed.over), file.exposure_s()) {
        (None, Some(_)) => note(format_args!(
            "uw: warning: {name}: does not state time, ISO and f-number of its exposure: taken to be that of the water file's pictures"
        )),
        (Some(over), _) if over != 1.0 => note(format_args!(
            "uw: warning: {name}: was exposed {} times as long as the water file's pictures, and is brought to theirs in linear light",
            significant(over, 3)
        )),
        _ => {}
    }
    exposed.unwrap_or(Exposed::ALIKE)
}

/// Which channels can be told, with a note for each other one.
///
/// # Errors
/// None can.
fn known(predictor: &Predictor, image: &Path) -> Result<[bool; 3], CliError> {
    let unknown = predictor.unknown();
    let reasons: Vec<String> = ["red", "green", "blue"]
        .iter()
        .zip(&unknown)
        .filter_map(|(channel, reason)| Some(format!("{channel}: {}", (*reason)?)))
        .collect();
    let file = image.display();
    if reasons.len() == 3 {
        return Err(CliError::input(format!(
            "{file}: contrast cannot be predicted from this picture; {}",
            reasons.join("; ")
        )));
    }
    for reason in &reasons {
        note(format_args!(
            "uw: warning: {file}: no prediction for {reason}"
        ));
    }
    if let Some(names) = channel_names(predictor.partly_clipped()) {
        note(format_args!(
            "uw: warning: {file}: {names}: more than 1 % of the pixels are at full scale; what they would show is taken from the others, with a larger error"
        ));
    }
    Ok(unknown.map(|reason| reason.is_none()))
}

/// What is wrong with a place: the field, and what it must be and is.
fn check(file: &WaterFile, at: &Candidate) -> Result<(), (&'static str, String)> {
    let (near, far) = file.tables.distance_range_m();
    if !(near..=far).contains(&at.distance_m) {
        return Err((
            "distance_m",
            format!(
                "must be from {near} to {far} m, which the water file knows, got {}",
                at.distance_m
            ),
        ));
    }
    if !(0.0..=100.0).contains(&at.light_pct) {
        return Err((
            "light_pct",
            format!("must be from 0 to 100 percent, got {}", at.light_pct),
        ));
    }
    Ok(())
}

fn read(file: &WaterFile, table: &Path) -> Result<Vec<Candidate>, CliError> {
    let name = table.display();
    let of = |(line, candidate): (usize, Candidate)| match check(file, &candidate) {
        Ok(()) => Ok(candidate),
        Err((field, told)) => Err(CliError::input(format!("{name}:{line}: {field} {told}"))),
    };
    rows(table)?.into_iter().map(of).collect()
}

/// The rows of a table with their lines.
fn rows<R: DeserializeOwned>(table: &Path) -> Result<Vec<(usize, R)>, CliError> {
    let unusable =
        |e: csv::Error| CliError::input(format!("{}: not a usable table: {e}", table.display()));
    let mut reader = ReaderBuilder::new()
        .trim(Trim::All)
        .from_path(table)
        .map_err(unusable)?;
    let rows = reader.deserialize().enumerate();
    rows.map(|(i, row)| Ok((i + 2, row.map_err(unusable)?)))
        .collect()
}

fn write(
    to: &Path,
    candidates: &[Candidate],
    found: &[Contrast],
    known: [bool; 3],
) -> Result<(), CliError> {
    output::to_file(to, |out| {
        writeln!(
            out,
            "distance_m,light_pct,contrast_r,contrast_g,contrast_b,error_r,error_g,error_b"
        )?;
        for (at, found) in candidates.iter().zip(found) {
            let cells = |counts: [f64; 3]| {
                let cell = |k: usize| match known[k] {
                    true => significant(counts[k], DIGITS),
                    false => String::new(),
                };
                [0, 1, 2].map(cell).join(",")
            };
            writeln!(
                out,
                "{},{},{},{}",
                significant(at.distance_m, DIGITS),
                significant(at.light_pct, DIGITS),
                cells(found.counts),
                cells(found.error_counts)
            )?;
        }
        Ok(())
    })
}
