//! A render on the CPU in steps, for callers that look at the film while it fills and may leave at any moment.

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::{Instructions, Plan, share};
use crate::{
    film::{Film, Row},
    kernels::{GpuError, Work},
    prepare::Prepared,
    processor::{Precision, RowBatch, RowWorker, Shared},
};

/// Adds batches of samples to a film, one step at a time, on the rayon pool in which it is called.
///
/// Whenever a step returns, the film is valid: every row holds whole batches. A step that was stopped goes on with
/// the rows that lack the batch, so that no row gets ahead by more than one.
pub struct Stepper<'a> {
    scene: &'a Prepared,
    shared: Shared<'a>,
    seed: u64,
    batch: u32,
    batch_samples: u32,
    paths: AtomicU64,
}

impl<'a> Stepper<'a> {
    /// A render of `scene` in double precision, as [`super::render`], that has not begun. Of `plan` count the seed, the
    /// bounces and the dark lamps.
    ///
    /// # Errors
    /// The scene has more triangles than the kernels can name.
    pub fn new(scene: &'a Prepared, plan: &Plan) -> Result<Self, GpuError> {
        Self::by(Precision::Double, scene, plan)
    }

    /// The same on the processor's vector units, as [`super::render_lanes`].
    ///
    /// # Errors
    /// As in [`Stepper::new`].
    pub fn on_lanes(scene: &'a Prepared, plan: &Plan) -> Result<Self, GpuError> {
        Self::by(Precision::Single(Instructions::best()), scene, plan)
    }

    fn by(precision: Precision, scene: &'a Prepared, plan: &Plan) -> Result<Self, GpuError> {
        Ok(Self {
            scene,
            shared: share(scene, plan, precision)?,
            seed: plan.seed,
            batch: 0,
            batch_samples: 0,
            paths: AtomicU64::new(0),
        })
    }

    /// An empty film of the camera's size.
    pub fn film(&self) -> Film {
        let camera = &self.scene.camera;
        Film::new(camera.width, camera.height, self.scene.lamps.len())
    }

    /// Walks started at the camera so far.
    pub fn paths(&self) -> u64 {
        self.paths.load(Ordering::Relaxed)
    }

    /// Adds a batch of `samples` samples per pixel to `film`, or what is missing of the batch begun in an earlier
    /// step, whose size then holds. `stop` is asked before every pixel, or group of pixels. Returns whether the batch is complete.
    pub fn step(
        &mut self,
        film: &mut Film,
        samples: u32,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> bool {
        if film.rows.iter().all(|row| row.batches == self.batch) {
            self.batch_samples = samples.max(1);
        }
        let this = &*self;
        film.rows.par_iter_mut().enumerate().for_each_init(
            || RowWorker::new(&this.shared),
            |worker, (index, row)| {
                if row.batches == this.batch && !stop() {
                    this.add_row(worker, index as u32, row, stop);
                }
            },
        );
        let complete = film.rows.iter().all(|row| row.batches > self.batch);
        if complete {
            self.batch += 1;
        }
        complete
    }

    /// Adds the batch to a row, or leaves it as it was where it is stopped.
    fn add_row(
        &self,
        worker: &mut RowWorker<'_>,
        index: u32,
        row: &mut Row,
        stop: &(dyn Fn() -> bool + Sync),
    ) {
        worker.work = Work::default();
        let at = RowBatch {
            seed: self.seed,
            row: index,
            batch: self.batch,
            samples: self.batch_samples,
        };
        worker.add_row(at, row, stop);
        self.paths.fetch_add(worker.work.paths, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;
    use crate::film::FilmLayer;
    use crate::integrator::{Progress, RenderError, RenderStats, render, render_lanes};
    use crate::scene::Scene;

    const SCENE: &str = r#"
        format = "uw-scene/1"
        water = { a = [0.3, 0.1, 0.05], b = [0.2, 0.2, 0.2] }
        camera = { position_m = [0, 0, 0], forward = [1, 0, 0], hfov_deg = 60, width = 12, height = 8 }
        [[lamp]]
        position_m = [0.0, -0.3, 0.0]
        intensity = [10.0, 10.0, 10.0]
        [[object]]
        plane = { center_m = [1.5, 0, 0], normal = [-1, 0, 0], up = [0, 0, 1], size_m = [8, 8] }
        reflectance = [0.5, 0.4, 0.3]
    "#;

    fn prepared() -> Prepared {
        let scene = Scene::parse(SCENE, "".as_ref(), "test").expect("valid");
        Prepared::build(&scene)
    }

    fn plan(samples: u32) -> Plan {
        Plan {
            samples_per_pixel: Some(samples),
            ..Plan::new(5)
        }
    }

    type Render = fn(
        &Prepared,
        &Plan,
        &AtomicBool,
        &(dyn Fn(&Progress) + Sync),
    ) -> Result<(Film, RenderStats), RenderError>;
    type New = for<'a> fn(&'a Prepared, &Plan) -> Result<Stepper<'a>, GpuError>;

    /// Steppers, the renders they are the steps of, and after how many questions a step is stopped, within a batch of rows.
    const METHODS: [(New, Render, u64); 2] = [
        (|scene, plan| Stepper::new(scene, plan), render, 2),
        (
            |scene, plan| Stepper::on_lanes(scene, plan),
            render_lanes,
            5,
        ),
    ];

    #[test]
    fn two_steps_are_a_render_of_two_batches() {
        let scene = prepared();
        for (new, render, _) in METHODS {
            let mut stepper = new(&scene, &plan(8)).expect("few triangles");
            let mut film = stepper.film();
            for _ in 0..2 {
                assert!(stepper.step(&mut film, 4, &|| false));
            }
            let (whole, stats) =
                render(&scene, &plan(8), &AtomicBool::new(false), &|_| {}).expect("rendered");
            assert_eq!(film.layer(FilmLayer::Total), whole.layer(FilmLayer::Total));
            assert_eq!(film.relative_error(), whole.relative_error());
            assert_eq!((film.samples(), stepper.paths()), (8, stats.paths));
        }
    }

    #[test]
    fn a_stopped_step_leaves_whole_rows_and_goes_on_where_it_was() {
        let scene = prepared();
        for (new, _, allowed) in METHODS {
            let mut stepper = new(&scene, &plan(8)).expect("few triangles");
            let mut film = stepper.film();
            let asked = AtomicU64::new(0);
            let mut rounds = 0;
            loop {
                // Another size of the batch must not count for the rows that are left.
                let samples = if rounds == 0 { 4 } else { 1 };
                asked.store(0, Ordering::Relaxed);
                let stop = || asked.fetch_add(1, Ordering::Relaxed) > allowed;
                if stepper.step(&mut film, samples, &stop) {
                    break;
                }
                let is_whole = |row: &Row| row.samples == 4 * u64::from(row.batches);
                assert!(film.rows.iter().all(is_whole));
                rounds += 1;
                assert!(rounds < 100, "no progress");
            }
            assert!(rounds > 1, "nothing was stopped");
            let mut other = new(&scene, &plan(8)).expect("few triangles");
            let mut whole = other.film();
            other.step(&mut whole, 4, &|| false);
            assert_eq!(film.layer(FilmLayer::Total), whole.layer(FilmLayer::Total));
        }
    }
}
