//! Ranges of numbers in a scene file, and how they are said in errors.

/// Largest magnitude of any number in a scene file; keeps every product of two of them finite.
const LARGEST: f64 = 1e12;

/// The values that a number may take, with its unit.
#[derive(Clone, Copy)]
pub(super) struct Range {
    low: f64,
    high: f64,
    low_open: bool,
    high_open: bool,
    unit: &'static str,
}

impl Range {
    /// Any finite number.
    pub(super) const fn finite(unit: &'static str) -> Self {
        Self::closed(f64::NEG_INFINITY, f64::INFINITY, unit)
    }
    /// `>= 0`.
    pub(super) const fn non_negative(unit: &'static str) -> Self {
        Self::closed(0.0, f64::INFINITY, unit)
    }
    /// `> 0`.
    pub(super) const fn positive(unit: &'static str) -> Self {
        Self {
            low_open: true,
            ..Self::non_negative(unit)
        }
    }
    /// `>= low`.
    pub(super) const fn at_least(low: f64, unit: &'static str) -> Self {
        Self::closed(low, f64::INFINITY, unit)
    }
    /// `[low, high]`.
    pub(super) const fn closed(low: f64, high: f64, unit: &'static str) -> Self {
        Self {
            low,
            high,
            low_open: false,
            high_open: false,
            unit,
        }
    }
    /// `[low, high)`.
    pub(super) const fn below(low: f64, high: f64, unit: &'static str) -> Self {
        Self {
            high_open: true,
            ..Self::closed(low, high, unit)
        }
    }
    /// `(low, high]`.
    pub(super) const fn above(low: f64, high: f64, unit: &'static str) -> Self {
        Self {
            low_open: true,
            ..Self::closed(low, high, unit)
        }
    }

    fn contains(&self, x: f64) -> bool {
        let above = if self.low_open {
            x > self.low
        } else {
            x >= self.low
        };
        let below = if self.high_open {
            x < self.high
        } else {
            x <= self.high
        };
        above && below
    }

    /// The range in words, such as `>= 0 1/m`.
    pub(super) fn describe(&self) -> String {
        let range = match (self.low.is_finite(), self.high.is_finite()) {
            (false, false) => String::new(),
            (true, false) => format!("{} {}", if self.low_open { ">" } else { ">=" }, self.low),
            (false, true) => format!("{} {}", if self.high_open { "<" } else { "<=" }, self.high),
            (true, true) => format!(
                "in {}{}, {}{}",
                if self.low_open { '(' } else { '[' },
                self.low,
                self.high,
                if self.high_open { ')' } else { ']' }
            ),
        };
        [range.as_str(), self.unit]
            .iter()
            .filter(|part| !part.is_empty())
            .copied()
            .collect::<Vec<_>>()
            .join(" ")
    }

    /// What is wrong with `x`, said as what would be right; `None` when it is fine.
    pub(super) fn refusal(&self, x: f64) -> Option<String> {
        if !x.is_finite() {
            Some(
                format!("a finite number {}", self.describe())
                    .trim_end()
                    .to_string(),
            )
        } else if !self.contains(x) {
            Some(self.describe())
        } else if x.abs() > LARGEST {
            Some(format!("at most {LARGEST:e} in magnitude"))
        } else {
            None
        }
    }
}
