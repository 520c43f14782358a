//! Batches of samples over the rows of a film, until a plan is done.

use std::{
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    time::Instant,
};

use rayon::prelude::*;

use super::{Plan, Progress, coarse::CoarseFirst};
use crate::{
    film::{Film, Row},
    kernels::Work,
    prepare::Prepared,
    processor::{RowBatch, RowWorker, Shared},
};

/// What becomes of the first batch where the time does not last for it.
pub(super) enum FirstBatch<'a> {
    /// It is finished whatever the time, so that there is a picture.
    Whole,
    /// It ends with the time.
    InTime,
    /// It ends with the time, or where too little of it would be done by then: a coarse picture stands in for the rest.
    Backed(&'a CoarseFirst<'a>),
}

pub(super) struct RowRender<'a> {
    scene: &'a Prepared,
    plan: &'a Plan,
    shared: &'a Shared<'a>,
    start: Instant,
    pub(super) end: Option<Instant>,
    pub(super) first_batch: FirstBatch<'a>,
    cancel: &'a AtomicBool,
    observe: &'a (dyn Fn(&Progress) + Sync),
    rows_done: AtomicU64,
    work: Mutex<Work>,
}

impl<'a> RowRender<'a> {
    pub(super) fn new(
        scene: &'a Prepared,
        plan: &'a Plan,
        shared: &'a Shared<'a>,
        start: Instant,
        cancel: &'a AtomicBool,
        observe: &'a (dyn Fn(&Progress) + Sync),
    ) -> Self {
        Self {
            scene,
            plan,
            shared,
            start,
            end: plan.end(start),
            first_batch: FirstBatch::Whole,
            cancel,
            observe,
            rows_done: AtomicU64::new(0),
            work: Mutex::new(Work::default()),
        }
    }

    /// Work done.
    pub(super) fn work(&self) -> Work {
        *self.work.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn run(&self, film: &mut Film) {
        let mut batch = 0;
        let mut done = 0;
        while let Some(samples) = self.plan.next_batch(batch, done) {
            film.rows.par_iter_mut().enumerate().for_each_init(
                || RowWorker::new(self.shared),
                |worker, (index, row)| {
                    if !self.leaves(batch) {
                        self.render_row(worker, index as u32, batch, samples, row);
                    }
                },
            );
            batch += 1;
            done += samples;
            if self.cancelled() || self.out_of_time() || self.plan.is_met_by(film) {
                return;
            }
        }
    }

    fn render_row(
        &self,
        worker: &mut RowWorker<'_>,
        index: u32,
        batch: u32,
        samples: u32,
        row: &mut Row,
    ) {
        worker.work = Work::default();
        let at = RowBatch {
            seed: self.plan.seed,
            row: index,
            batch,
            samples,
        };
        let complete = worker.add_row(at, row, &|| self.leaves(batch));
        let mut work = self.work.lock().unwrap_or_else(PoisonError::into_inner);
        work.add(worker.work);
        drop(work);
        if !complete {
            return;
        }
        let rows_done = self.rows_done.fetch_add(1, Ordering::Relaxed) + 1;
        (self.observe)(&Progress {
            rows_done,
            rows_total: self.plan.rows_total(self.scene.camera.height),
            elapsed: self.start.elapsed(),
        });
    }

    /// Whether to leave this batch as it is.
    fn leaves(&self, batch: u32) -> bool {
        let too_late = || match self.first_batch {
            FirstBatch::Whole if batch == 0 => false,
            FirstBatch::Backed(coarse) if batch == 0 => {
                let rows = self.rows_done.load(Ordering::Relaxed) as f64;
                coarse.is_hopeless(rows / f64::from(self.scene.camera.height))
            }
            _ => self.out_of_time(),
        };
        self.cancelled() || too_late()
    }

    fn cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }

    fn out_of_time(&self) -> bool {
        self.end.is_some_and(|end| Instant::now() >= end)
    }
}
