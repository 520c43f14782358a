//! `uw project`: points of the world -> image points of a scene's camera, and image points -> rays.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use csv::{ReaderBuilder, StringRecord, Trim};
use glam::DVec3;
use uw_render::scene::Camera;

use super::error::{CliError, note};
use super::numbers::significant;
use super::output;
use super::scene::SceneArguments;

const DIGITS: usize = 12;

/// Arguments of `uw project`.
#[derive(Debug, Args)]
pub(super) struct ProjectArguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// Points of the world to project: CSV with the columns x_m, y_m, z_m, in any order among others; `-` for standard input.
    /// Written are x_m, y_m, z_m, px, py, in_picture; px and py are empty where the camera cannot see a point.
    #[arg(
        long,
        value_name = "CSV",
        required_unless_present = "pixels",
        conflicts_with = "pixels"
    )]
    points: Option<PathBuf>,
    /// Image points to find the rays of instead: CSV with the columns px, py, pixels from the top left corner of the picture. Written
    /// are px, py, origin_x_m, origin_y_m, origin_z_m, direction_x, direction_y, direction_z: the ray as it leaves the camera's
    /// port.
    #[arg(long, value_name = "CSV")]
    pixels: Option<PathBuf>,
    /// Table to write; standard output without it.
    #[arg(short, long)]
    output: Option<PathBuf>,
}

impl ProjectArguments {
    /// Projects and writes the table. With `json` standard error holds nothing but an error object.
    pub(super) fn run(&self, json: bool) -> Result<(), CliError> {
        if let Some(path) = &self.output {
            output::check_writable(path)?;
        }
        let scene = self.scene.read()?;
        if !json {
            scene
                .warnings
                .iter()
                .for_each(|warning| note(format_args!("uw: warning: {warning}")));
        }
        let camera = &scene.camera;
        let table = match (&self.points, &self.pixels) {
            (Some(points), _) => projected(camera, &read_columns(points, ["x_m", "y_m", "z_m"])?),
            (None, Some(pixels)) => rays(camera, &read_columns(pixels, ["px", "py"])?),
            (None, None) => return Err(CliError::input("--points or --pixels must be given")),
        };
        let write = |file: &mut dyn Write| file.write_all(table.as_bytes());
        match &self.output {
            Some(path) => output::to_file(path, write),
            None => output::to_stdout(write),
        }
    }
}

fn projected(camera: &Camera, points: &[[f64; 3]]) -> String {
    let mut table = "x_m,y_m,z_m,px,py,in_picture\n".to_owned();
    for &point in points {
        let seen = camera.project(DVec3::from_array(point));
        let inside = seen.is_some_and(|at| {
            let (width, height) = (f64::from(camera.width), f64::from(camera.height));
            (0.0..width).contains(&at.x) && (0.0..height).contains(&at.y)
        });
        let pixel = match seen {
            Some(at) => listed(&at.to_array()),
            None => ",".to_owned(),
        };
        table += &format!("{},{pixel},{inside}\n", listed(&point));
    }
    table
}

fn rays(camera: &Camera, pixels: &[[f64; 2]]) -> String {
    let mut table =
        "px,py,origin_x_m,origin_y_m,origin_z_m,direction_x,direction_y,direction_z\n".to_owned();
    for pixel in pixels {
        let ray = camera.ray(pixel[0], pixel[1]);
        let [origin, direction] = [ray.origin_m, ray.direction].map(|v| listed(&v.to_array()));
        table += &format!("{},{origin},{direction}\n", listed(pixel));
    }
    table
}

fn listed(numbers: &[f64]) -> String {
    let numbers = numbers.iter().map(|&number| significant(number, DIGITS));
    numbers.collect::<Vec<_>>().join(",")
}

/// Columns of finite numbers of a table, by their names.
fn read_columns<const N: usize>(path: &Path, names: [&str; N]) -> Result<Vec<[f64; N]>, CliError> {
    let (source, reader): (String, Box<dyn Read>) = if path == Path::new("-") {
        ("standard input".to_owned(), Box::new(io::stdin()))
    } else {
        let source = path.display().to_string();
        let file = File::open(path)
            .map_err(|error| CliError::input(format!("{source}: cannot be read: {error}")))?;
        (source, Box::new(file))
    };
    parse_columns(reader, names).map_err(|error| CliError::input(format!("{source}{error}")))
}

fn parse_columns<const N: usize>(
    reader: impl Read,
    names: [&str; N],
) -> Result<Vec<[f64; N]>, String> {
    let unusable = |error: csv::Error| format!(": not a usable table: {error}");
    let mut reader = ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(Trim::All)
        .from_reader(reader);
    let header = reader.headers().map_err(unusable)?.clone();
    let mut columns = [0; N];
    for (column, name) in columns.iter_mut().zip(names) {
        let named = |field: &str| field.trim_start_matches('\u{feff}') == name;
        *column = header.iter().position(named).ok_or_else(|| {
            let got: Vec<&str> = header.iter().collect();
            format!(
                ":1: lacks the column {name}; needed are {}, got {}",
                names.join(", "),
                got.join(", ")
            )
        })?;
    }
    let mut rows = Vec::new();
    for row in reader.records() {
        rows.push(numbers(&row.map_err(unusable)?, columns, names)?);
    }
    Ok(rows)
}

fn numbers<const N: usize>(
    row: &StringRecord,
    columns: [usize; N],
    names: [&str; N],
) -> Result<[f64; N], String> {
    let mut numbers = [0.0; N];
    for ((number, column), name) in numbers.iter_mut().zip(columns).zip(names) {
        let got = row.get(column).unwrap_or_default();
        let parsed = got.parse::<f64>().ok().filter(|number| number.is_finite());
        *number = parsed.ok_or_else(|| {
            let line = row.position().map_or(0, csv::Position::line);
            format!(":{line}: {name} must be a finite number, got {got:?}")
        })?;
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_by_their_names() {
        let text = "\u{feff}name,z_m,x_m, y_m\n# a mark\nbow,-2.5,1,2e-1\n";
        let found = parse_columns(text.as_bytes(), ["x_m", "y_m", "z_m"]);
        assert_eq!(found, Ok(vec![[1.0, 0.2, -2.5]]));
    }

    #[test]
    fn what_is_no_number_or_no_column_is_named() {
        let read = |text: &str| parse_columns(text.as_bytes(), ["px", "py"]);
        assert_eq!(
            read("px,x\n1,2\n"),
            Err(":1: lacks the column py; needed are px, py, got px, x".to_owned())
        );
        for (got, text) in [("up", "px,py\n1,2\n3,up\n"), ("inf", "px,py\n1,2\ninf,3\n")] {
            let name = if got == "up" { "py" } else { "px" };
            let expected = format!(":3: {name} must be a finite number, got {got:?}");
            assert_eq!(read(text), Err(expected));
        }
        assert!(read("px,py\n1\n").is_err_and(|error| error.starts_with(": not a usable table")));
    }
}
