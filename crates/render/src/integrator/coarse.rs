//! Renders under a time limit: where the first round over all pixels may not end in time, a coarse picture of the same
//! view comes first. It stands in for the rows that the time does not last for, so that there is always a whole picture.
//!
//! The coarse picture has the same camera with fewer, larger pixels: its values are unbiased means over squares of
//! pixels. The kernels in double precision make it whatever renders the picture itself, because they need the fewest tables.
//! Nothing of it enters a pixel that has samples of its own.

use std::{
    sync::atomic::{AtomicBool, Ordering},
    time::Instant,
};

use super::{FirstBatch, Plan, RenderError, RowRender, share};
use crate::{film::Film, kernels::Work, prepare::Prepared, processor::Precision, scene::Camera};

/// Most pixels of the first coarse picture, from which the time of others is reckoned. It is finished whatever the time.
const FIRST_PIXELS: u64 = 256;
/// Samples of a pixel of coarse pictures, but for the last one, which gets what the time lasts for.
const SAMPLES: u32 = 4;
/// Most that the side of pixels shrinks by from one coarse picture to the next, so that their times can be foretold.
const MOST_REFINEMENT: u32 = 8;
/// Time in which the first round over all pixels is finished whatever the limit, s.
const SHORT_S: f64 = 0.25;
/// Part of the time left that the first round may take without a better coarse picture than the first one.
const SAFE_SHARE: f64 = 0.5;
/// Part of the time left that a coarse picture may take before the picture itself is tried.
const EARLY_SHARE: f64 = 0.2;
/// The same where the picture itself is out of reach.
const LATE_SHARE: f64 = 0.8;
/// Part of all rows that must come within reach for the picture itself to go on.
const WORTHWHILE_ROWS: f64 = 0.5;
/// Part of the time left after which that is judged by the rows done.
const JUDGED_AFTER: f64 = 0.15;

/// A coarse picture, and what may be done with the rest of the time.
pub(crate) struct CoarseFirst<'a> {
    scene: &'a Prepared,
    plan: Plan,
    cancel: &'a AtomicBool,
    end: Instant,
    best: Level,
    /// When the picture itself was begun.
    begun: Instant,
    work: Work,
}

/// A coarse picture.
struct Level {
    film: Film,
    /// Side of its pixels, pixels of the picture.
    step: u32,
    /// Time of a sample, all threads together, s.
    sample_s: f64,
    work: Work,
}

impl<'a> CoarseFirst<'a> {
    /// Makes a coarse picture in a part of the time of `plan`, counted from `start`. None without a time limit, and none
    /// where the first round over all pixels is short.
    pub(crate) fn begin(
        scene: &'a Prepared,
        plan: &Plan,
        cancel: &'a AtomicBool,
        start: Instant,
    ) -> Result<Option<Self>, RenderError> {
        let Some(end) = plan.end(start) else {
            return Ok(None);
        };
        let mut step = 1;
        while pixels(&scene.camera, step) > FIRST_PIXELS {
            step *= 2;
        }
        if step == 1 {
            return Ok(None);
        }
        let Some(best) = Level::render(scene, plan, cancel, step, Until::Done)? else {
            return Ok(None);
        };
        let mut coarse = Self {
            scene,
            plan: plan.clone(),
            cancel,
            end,
            work: best.work,
            best,
            begun: start,
        };
        if coarse.first_round_s() <= SHORT_S {
            return Ok(None);
        }
        while coarse.first_round_s() > SAFE_SHARE * coarse.left_s() {
            let Some((step, _)) = coarse.finer(EARLY_SHARE) else {
                break;
            };
            if !coarse.replace(step, Until::DoneBy(coarse.end))? {
                break;
            }
        }
        coarse.begun = Instant::now();
        Ok(Some(coarse))
    }

    /// Whether enough of the picture itself is within reach of what makes up to `speed` samples in the time of one by
    /// double precision.
    pub(crate) fn leaves_time_for(&self, speed: f64) -> bool {
        WORTHWHILE_ROWS * self.first_round_s() <= speed * self.left_s()
    }

    /// Whether the first round over the picture, of which the part `done` is done, is to be left: the time is over, or
    /// it shows that too little would be done by its end.
    pub(crate) fn is_hopeless(&self, done: f64) -> bool {
        let now = Instant::now();
        let whole = self.end.saturating_duration_since(self.begun).as_secs_f64();
        let gone = now.saturating_duration_since(self.begun).as_secs_f64();
        now >= self.end || (gone > JUDGED_AFTER * whole && done * whole < WORTHWHILE_ROWS * gone)
    }

    /// Lets the best coarse picture stand in for the rows of `film` without samples, where there are any and the render
    /// has not been cancelled; what is left of the time makes it better. Returns the work of all coarse pictures.
    pub(crate) fn complete(mut self, film: &mut Film) -> Result<Work, RenderError> {
        let cancelled = |this: &Self| this.cancel.load(Ordering::Relaxed);
        let done = film.rows.iter().filter(|row| row.batches > 0).count();
        if cancelled(&self) || done == film.rows.len() {
            return Ok(self.work);
        }
        if (done as f64) < WORTHWHILE_ROWS * film.rows.len() as f64 {
            // A few sharp rows in a coarse picture serve nobody.
            *film = Film::new(film.width, film.height, film.lamps());
        }
        self.use_up_time()?;
        if !cancelled(&self) {
            film.stand_in(self.best.film, self.best.step);
        }
        Ok(self.work)
    }

    /// Makes ever finer coarse pictures, and gives the finest that fits as many samples as the time lasts for.
    fn use_up_time(&mut self) -> Result<(), RenderError> {
        while let Some((step, is_last)) = self.finer(LATE_SHARE) {
            let until = if is_last {
                Until::TimeIsUp(self.end)
            } else {
                Until::DoneBy(self.end)
            };
            if !self.replace(step, until)? || is_last {
                return Ok(());
            }
        }
        // No finer one fits: the same again with more samples, where there is time for more than twice as many.
        if self.left_s() > 2.0 * self.round_s(self.best.step, SAMPLES) {
            self.replace(self.best.step, Until::TimeIsUp(self.end))?;
        }
        Ok(())
    }

    fn left_s(&self) -> f64 {
        let left = self.end.saturating_duration_since(Instant::now());
        left.as_secs_f64()
    }

    /// Time of the first round over all pixels, s.
    fn first_round_s(&self) -> f64 {
        self.round_s(1, self.plan.next_batch(0, 0).unwrap_or(1))
    }

    fn round_s(&self, step: u32, samples: u32) -> f64 {
        pixels(&self.scene.camera, step) as f64 * f64::from(samples) * self.best.sample_s
    }

    /// The smallest pixels, of two pixels a side or more, of a coarse picture that takes at most `share` of the time left,
    /// and whether they could not be smaller in a further one; `None` where no finer one fits than there is.
    fn finer(&self, share: f64) -> Option<(u32, bool)> {
        let available_s = share * self.left_s();
        let fits = |step: &u32| self.round_s(*step, SAMPLES) <= available_s;
        let step = (2..self.best.step).find(fits)?;
        let least = self.best.step.div_ceil(MOST_REFINEMENT);
        Some((step.max(least), step >= least))
    }

    /// Makes a coarse picture and takes it for the best one where it is finished.
    fn replace(&mut self, step: u32, until: Until) -> Result<bool, RenderError> {
        let made = Level::render(self.scene, &self.plan, self.cancel, step, until)?;
        let is_there = made.is_some();
        if let Some(level) = made {
            self.work.add(level.work);
            self.best = level;
        }
        Ok(is_there)
    }
}

/// When a coarse picture ends.
#[derive(Clone, Copy)]
enum Until {
    /// After its samples.
    Done,
    /// The same, but it is given up at this time.
    DoneBy(Instant),
    /// At this time, with as many samples as it lasts for; given up where it does not last for the first ones.
    TimeIsUp(Instant),
}

impl Level {
    /// A coarse picture; `None` where it was cancelled or given up.
    fn render(
        scene: &Prepared,
        plan: &Plan,
        cancel: &AtomicBool,
        step: u32,
        until: Until,
    ) -> Result<Option<Self>, RenderError> {
        let start = Instant::now();
        let mut small = scene.clone();
        small.camera = coarser(&scene.camera, step);
        let (samples, end) = match until {
            Until::Done => (Some(SAMPLES), None),
            Until::DoneBy(end) => (Some(SAMPLES), Some(end)),
            Until::TimeIsUp(end) => (None, Some(end)),
        };
        let plan = Plan {
            samples_per_pixel: samples,
            time_limit: None,
            target_error: None,
            ..plan.clone()
        };
        let shared = share(&small, &plan, Precision::Double)?;
        let unobserved = |_: &super::Progress| {};
        let mut job = RowRender::new(&small, &plan, &shared, start, cancel, &unobserved);
        job.end = end;
        if end.is_some() {
            job.first_batch = FirstBatch::InTime;
        }
        let (width, height) = (small.camera.width, small.camera.height);
        let mut film = Film::new(width, height, small.lamps.len());
        job.run(&mut film);
        let work = job.work();
        let rows: u64 = film.rows.iter().map(|row| row.samples).sum();
        let samples = (rows * u64::from(width)) as f64;
        let level = (film.samples() > 0).then(|| Self {
            film,
            step,
            sample_s: start.elapsed().as_secs_f64() / samples,
            work,
        });
        Ok(level)
    }
}

/// Pixels of a coarse picture.
fn pixels(camera: &Camera, step: u32) -> u64 {
    let side = |pixels: u32| u64::from((pixels / step).max(1));
    side(camera.width) * side(camera.height)
}

/// The same camera with pixels that are `step` pixels wide and high; what is left over at the right and at the bottom is
/// not seen.
fn coarser(camera: &Camera, step: u32) -> Camera {
    let factor = f64::from(step).recip();
    Camera {
        width: (camera.width / step).max(1),
        height: (camera.height / step).max(1),
        focal_px: factor * camera.focal_px,
        centre_px: factor * camera.centre_px,
        ..camera.clone()
    }
}

#[cfg(test)]
mod tests {
    use std::{path::Path, time::Duration};

    use super::*;
    use crate::{film::FilmLayer, integrator::render, scene::Scene};

    fn prepared(width: u32, height: u32) -> Prepared {
        let text = format!(
            "format = \"uw-scene/1\"\nwater = {{ a = [0.3, 0.1, 0.05], b = [0.9, 0.9, 0.9] }}\n\
             camera = {{ position_m = [0, 0, 0], forward = [1, 0, 0], fx = 300, cx = 150, cy = 90, \
             distortion = [-0.1, 0.01, 0.001, 0.0, 0.0], width = {width}, height = {height} }}\n\
             [[lamp]]\nposition_m = [0.0, -0.3, 0.0]\nintensity = [10.0, 10.0, 10.0]\n"
        );
        let scene = Scene::parse(&text, Path::new("."), "test").unwrap_or_else(|e| panic!("{e}"));
        Prepared::build(&scene)
    }

    #[test]
    fn coarse_pixels_are_squares_of_pixels() {
        let camera = prepared(331, 187).camera;
        for step in [2, 3, 16, 500] {
            let coarse = coarser(&camera, step);
            assert_eq!(
                pixels(&camera, step),
                u64::from(coarse.width * coarse.height)
            );
            for (x, y) in [(0.0, 0.0), (1.0, 1.0), (0.25, 0.5)] {
                let side = f64::from(step);
                let (ours, theirs) = (coarse.direction(x, y), camera.direction(side * x, side * y));
                assert!((ours - theirs).length() < 1e-12, "{step}: {ours} {theirs}");
            }
        }
    }

    /// A limit far too short for the first round: the whole picture is there, its mean that of a plain render.
    #[test]
    fn a_coarse_picture_stands_in_for_what_the_time_does_not_last_for() {
        let (scene, small) = (prepared(4000, 3000), prepared(4000, 3000));
        let go_on = AtomicBool::new(false);
        let plan = Plan {
            samples_per_pixel: Some(64),
            time_limit: Some(Duration::ZERO),
            ..Plan::new(5)
        };
        let (film, stats) =
            render(&scene, &plan, &go_on, &|_| {}).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(stats.filled_pixels, 12_000_000);
        assert_eq!((stats.samples_per_pixel, stats.relative_error), (0, None));
        let step = stats.coarse_step_px.expect("coarse");
        assert!(step >= 16 && stats.coarse_samples == Some(4), "{stats:?}");
        let plain = Level::render(&small, &plan, &go_on, step, Until::Done)
            .unwrap_or_else(|e| panic!("{e}"))
            .expect("not cancelled");
        let total = film.layer(FilmLayer::Total);
        let expected = plain.film.layer(FilmLayer::Total);
        for (x, y) in [(0, 0), (1999, 1500), (3999, 2999)] {
            let (width, height) = (plain.film.width as usize, plain.film.height as usize);
            let column = (x / step as usize).min(width - 1);
            let row = (y / step as usize).min(height - 1);
            assert_eq!(
                total[y * 4000 + x],
                expected[row * width + column],
                "{x} {y}"
            );
        }
    }
}
