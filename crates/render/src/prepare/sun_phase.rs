//! The phase function's mean over the sun's disk.

use std::sync::{Arc, Mutex, PoisonError};

use uw_media::phase::{DiskTable, Phase};

/// Steps of the disk's radius to an octave: it is right within 1.1 %.
const STEPS: f64 = 32.0;
/// Tables that are kept for the next scene: a window prepares one after the other.
const KEPT: usize = 8;

type Made = (Phase, i32, Arc<DiskTable>);

static LAST: Mutex<Vec<Made>> = Mutex::new(Vec::new());

/// The table of a phase function and a disk's radius, rad. It takes 0.05 s to make and is kept.
pub(super) fn sun_phase(phase: &Phase, radius_rad: f64) -> Arc<DiskTable> {
    let step = (STEPS * radius_rad.log2()).round() as i32;
    let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((.., table)) = last.iter().find(|made| made.1 == step && made.0 == *phase) {
        return Arc::clone(table);
    }
    let table = Arc::new(DiskTable::new(phase, (f64::from(step) / STEPS).exp2()));
    if last.len() == KEPT {
        last.remove(0);
    }
    last.push((phase.clone(), step, Arc::clone(&table)));
    table
}
