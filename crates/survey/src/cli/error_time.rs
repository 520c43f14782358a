//! `uw error-time`: error against time on a set of scenes, and the references it needs.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::{Args, value_parser};
use serde_json::{Value, json};

use super::error::{CliError, note};
use super::numbers::significant;
use super::progress::ProgressDisplay;
use super::values::{positive, relative_error};
use super::{interrupt, output};
use uw_error_time::backend::Backend;
use uw_error_time::curve::{Curve, Rung, SecondsToError};
use uw_error_time::ladder::{Ladder, Report};
use uw_error_time::remake::{MadeReference, Remake, Until};
use uw_error_time::scene::Size;
use uw_error_time::{ErrorTimeError, ErrorTimeObserver};

/// Relative mean squared errors that the summary gives the seconds to, with the relative error in percent.
const TARGETS: [(f64, u32); 3] = [(1e-2, 10), (1e-3, 3), (1e-4, 1)];
/// Relative error of a reference when nothing else is asked for.
const REFERENCE_ERROR: f64 = 0.01;

/// Arguments of `uw error-time`.
#[derive(Debug, Args)]
pub(super) struct ErrorTimeArguments {
    /// Scene files (uw-scene/1); results and references go by their names.
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<PathBuf>,
    /// Folder for error_time.csv and the plots; renders that the table holds are not made again.
    #[arg(
        short,
        long,
        value_name = "DIR",
        required_unless_present = "make_references",
        conflicts_with = "make_references"
    )]
    output: Option<PathBuf>,
    /// Samples per pixel of the rungs (default 4,16,64,256); with --make-references a single number.
    #[arg(long, value_delimiter = ',', value_name = "N,..", value_parser = value_parser!(u32).range(2..=1 << 30))]
    spp: Vec<u32>,
    /// Where to render. Default: cpu and cpu-simd.
    #[arg(long, value_delimiter = ',', conflicts_with = "make_references")]
    backends: Option<Vec<Backend>>,
    /// Leave out the rungs of a scene above the first whose relative mean squared error is at most this.
    #[arg(long, value_name = "RELMSE", conflicts_with = "make_references", value_parser = positive)]
    until: Option<f64>,
    /// Renders per rung that differ in their seeds only.
    #[arg(long, default_value_t = 3, value_parser = value_parser!(u32).range(1..=10_000), conflicts_with = "make_references")]
    repeats: u32,
    /// Folder of references. Default: `references` beside each scene.
    #[arg(long, value_name = "DIR")]
    references: Option<PathBuf>,
    /// Other renderers' measurements (CSV: renderer,scene,spp,cpu_s,rel_mse), to be drawn beside.
    #[arg(long, value_name = "CSV", conflicts_with = "make_references")]
    peers: Option<PathBuf>,
    /// Make the references of the scenes again and stop.
    #[arg(long)]
    make_references: bool,
    /// With --make-references: stop at this estimated relative error (default 0.01 unless --spp is given).
    #[arg(long, value_name = "E", requires = "make_references", conflicts_with = "spp", value_parser = relative_error)]
    target_error: Option<f64>,
    /// Width instead of the scenes', pixels; alone it keeps the proportions.
    #[arg(long, value_name = "W")]
    width: Option<u32>,
    /// Height instead of the scenes', pixels; alone it keeps the proportions.
    #[arg(long, value_name = "H")]
    height: Option<u32>,
    /// Worker threads. Default: one per core.
    #[arg(long, value_parser = value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Seed from which the seeds of all renders are made; those of references are others from the same one.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// No progress on standard error.
    #[arg(long)]
    quiet: bool,
}

impl ErrorTimeArguments {
    /// Measures or makes references, then prints what came out.
    pub(super) fn run(&self, json: bool) -> Result<(), CliError> {
        match &self.output {
            Some(folder) if !self.make_references => {
                let ladder = self.ladder(folder.clone());
                let report = self.observed(json, true, |observer| ladder.measure(observer))?;
                self.tell(&report, json)
            }
            _ => {
                let remake = self.remake()?;
                let known_end = matches!(remake.until, Until::Samples(_));
                let made = self.observed(json, known_end, |observer| remake.make(observer))?;
                output::to_stdout(|out| write_references(out, &made, json))
            }
        }
    }

    fn size(&self) -> Size {
        Size {
            width: self.width,
            height: self.height,
        }
    }

    fn ladder(&self, output: PathBuf) -> Ladder {
        Ladder {
            scenes: self.scenes.clone(),
            size: self.size(),
            output,
            backends: self.backends.clone().unwrap_or_else(Backend::of_processor),
            samples_per_pixel: if self.spp.is_empty() {
                vec![4, 16, 64, 256]
            } else {
                self.spp.clone()
            },
            until: self.until,
            repeats: self.repeats,
            seed: self.seed,
            threads: self.threads.map(usize::from),
            references: self.references.clone(),
            peers: self.peers.clone(),
        }
    }

    fn remake(&self) -> Result<Remake, CliError> {
        let until = match (&self.spp[..], self.target_error) {
            ([], target) => Until::TargetError(target.unwrap_or(REFERENCE_ERROR)),
            ([samples], _) => Until::Samples(*samples),
            (more, _) => {
                let message =
                    format!("--spp must be one number with --make-references, got {more:?}");
                return Err(CliError::input(message));
            }
        };
        Ok(Remake {
            scenes: self.scenes.clone(),
            size: self.size(),
            references: self.references.clone(),
            until,
            seed: self.seed,
            threads: self.threads.map(usize::from),
        })
    }

    /// Runs `work` with progress on standard error and Ctrl-C heard.
    fn observed<T>(
        &self,
        json: bool,
        known_end: bool,
        work: impl FnOnce(&ErrorTimeObserver) -> Result<T, ErrorTimeError>,
    ) -> Result<T, CliError> {
        let cancel = interrupt::cancel_flag()?;
        let display = ProgressDisplay::start(self.quiet || json, known_end);
        let progress = |share: Option<f64>, message: &str| {
            display.update(share, || message.to_owned());
        };
        let result = work(&ErrorTimeObserver {
            progress: &progress,
            cancel: &cancel,
        });
        display.finish();
        result.map_err(|error| match error {
            ErrorTimeError::Interrupted { .. } => CliError::Interrupted(error.to_string()),
            _ if error.is_input() => CliError::input(error),
            _ => CliError::failed(error),
        })
    }

    fn tell(&self, report: &Report, json: bool) -> Result<(), CliError> {
        if !json {
            if let Some(peers) = &self.peers {
                for scene in &report.other_scenes_of_peers {
                    let file = peers.display();
                    note(format_args!(
                        "uw: note: {file}: {scene} is not among the scenes and is not drawn"
                    ));
                }
            }
            let (rendered, kept) = (report.rendered, report.kept);
            note(format_args!(
                "{rendered} renders made, {kept} found in the table"
            ));
            for file in &report.files {
                note(file.display());
            }
        }
        output::to_stdout(|out| {
            if json {
                let curves: Vec<Value> = report.curves.iter().map(curve_json).collect();
                serde_json::to_writer_pretty(&mut *out, &curves)?;
                writeln!(out)
            } else {
                write_rungs(out, &report.curves)?;
                writeln!(out)?;
                write_summary(out, &report.curves)
            }
        })
    }
}

fn write_references(out: &mut dyn Write, made: &[MadeReference], json: bool) -> io::Result<()> {
    if json {
        let made: Vec<Value> = made
            .iter()
            .map(|m| {
                json!({"file": m.path, "samples_per_pixel": m.samples_per_pixel, "rel_mse": m.rel_mse, "cpu_s": m.cpu_s})
            })
            .collect();
        serde_json::to_writer_pretty(&mut *out, &made)?;
        return writeln!(out);
    }
    for m in made {
        writeln!(
            out,
            "{}: {} samples per pixel, own relMSE {:.2e}, {:.1} CPU s",
            m.path.display(),
            m.samples_per_pixel,
            m.rel_mse,
            m.cpu_s
        )?;
    }
    Ok(())
}

/// The width of the column of names.
fn name_width(curves: &[Curve]) -> usize {
    curves
        .iter()
        .map(|c| c.scene.chars().count())
        .fold(5, usize::max)
}

/// A line per rung: time, error, bias.
fn write_rungs(out: &mut dyn Write, curves: &[Curve]) -> io::Result<()> {
    let width = name_width(curves);
    writeln!(
        out,
        "{:width$}  {:17}     spp      CPU s     wall s  relMSE              bias ± standard error, % (R, G, B)",
        "scene", "backend"
    )?;
    for curve in curves {
        for rung in &curve.rungs {
            let error = match rung.rel_mse_standard_error {
                Some(error) => format!("{:.3e} ± {error:.0e}", rung.rel_mse),
                None => format!("{:.3e}", rung.rel_mse),
            };
            let bias: Vec<String> = (0..3)
                .map(|k| {
                    let [bias, error] =
                        [rung.bias[k], rung.bias_standard_error[k]].map(|b| 100.0 * b);
                    format!("{bias:+.3} ± {error:.3}")
                })
                .collect();
            writeln!(
                out,
                "{:width$}  {:17} {:7} {:10.3} {:10.3}  {error:18}  {}",
                curve.scene,
                curve.backend,
                rung.samples_per_pixel,
                rung.cpu_s,
                rung.render_s,
                bias.join(", ")
            )?;
        }
    }
    Ok(())
}

/// A line per curve: seconds to errors, and where they come from.
fn write_summary(out: &mut dyn Write, curves: &[Curve]) -> io::Result<()> {
    let width = name_width(curves);
    let targets = TARGETS.map(|(_, pct)| format!("{:>12}", format!("CPU s to {pct} %")));
    writeln!(
        out,
        "{:width$}  {:17}  {}    setup s  relMSE x spp     paths/s  ns/vertex  vertices/path  largest bias/error",
        "scene",
        "backend",
        targets.join("  ")
    )?;
    for curve in curves {
        let seconds =
            TARGETS.map(|(target, _)| format!("{:>12}", seconds(curve.seconds_to(target))));
        let cost = curve.rungs.last().map(Cost::of).unwrap_or_default();
        writeln!(
            out,
            "{:width$}  {:17}  {}  {:9.3}  {:>12}  {:10.0}  {:9.0}  {:13.1}  {:18.1}",
            curve.scene,
            curve.backend,
            seconds.join("  "),
            curve.setup_s,
            significant(curve.rel_mse_of_one_sample().unwrap_or(f64::NAN), 3),
            cost.paths_per_s,
            cost.ns_per_vertex,
            cost.vertices_per_path,
            curve.largest_bias_z(),
        )?;
    }
    writeln!(
        out,
        "10, 3, 1 %: relMSE 1e-2, 1e-3, 1e-4. ~: extrapolated along relMSE x time = constant. relMSE is less the reference's own noise."
    )
}

fn seconds(found: Option<SecondsToError>) -> String {
    match found {
        Some(SecondsToError {
            cpu_s,
            extrapolated,
        }) => {
            let mark = if extrapolated { "~" } else { "" };
            format!("{mark}{}", significant(cpu_s, 3))
        }
        None => "-".to_owned(),
    }
}

/// What a rung's processor time was spent on.
#[derive(Default)]
struct Cost {
    paths_per_s: f64,
    ns_per_vertex: f64,
    vertices_per_path: f64,
}

impl Cost {
    fn of(rung: &Rung) -> Self {
        Self {
            paths_per_s: rung.paths / rung.cpu_s,
            ns_per_vertex: 1e9 * rung.cpu_s / rung.path_vertices,
            vertices_per_path: rung.path_vertices / rung.paths,
        }
    }
}

fn curve_json(curve: &Curve) -> Value {
    let rungs: Vec<Value> = curve
        .rungs
        .iter()
        .map(|r| {
            json!({
                "samples_per_pixel": r.samples_per_pixel, "repeats": r.repeats, "cpu_s": r.cpu_s, "render_s": r.render_s,
                "paths": r.paths, "path_vertices": r.path_vertices, "rel_mse": r.rel_mse,
                "rel_mse_standard_error": r.rel_mse_standard_error, "bias": r.bias,
                "bias_standard_error": r.bias_standard_error,
            })
        })
        .collect();
    let seconds: Vec<Value> = TARGETS
        .iter()
        .filter_map(|&(target, _)| {
            let found = curve.seconds_to(target)?;
            Some(json!({"rel_mse": target, "cpu_s": found.cpu_s, "extrapolated": found.extrapolated}))
        })
        .collect();
    json!({
        "scene": curve.scene, "backend": curve.backend, "setup_s": curve.setup_s, "rungs": rungs,
        "seconds_to_error": seconds, "rel_mse_of_one_sample": curve.rel_mse_of_one_sample(),
    })
}
