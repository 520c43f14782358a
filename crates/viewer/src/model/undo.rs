//! Undo and redo of settings.

use std::time::{Duration, Instant};

/// Steps that are kept.
const MOST_STEPS: usize = 200;
/// Changes that follow each other faster than this are one step, as while a slider is dragged.
const PAUSE: Duration = Duration::from_millis(600);

/// A value with its past and its undone future.
#[derive(Clone, Debug)]
pub struct History<T> {
    past: Vec<T>,
    present: T,
    future: Vec<T>,
    changed: Option<Instant>,
}

impl<T: Clone + PartialEq> History<T> {
    /// A value without a past.
    pub fn new(present: T) -> Self {
        Self {
            past: Vec::new(),
            present,
            future: Vec::new(),
            changed: None,
        }
    }

    /// The value last noted.
    pub fn present(&self) -> &T {
        &self.present
    }

    /// Takes note of the value at `now`. A change soon after another belongs to the same step.
    pub fn note(&mut self, value: &T, now: Instant) {
        if *value == self.present {
            return;
        }
        let goes_on = self.changed.is_some_and(|then| now - then < PAUSE);
        let before = std::mem::replace(&mut self.present, value.clone());
        if !goes_on {
            self.past.push(before);
            if self.past.len() > MOST_STEPS {
                self.past.remove(0);
            }
        }
        self.future.clear();
        self.changed = Some(now);
    }

    /// One step back; the value then, or `None` at the beginning.
    pub fn undo(&mut self) -> Option<T> {
        let before = self.past.pop()?;
        let after = std::mem::replace(&mut self.present, before);
        self.future.push(after);
        self.changed = None;
        Some(self.present.clone())
    }

    /// One undone step forward again; the value then.
    pub fn redo(&mut self) -> Option<T> {
        let after = self.future.pop()?;
        let before = std::mem::replace(&mut self.present, after);
        self.past.push(before);
        self.changed = None;
        Some(self.present.clone())
    }

    /// Whether there is a step to undo.
    pub fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    /// Whether there is a step to redo.
    pub fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drag_is_one_step() {
        let start = Instant::now();
        let at = |ms| start + Duration::from_millis(ms);
        let mut history = History::new(0);
        for i in 1..=50 {
            history.note(&i, at(16 * i));
        }
        history.note(&99, at(10_000));
        assert_eq!(history.undo(), Some(50));
        assert_eq!(history.undo(), Some(0));
        assert_eq!(history.undo(), None);
        assert_eq!((history.redo(), history.redo()), (Some(50), Some(99)));
        assert_eq!(history.redo(), None);
    }

    #[test]
    fn a_change_after_undo_ends_the_future_and_the_past_is_bounded() {
        let start = Instant::now();
        let mut history = History::new(0_u64);
        for i in 1..=500 {
            history.note(&i, start + Duration::from_secs(i));
        }
        assert_eq!(history.undo(), Some(499));
        history.note(&7, start + Duration::from_secs(600));
        assert!(!history.can_redo());
        let mut steps = 0;
        while history.undo().is_some() {
            steps += 1;
        }
        assert_eq!(steps, MOST_STEPS);
    }
}
