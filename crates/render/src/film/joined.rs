//! Two films of one view as one.

use super::{Film, Row};
use uw_media::Spectrum;

impl Film {
    /// Adds the samples of another film of the same size, lamps and snow, with other random numbers.
    pub(crate) fn join(&mut self, other: &Self) {
        for (row, more) in self.rows.iter_mut().zip(&other.rows) {
            row.join(more);
        }
    }
}

impl Row {
    fn join(&mut self, other: &Self) {
        if self.sums.is_empty() {
            self.sums.clone_from(&other.sums);
        } else {
            add(&mut self.sums, &other.sums);
        }
        self.lines = self.lines.zip(other.lines).map(|(mut own, theirs)| {
            add(&mut own, &theirs);
            own
        });
        self.batches += other.batches;
        self.samples += other.samples;
    }
}

fn add(sums: &mut [Spectrum], more: &[Spectrum]) {
    for (sum, more) in sums.iter_mut().zip(more) {
        (0..3).for_each(|k| sum[k] += more[k]);
    }
}
