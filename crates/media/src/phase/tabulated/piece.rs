//! One piece of a tabulated phase function, with its exact integral and inverse.

/// The function between two values of `x`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    /// Start and end in x.
    x: (f64, f64),
    /// Values at start and end, 1/sr once normalised; the start of a head is not used.
    p: (f64, f64),
    shape: Shape,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    /// A straight line.
    Line,
    /// `p ~ x^exponent` between two values of x > 0.
    Power { exponent: f64 },
    /// `p ~ x^exponent` from x = 0 on, exponent > -1.
    Head { exponent: f64 },
}

impl Piece {
    /// Through two points: a power law where both can be drawn in log-log, otherwise a line.
    pub(super) fn between((x0, p0): (f64, f64), (x1, p1): (f64, f64)) -> Self {
        let shape = if x0 > 0.0 && p0 > 0.0 && p1 > 0.0 {
            Shape::Power {
                exponent: (p1 / p0).ln() / (x1 / x0).ln(),
            }
        } else {
            Shape::Line
        };
        Self {
            x: (x0, x1),
            p: (p0, p1),
            shape,
        }
    }

    /// From x = 0 to a point, as a power law with an exponent > -1.
    pub(super) fn head((x1, p1): (f64, f64), exponent: f64) -> Self {
        Self {
            x: (0.0, x1),
            p: (p1, p1),
            shape: Shape::Head { exponent },
        }
    }

    pub(super) fn end(&self) -> f64 {
        self.x.1
    }

    pub(super) fn scale(&mut self, factor: f64) {
        self.p = (self.p.0 * factor, self.p.1 * factor);
    }

    fn slope(&self) -> f64 {
        (self.p.1 - self.p.0) / (self.x.1 - self.x.0)
    }

    pub(super) fn value(&self, x: f64) -> f64 {
        match self.shape {
            Shape::Line => {
                let share = (x - self.x.0) / (self.x.1 - self.x.0);
                self.p.0 * (1.0 - share) + self.p.1 * share
            }
            Shape::Power { exponent } | Shape::Head { exponent } => {
                self.p.1 * (exponent * (x / self.x.1).ln()).exp()
            }
        }
    }

    /// ∫ p dx over the piece.
    pub(super) fn integral(&self) -> f64 {
        self.integral_to(self.x.1)
    }

    /// ∫ p dx from the start to `x`.
    pub(super) fn integral_to(&self, x: f64) -> f64 {
        match self.shape {
            Shape::Line => 0.5 * (self.p.0 + self.value(x)) * (x - self.x.0),
            Shape::Power { exponent } => {
                self.p.0 * self.x.0 * power_integral(exponent + 1.0, (x / self.x.0).ln())
            }
            Shape::Head { exponent } => {
                let a = exponent + 1.0;
                self.p.1 * self.x.1 / a * (a * (x / self.x.1).ln()).exp()
            }
        }
    }

    /// ∫ p dx from `x` to the end.
    pub(super) fn integral_from(&self, x: f64) -> f64 {
        match self.shape {
            Shape::Line => 0.5 * (self.value(x) + self.p.1) * (self.x.1 - x),
            Shape::Power { exponent } | Shape::Head { exponent } => {
                -self.p.1 * self.x.1 * power_integral(exponent + 1.0, (x / self.x.1).ln())
            }
        }
    }

    /// The x with `integral_to(x) = share`.
    pub(super) fn inverse_to(&self, share: f64) -> f64 {
        let x = match self.shape {
            Shape::Line => self.x.0 + line_inverse(self.p.0, self.slope(), share),
            Shape::Power { exponent } => {
                self.x.0 * power_inverse(exponent + 1.0, share / (self.p.0 * self.x.0))
            }
            Shape::Head { exponent } => {
                let a = exponent + 1.0;
                self.x.1 * ((a * share / (self.p.1 * self.x.1)).ln() / a).exp()
            }
        };
        x.clamp(self.x.0, self.x.1)
    }

    /// The x with `integral_from(x) = share`.
    pub(super) fn inverse_from(&self, share: f64) -> f64 {
        let x = match self.shape {
            Shape::Line => self.x.1 - line_inverse(self.p.1, -self.slope(), share),
            Shape::Power { exponent } | Shape::Head { exponent } => {
                self.x.1 * power_inverse(exponent + 1.0, -share / (self.p.1 * self.x.1))
            }
        };
        x.clamp(self.x.0, self.x.1)
    }

    /// ∫ x p dx over the piece.
    pub(super) fn first_moment(&self) -> f64 {
        let (x0, x1) = self.x;
        match self.shape {
            Shape::Line => {
                // Simpson's rule is exact for a quadratic integrand.
                let middle = 0.5 * (x0 + x1);
                (x1 - x0) / 6.0
                    * (x0 * self.p.0 + 4.0 * middle * self.value(middle) + x1 * self.p.1)
            }
            Shape::Power { exponent } => {
                -self.p.1 * x1 * x1 * power_integral(exponent + 2.0, (x0 / x1).ln())
            }
            Shape::Head { exponent } => self.p.1 * x1 * x1 / (exponent + 2.0),
        }
    }
}

/// ∫ y^(a-1) dy from 1 to e^`log_ratio`.
fn power_integral(a: f64, log_ratio: f64) -> f64 {
    if a == 0.0 {
        log_ratio
    } else {
        (a * log_ratio).exp_m1() / a
    }
}

/// The y with ∫ y^(a-1) dy from 1 to y equal to `share`.
fn power_inverse(a: f64, share: f64) -> f64 {
    if a == 0.0 {
        share.exp()
    } else {
        // Rounding may push the argument just below -1 at the end of a steep piece.
        ((a * share).max(-1.0).ln_1p() / a).exp()
    }
}

/// The h >= 0 with `start·h + slope·h²/2 = share`.
fn line_inverse(start: f64, slope: f64, share: f64) -> f64 {
    let root = (start * start + 2.0 * slope * share).max(0.0).sqrt();
    if start + root > 0.0 {
        2.0 * share / (start + root)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pieces() -> [Piece; 5] {
        [
            Piece::between((0.1, 2.0), (0.4, 0.3)),
            Piece::between((0.1, 2.0), (0.4, 0.5)),
            Piece::between((0.0, 0.0), (0.4, 0.3)),
            Piece::between((0.2, 3.0), (0.4, 0.0)),
            Piece::head((1e-6, 5.0), -0.7),
        ]
    }

    #[test]
    fn inverses_undo_the_integrals() {
        for piece in pieces() {
            for share in [0.001, 0.3, 0.9, 0.999] {
                let part = share * piece.integral();
                let up = piece.integral_to(piece.inverse_to(part));
                let down = piece.integral_from(piece.inverse_from(part));
                assert!((up / part - 1.0).abs() < 1e-12, "{piece:?} {share}");
                assert!((down / part - 1.0).abs() < 1e-12, "{piece:?} {share}");
            }
        }
    }

    #[test]
    fn integrals_agree_with_quadrature() {
        for piece in pieces() {
            let (from, to) = (0.3 * piece.x.0 + 0.7 * piece.x.1, piece.x.1);
            let rule = |f: &dyn Fn(f64) -> f64| {
                super::super::super::solve::gauss_legendre(from, to, 50, f)
            };
            let integral = rule(&|x| piece.value(x));
            assert!((piece.integral_from(from) / integral - 1.0).abs() < 1e-11);
            let difference = piece.integral() - piece.integral_to(from);
            assert!((difference / integral - 1.0).abs() < 1e-11);
        }
    }
}
