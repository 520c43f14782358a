//! The ladder: renders of every scene on every backend with rising numbers of samples, several times over.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use uw_render::film::FilmLayer;
use uw_render::integrator::{Plan, Progress};

use super::backend::Backend;
use super::curve::Curve;
use super::error::compare;
use super::peers::{self, PeerPoint};
use super::reference::Reference;
use super::scene::{BenchmarkScene, Size};
use super::seeds::seed_of_run;
use super::table::{self, Measurement};
use super::{
    ErrorTimeError, ErrorTimeObserver, make_folder, plot, program_version, references_of,
    threads_or_all,
};

/// Names of the results in the output folder.
const TABLE: &str = "error_time.csv";
const PLOTS: [&str; 2] = ["error_time.png", "error_time.svg"];

/// What to measure.
#[derive(Clone, Debug)]
pub struct Ladder {
    /// Scene files.
    pub scenes: Vec<PathBuf>,
    /// Width and height that replace those of the scenes.
    pub size: Size,
    /// Folder for the table and the plots.
    pub output: PathBuf,
    /// Where to render.
    pub backends: Vec<Backend>,
    /// Samples per pixel of the rungs, each >= 2.
    pub samples_per_pixel: Vec<u32>,
    /// Relative mean squared error at which a scene's ladder ends: rungs with more samples than the first that is as
    /// good in the first repeat are left out.
    pub until: Option<f64>,
    /// Renders per rung that differ in their seeds only, >= 1.
    pub repeats: u32,
    /// Seed from which those of all renders are made.
    pub seed: u64,
    /// Worker threads; `None` for one per core.
    pub threads: Option<usize>,
    /// Folder of references; `None` for `references` beside each scene.
    pub references: Option<PathBuf>,
    /// Table of other renderers' measurements.
    pub peers: Option<PathBuf>,
}

/// What came out.
#[derive(Clone, Debug)]
pub struct Report {
    /// A curve for each scene and backend.
    pub curves: Vec<Curve>,
    /// Renders made now.
    pub rendered: usize,
    /// Renders that were in the table already.
    pub kept: usize,
    /// Scenes that the table of peers names and this run does not have.
    pub other_scenes_of_peers: Vec<String>,
    /// The table and the plots.
    pub files: Vec<PathBuf>,
}

/// One render of the plan.
#[derive(Clone, Copy, Debug)]
struct Run {
    /// Index of the scene.
    scene: usize,
    backend: Backend,
    samples_per_pixel: u32,
    repeat: u32,
}

impl Run {
    /// Whether this is a higher rung of the same ladder.
    fn is_above(&self, top: &Self) -> bool {
        (self.scene, self.backend) == (top.scene, top.backend)
            && self.samples_per_pixel > top.samples_per_pixel
    }
}

/// A scene with its reference.
struct Subject {
    scene: BenchmarkScene,
    reference: Reference,
}

impl Ladder {
    /// Measures what the table in the output folder does not hold yet, and draws the plots. The table is written after
    /// every render, so that a run that is stopped goes on where it was.
    ///
    /// # Errors
    /// A scene, reference or table that cannot be used; a render that fails or is stopped; a file that cannot be
    /// written.
    pub fn measure(&self, observer: &ErrorTimeObserver) -> Result<Report, ErrorTimeError> {
        let peers = match &self.peers {
            Some(path) => peers::read(path)?,
            None => Vec::new(),
        };
        let subjects = self.subjects()?;
        make_folder(&self.output)?;
        let path = self.output.join(TABLE);
        let mut rows = table::read(&path)?;
        let found = self.climb(&subjects, &mut rows, &path, observer)?;
        let curves = self.curves(&subjects, &found.rows);
        let plots = PLOTS.map(|name| self.output.join(name));
        plot::write(&plots[0], &plots[1], &curves, &peers)
            .map_err(|(path, reason)| ErrorTimeError::Plot { path, reason })?;
        Ok(Report {
            other_scenes_of_peers: others(&peers, &curves),
            curves,
            rendered: found.rendered,
            kept: found.rows.len() - found.rendered,
            files: [path].into_iter().chain(plots).collect(),
        })
    }

    fn subjects(&self) -> Result<Vec<Subject>, ErrorTimeError> {
        let scenes = BenchmarkScene::read_all(&self.scenes, self.size)?;
        let with_reference = |scene: BenchmarkScene| {
            let folder = references_of(&scene, self.references.as_deref());
            let reference = Reference::read_for(&folder, &scene)?;
            Ok(Subject { scene, reference })
        };
        scenes.into_iter().map(with_reference).collect()
    }

    /// All renders. A repeat goes through all scenes and rungs before the next one begins, so that what slows the
    /// machine down for a while does not fall on one scene alone.
    fn runs(&self) -> Vec<Run> {
        let mut runs = Vec::new();
        for repeat in 0..self.repeats {
            for scene in 0..self.scenes.len() {
                for &backend in &self.backends {
                    for samples_per_pixel in self
                        .samples_per_pixel
                        .iter()
                        .copied()
                        .collect::<BTreeSet<_>>()
                    {
                        runs.push(Run {
                            scene,
                            backend,
                            samples_per_pixel,
                            repeat,
                        });
                    }
                }
            }
        }
        runs
    }

    fn climb(
        &self,
        subjects: &[Subject],
        rows: &mut Vec<Measurement>,
        path: &Path,
        observer: &ErrorTimeObserver,
    ) -> Result<Climbed, ErrorTimeError> {
        let runs = self.runs();
        let identity = Identity {
            threads: threads_or_all(self.threads),
            version: program_version(),
            seed: self.seed,
        };
        let work = |run: &Run| {
            let (width, height) = subjects[run.scene].scene.size_px();
            f64::from(width) * f64::from(height) * f64::from(run.samples_per_pixel)
        };
        let total: f64 = runs.iter().map(work).sum();
        let (mut climbed, mut done) = (Climbed::default(), 0.0);
        let mut tops: Vec<Run> = Vec::new();
        for (index, run) in runs.iter().enumerate() {
            if tops.iter().any(|top| run.is_above(top)) {
                done += work(run);
                continue;
            }
            let subject = &subjects[run.scene];
            let wanted = identity.row(subject, run);
            let row = match rows.iter().find(|row| row.repeats(&wanted)) {
                Some(row) => row.clone(),
                None => {
                    let message = self.message(&subject.scene.name, run);
                    let show = |share: f64| {
                        (observer.progress)(Some((done + share * work(run)) / total), &message);
                    };
                    show(0.0);
                    let row = render(subject, wanted, observer, &show).map_err(|error| {
                        if observer.cancel.load(Ordering::Relaxed) {
                            ErrorTimeError::Interrupted {
                                done: index,
                                total: runs.len(),
                                what: "renders",
                                kept: format!("{} has what is finished, and the same command goes on from there", path.display()),
                            }
                        } else {
                            error
                        }
                    })?;
                    rows.push(row.clone());
                    table::write(path, rows)?;
                    climbed.rendered += 1;
                    row
                }
            };
            if run.repeat == 0 && self.until.is_some_and(|until| row.rel_mse <= until) {
                tops.push(*run);
            }
            climbed.rows.push((run.scene, row));
            done += work(run);
        }
        Ok(climbed)
    }

    fn message(&self, scene: &str, run: &Run) -> String {
        let (backend, samples) = (run.backend, run.samples_per_pixel);
        let (repeat, repeats) = (run.repeat + 1, self.repeats);
        format!("{scene} on {backend}, {samples} samples per pixel, {repeat} of {repeats}")
    }

    fn curves(&self, subjects: &[Subject], rows: &[(usize, Measurement)]) -> Vec<Curve> {
        let mut curves = Vec::new();
        for (index, subject) in subjects.iter().enumerate() {
            let reference_error = subject.reference.relative_error_of_mean();
            for &backend in &self.backends {
                let own: Vec<&Measurement> = rows
                    .iter()
                    .filter(|(scene, row)| *scene == index && row.backend == backend)
                    .map(|(_, row)| row)
                    .collect();
                curves.push(Curve::of(
                    &subject.scene.name,
                    backend,
                    &own,
                    reference_error,
                ));
            }
        }
        curves
    }
}

/// The rows of a plan, each with the index of its scene.
#[derive(Default)]
struct Climbed {
    rows: Vec<(usize, Measurement)>,
    /// How many of them were rendered now.
    rendered: usize,
}

/// What all renders of a plan have in common.
struct Identity {
    threads: usize,
    version: String,
    seed: u64,
}

impl Identity {
    /// The row of a render as far as it is known before.
    fn row(&self, subject: &Subject, run: &Run) -> Measurement {
        let (scene, made) = (&subject.scene, &subject.reference.made);
        let (width_px, height_px) = scene.size_px();
        Measurement {
            scene: scene.name.clone(),
            scene_hash: scene.hash.clone(),
            width_px,
            height_px,
            backend: run.backend,
            threads: self.threads,
            samples_per_pixel: run.samples_per_pixel,
            repeat: run.repeat,
            seed: seed_of_run(self.seed, run.samples_per_pixel, run.repeat),
            version: self.version.clone(),
            setup_s: 0.0,
            render_s: 0.0,
            cpu_s: 0.0,
            paths: 0,
            path_vertices: 0,
            rel_mse: 0.0,
            rel_mse_of_reference: subject.reference.rel_mse(),
            bias_r: 0.0,
            bias_g: 0.0,
            bias_b: 0.0,
            bias_standard_error_r: 0.0,
            bias_standard_error_g: 0.0,
            bias_standard_error_b: 0.0,
            reference_seed: made.seed,
            reference_samples_per_pixel: made.samples_per_pixel,
            reference_version: made.version.clone(),
        }
    }
}

/// Renders and compares: `wanted` with its results.
fn render(
    subject: &Subject,
    wanted: Measurement,
    observer: &ErrorTimeObserver,
    show: &(dyn Fn(f64) + Sync),
) -> Result<Measurement, ErrorTimeError> {
    let scene = &subject.scene;
    let setup_s = scene.setup_s();
    let plan = Plan {
        samples_per_pixel: Some(wanted.samples_per_pixel),
        threads: Some(wanted.threads),
        max_bounces: scene.max_bounces(),
        ..Plan::new(wanted.seed)
    };
    let observe = |progress: &Progress| {
        let share = progress
            .rows_total
            .map(|total| progress.rows_done as f64 / total as f64);
        show(share.unwrap_or(0.0));
    };
    let (film, stats) =
        (wanted.backend).render(scene.prepared(), &plan, observer.cancel, &observe)?;
    if stats.interrupted {
        return Err(ErrorTimeError::Stopped);
    }
    let mean = film.layer(FilmLayer::Total);
    let error = compare(&mean, film.variance_of_mean(), &subject.reference);
    let ([bias_r, bias_g, bias_b], standard_error) = (error.bias, error.bias_standard_error);
    let [
        bias_standard_error_r,
        bias_standard_error_g,
        bias_standard_error_b,
    ] = standard_error;
    Ok(Measurement {
        setup_s,
        render_s: stats.render_s,
        cpu_s: stats.cpu_s,
        paths: stats.paths,
        path_vertices: stats.path_vertices,
        rel_mse: error.rel_mse,
        bias_r,
        bias_g,
        bias_b,
        bias_standard_error_r,
        bias_standard_error_g,
        bias_standard_error_b,
        ..wanted
    })
}

fn others(peers: &[PeerPoint], curves: &[Curve]) -> Vec<String> {
    let known = |name: &str| curves.iter().any(|c| c.scene == name);
    let names: BTreeSet<&str> = peers
        .iter()
        .map(|p| p.scene.as_str())
        .filter(|name| !known(name))
        .collect();
    names.into_iter().map(str::to_owned).collect()
}
