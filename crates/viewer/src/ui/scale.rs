//! Scales of colours, and numbers as one reads them beside a scale.

use egui::{Painter, Rect, pos2};

use crate::model::FalseColour;

/// Steps in which a scale is painted.
const STEPS: usize = 64;
/// Significant digits of the ends of a scale, unless what is between them needs more.
const DIGITS: usize = 3;
/// How far what is read between the ends may be from what is.
const SPAN_WITHIN: f64 = 0.1;
/// Most significant digits: those of single precision.
const MOST_DIGITS: usize = 8;

/// A number with that many significant digits, plain from a thousandth to below a million.
pub fn figure(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return value.to_string();
    }
    let power = value.abs().log10().floor() as i32;
    let after_first = digits.max(1) - 1;
    if (-3..6).contains(&power) {
        let decimals = (after_first as i32 - power).max(0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.after_first$e}")
    }
}

/// The ends of a scale, with more digits where what is between them would read otherwise than it is.
pub fn ends(low: f64, high: f64) -> [String; 2] {
    let written = |digits| [low, high].map(|value| figure(value, digits));
    let told_apart = |ends: &[String; 2]| {
        let [low_read, high_read] = ends.each_ref().map(|end| end.parse().unwrap_or(f64::NAN));
        ((high_read - low_read) / (high - low) - 1.0).abs() <= SPAN_WITHIN
    };
    let found = (DIGITS..MOST_DIGITS).map(written).find(told_apart);
    found.unwrap_or_else(|| written(MOST_DIGITS))
}

/// Paints a scale: from the bottom to the top where `rect` is higher than wide, else from left to right.
pub fn paint(painter: &Painter, rect: Rect, colours: FalseColour) {
    let upright = rect.height() > rect.width();
    for i in 0..STEPS {
        let [from, to] = [i, i + 1].map(|k| k as f32 / STEPS as f32);
        let step = if upright {
            let y = |t: f32| rect.bottom() - t * rect.height();
            Rect::from_min_max(pos2(rect.left(), y(to)), pos2(rect.right(), y(from)))
        } else {
            let x = |t: f32| rect.left() + t * rect.width();
            Rect::from_min_max(pos2(x(from), rect.top()), pos2(x(to), rect.bottom()))
        };
        // Half a point more than its own, so that no gap shows between two.
        painter.rect_filled(step.expand(0.25), 0.0, colours.colour(0.5 * (from + to)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_plainly_unless_they_are_tiny_or_huge() {
        for (value, expected) in [
            (1.5628, "1.56"),
            (0.0713, "0.0713"),
            (-21.26, "-21.3"),
            (130.4, "130"),
            (123_456.0, "123456"),
            (-0.0, "0"),
            (7.1e-5, "7.10e-5"),
            (2.5e9, "2.50e9"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(figure(value, 3), expected);
        }
        assert_eq!(figure(1.5628, 5), "1.5628");
    }

    #[test]
    fn ends_that_differ_read_differently() {
        assert_eq!(ends(0.95, 2.13), ["0.950", "2.13"]);
        assert_eq!(ends(1.5001, 1.5006), ["1.5001", "1.5006"]);
        assert_eq!(ends(3.0, 3.0), ["3.0000000", "3.0000000"]);
    }
}
