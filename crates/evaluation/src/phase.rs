//! Phase functions compared: Fournier-Forand, Henyey-Greenstein and Petzold's measurements over angle, and one scene
//! rendered with the first two.

use std::fmt::Write;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use uw_calib::vehicle::Vehicle;
use uw_media::WaterType;
use uw_media::phase::{FournierForand, HenyeyGreenstein, Phase, PhaseFunction, Tabulated};
use uw_render::film::FilmLayer;
use uw_render::image::{Frame, Picture};
use uw_render::integrator::{self, Plan, RenderError};
use uw_render::prepare::Prepared;
use uw_scenery::textures::Pattern;
use uw_twin::environment::{self, Target, View as Look, WaterBody};

use crate::error::EvalError;
use crate::files::write_text;
use crate::operation::report::Sheet;
use crate::plot::{self, Panel, Series};
use uw_calib::ImageStats;

/// Parameters of the published comparison: refractive index and backscatter fraction, mean cosine.
const PARTICLE_INDEX: f64 = 1.10;
const BACKSCATTER_FRACTION: f64 = 0.0183;
const MEAN_COSINE: f64 = 0.924;
/// Angles of the table per decade from 0.1 to 180 degrees.
const PER_DECADE: f64 = 60.0;
const SMALLEST_DEG: f64 = 0.1;
/// The scene: a seabed below a vehicle in turbid water with its lamps on.
const DEPTH_M: f64 = 3.0;
const DISTANCE_M: f64 = 1.0;
const TARGET: Pattern = Pattern::Seabed;
const WATER: &str = "3C";

/// Values at one angle, 1/sr.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Scattering angle, degrees.
    pub angle_deg: f64,
    /// Fournier-Forand.
    pub fournier_forand: f64,
    /// Henyey-Greenstein.
    pub henyey_greenstein: f64,
    /// Petzold's average particle.
    pub petzold: f64,
}

/// What one render looks like.
struct Shot {
    name: &'static str,
    frame: Frame,
    mean: [f64; 3],
    contrast: [f64; 3],
    backscatter_share: f64,
}

/// Writes `phase.csv`, `phase.png`, `phase.svg`, `phase_renders.jpg` and `phase.md`; the renders take `samples` samples
/// per pixel.
pub fn run(
    folder: &Path,
    assets: &Path,
    samples: u32,
    threads: Option<usize>,
    cancel: &AtomicBool,
) -> Result<(), EvalError> {
    std::fs::create_dir_all(folder).map_err(|e| EvalError::output(folder, e))?;
    let forand = Phase::FournierForand(FournierForand::new(PARTICLE_INDEX, BACKSCATTER_FRACTION)?);
    let greenstein = Phase::HenyeyGreenstein(HenyeyGreenstein::new(MEAN_COSINE)?);
    let rows = rows(
        &forand,
        &greenstein,
        &Phase::Tabulated(Tabulated::petzold()),
    );
    write_text(&folder.join("phase.csv"), &csv(&rows))?;
    plot::write(&folder.join("phase"), &panels(&rows))?;
    let target = Target::read(TARGET, assets)?;
    let render = |name: &'static str, phase: &Phase| {
        let plan = Plan {
            samples_per_pixel: Some(samples),
            threads,
            ..Plan::new(1)
        };
        look(name, phase, &target, &plan, cancel)
    };
    let looks = [
        render("Henyey-Greenstein", &greenstein)?,
        render("Fournier-Forand", &forand)?,
    ];
    let sheet = Sheet {
        columns: looks.iter().map(|l| l.name.to_owned()).collect(),
        rows: vec![(
            format!("{WATER}, {DISTANCE_M} m"),
            looks.iter().map(|l| l.frame.clone()).collect(),
        )],
    };
    sheet.write(&folder.join("phase_renders.jpg"))?;
    write_text(&folder.join("phase.md"), &markdown(&rows, &looks))
}

/// The three functions from 0.1 to 180 degrees.
pub fn rows(forand: &Phase, greenstein: &Phase, petzold: &Phase) -> Vec<Row> {
    let decades = (180.0 / SMALLEST_DEG).log10();
    let count = (decades * PER_DECADE).ceil() as u32;
    let row = |i: u32| {
        let angle_deg = SMALLEST_DEG * 10f64.powf(decades * f64::from(i) / f64::from(count));
        let x = (0.5 * angle_deg.to_radians()).sin().powi(2);
        Row {
            angle_deg,
            fournier_forand: forand.value(x),
            henyey_greenstein: greenstein.value(x),
            petzold: petzold.value(x),
        }
    };
    (0..=count).map(row).collect()
}

/// Root mean square of log10 of a function over Petzold's between two angles.
fn rms_log10(rows: &[Row], of: fn(&Row) -> f64, [from, to]: [f64; 2]) -> f64 {
    let inside = rows.iter().filter(|r| (from..=to).contains(&r.angle_deg));
    let squares: Vec<f64> = inside
        .map(|r| (of(r) / r.petzold).log10().powi(2))
        .collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

fn look(
    name: &'static str,
    phase: &Phase,
    target: &Target,
    plan: &Plan,
    cancel: &AtomicBool,
) -> Result<Shot, EvalError> {
    let vehicle = Vehicle {
        width: 320,
        height: 180,
        exposure: 8.0,
        ..Vehicle::default()
    };
    let water = WaterBody {
        jerlov: WATER.parse::<WaterType>()?.into(),
        backscatter_fraction: BACKSCATTER_FRACTION,
    };
    let view = Look::Target {
        depth_m: DEPTH_M,
        distance_m: DISTANCE_M,
    };
    let mut scene = environment::scene(&vehicle, &water, target, view)?;
    if let Some(water) = &mut scene.water {
        water.phase = phase.clone();
    }
    let (film, stats) = integrator::render(&Prepared::build(&scene), plan, cancel, &|_| {})?;
    if stats.interrupted {
        let total = film.rows.len();
        return Err(RenderError::Incomplete { rows: 0, total }.into());
    }
    let radiance = film.layer(FilmLayer::Total);
    let sum = |layer: &[[f64; 3]]| layer.iter().flatten().sum::<f64>();
    let picture = Picture {
        width: film.width,
        height: film.height,
        data: radiance.iter().map(|p| p.map(|v| v as f32)).collect(),
    };
    let frame = environment::sensor(&vehicle, vehicle.exposure).expose(&picture, 1);
    let pixels = frame.in_8_bit_counts();
    let measured = ImageStats::from_counts(frame.width as usize, frame.height as usize, &pixels)
        .map_err(|e| EvalError::Input(e.to_string()))?;
    Ok(Shot {
        name,
        mean: measured.mean,
        contrast: measured.contrast,
        backscatter_share: sum(&film.layer(FilmLayer::Backscatter)) / sum(&radiance),
        frame,
    })
}

fn csv(rows: &[Row]) -> String {
    let mut text =
        String::from("angle_deg,fournier_forand_per_sr,henyey_greenstein_per_sr,petzold_per_sr\n");
    for r in rows {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{:.6},{:.6e},{:.6e},{:.6e}",
            r.angle_deg, r.fournier_forand, r.henyey_greenstein, r.petzold
        );
    }
    text
}

fn panels(rows: &[Row]) -> Vec<Panel> {
    let line = |name: &str, of: fn(&Row) -> f64| Series {
        name: name.into(),
        points: rows.iter().map(|r| (r.angle_deg, of(r))).collect(),
    };
    let panel = |title: &str, logarithmic| Panel {
        title: title.into(),
        x: "scattering angle, degrees".into(),
        y: "phase function, 1/sr".into(),
        series: vec![
            line("Fournier-Forand", |r| r.fournier_forand),
            line("Henyey-Greenstein", |r| r.henyey_greenstein),
            line("Petzold", |r| r.petzold),
        ],
        logarithmic,
    };
    vec![
        panel("Phase functions, small angles", [true, true]),
        panel("Phase functions, all angles", [false, true]),
    ]
}

fn markdown(rows: &[Row], looks: &[Shot]) -> String {
    let mut text = format!(
        "# Phase functions\n\nFournier-Forand (n {PARTICLE_INDEX}, B {BACKSCATTER_FRACTION}), Henyey-Greenstein (g \
         {MEAN_COSINE}) and Petzold's average particle. Root mean square of log10 of the ratio to Petzold, angles evenly \
         spaced in their logarithm:\n\n| angles, degrees | Fournier-Forand | Henyey-Greenstein |\n|---|---|---|\n"
    );
    for angles in [[0.1, 180.0], [0.1, 10.0], [10.0, 90.0], [90.0, 180.0]] {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {} - {} | {:.3} | {:.3} |",
            angles[0],
            angles[1],
            rms_log10(rows, |r| r.fournier_forand, angles),
            rms_log10(rows, |r| r.henyey_greenstein, angles)
        );
    }
    let _ = write!(
        text,
        "\n![phase functions](phase.png)\n\nThe same scene rendered with both: seabed {DISTANCE_M} m below the vehicle at \
         {DEPTH_M} m depth in Jerlov {WATER}, lamps at 100 %. Mean and contrast in 8-bit counts; veil: share of the light \
         that met no surface.\n\n| phase function | mean R G B | contrast R G B | veil |\n|---|---|---|---|\n"
    );
    for l in looks {
        let triple = |v: [f64; 3]| format!("{:.1} {:.1} {:.1}", v[0], v[1], v[2]);
        let _ = writeln!(
            text,
            "| {} | {} | {} | {:.1} % |",
            l.name,
            triple(l.mean),
            triple(l.contrast),
            100.0 * l.backscatter_share
        );
    }
    text.push_str("\n![renders](phase_renders.jpg)\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fournier_forand_is_the_closer_one_over_all_angles() {
        let forand = FournierForand::new(PARTICLE_INDEX, BACKSCATTER_FRACTION).expect("valid");
        let greenstein = HenyeyGreenstein::new(MEAN_COSINE).expect("valid");
        let rows = rows(
            &Phase::FournierForand(forand),
            &Phase::HenyeyGreenstein(greenstein),
            &Phase::Tabulated(Tabulated::petzold()),
        );
        let rms = |of, angles| rms_log10(&rows, of, angles);
        let all = [0.1, 180.0];
        assert!(rms(|r| r.fournier_forand, all) < 0.1);
        assert!(rms(|r| r.henyey_greenstein, all) > 0.4);
        assert_eq!(rows.last().map(|r| r.angle_deg.round()), Some(180.0));
    }
}
