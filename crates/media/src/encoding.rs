//! How a camera's counts stand for light.

use serde::{Deserialize, Serialize};

/// Largest count of 8 bits.
const FULL: f64 = 255.0;
/// Nodes of a measured curve, evenly spaced in the root of the count: close together in the dark, where curves bend.
const NODES: usize = 18;
/// Relative accuracy of the inverse of a measured curve.
const INVERSE: f64 = 1e-12;

/// The curve between linear light and the counts that a camera stores.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Encoding {
    /// sRGB (IEC 61966-2-1), as cameras write PNG and JPEG files unless told otherwise.
    #[default]
    Srgb,
    /// Counts in proportion to light.
    Linear,
    /// What was measured of the camera.
    Curve(ResponseCurve),
}

impl Encoding {
    /// Linear light in [0, 1] of 8-bit counts in [0, 255].
    pub fn light(self, counts: f64) -> f64 {
        let code = counts / FULL;
        match self {
            Self::Linear => code,
            Self::Srgb => srgb_to_linear(code),
            Self::Curve(curve) => curve.light(code),
        }
    }

    /// 8-bit counts, fractions allowed, of linear light; light above 1 is clipped.
    pub fn counts(self, light: f64) -> f64 {
        FULL * self.code(light.clamp(0.0, 1.0))
    }

    /// The stored share of full scale for linear light in [0, 1].
    pub fn code(self, light: f64) -> f64 {
        match self {
            Self::Linear => light,
            Self::Srgb => linear_to_srgb(light),
            Self::Curve(curve) => curve.code(light),
        }
    }

    /// Counts per light at a light: the slope of [`counts`](Self::counts) below the clipping.
    pub fn slope(self, light: f64) -> f64 {
        let light = light.clamp(0.0, 1.0);
        match self {
            Self::Linear => FULL,
            Self::Srgb if light <= 0.003_130_8 => FULL * 12.92,
            Self::Srgb => FULL * 1.055 / 2.4 * light.powf(1.0 / 2.4 - 1.0),
            Self::Curve(curve) => FULL / curve.rise(curve.code(light)),
        }
    }

    /// The word for it in messages and files; a measured curve's is "curve".
    pub fn name(self) -> &'static str {
        match self {
            Self::Srgb => "srgb",
            Self::Linear => "linear",
            Self::Curve(_) => "curve",
        }
    }
}

/// A measured curve between counts and light, one for all channels: its logarithm of light over sRGB's, linear in the logarithm
/// of the count between nodes (as a power of the count is), and as much as at the outermost measured count beyond. In files a
/// list of `[counts, light]`, 8-bit counts and light in any unit, both rising.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<[f64; 2]>", into = "Vec<[f64; 2]>")]
pub struct ResponseCurve {
    /// ln(light / sRGB's light) at 255·(i / 17)² counts; 0 at full scale, at 0 as at the next.
    over_srgb: [f64; NODES],
}

/// Points that are no curve between counts and light.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CurveError {
    /// Fewer than two points that say something.
    #[error("a curve needs two or more points [counts, light] with counts above 0, got {0}")]
    TooFew(usize),
    /// A number out of its range.
    #[error(
        "point {index} of a curve must have counts in 0 .. 255 and a finite light above 0 (0 at 0 counts), got [{counts}, {light}]"
    )]
    OutOfRange {
        /// Which, from 1.
        index: usize,
        /// Its counts.
        counts: f64,
        /// Its light.
        light: f64,
    },
    /// Counts or light that do not rise.
    #[error(
        "counts and light of a curve must rise from point to point, got [{}, {}] after [{}, {}]",
        after[0], after[1], before[0], before[1]
    )]
    Falling {
        /// A point.
        before: [f64; 2],
        /// The next.
        after: [f64; 2],
    },
    /// What rises from point to point and not between them or beyond.
    #[error(
        "the light of a curve falls at {0:.0} counts, where it is drawn between its points and beyond them like sRGB: more points, or \
         smoother ones"
    )]
    Bent(f64),
}

impl ResponseCurve {
    /// The curve through points of 8-bit counts and light, in any unit: light at full scale is 1.
    ///
    /// # Errors
    /// Points that are no rising curve.
    pub fn new(points: &[[f64; 2]]) -> Result<Self, CurveError> {
        check(points)?;
        let known: Vec<[f64; 2]> = (points.iter())
            .filter(|point| point[0] > 0.0)
            .map(|&[counts, light]| {
                let code = counts / FULL;
                [code.ln(), (light / srgb_to_linear(code)).ln()]
            })
            .collect();
        let at = |log: f64| match known.partition_point(|point| point[0] <= log) {
            0 => known[0][1],
            n if n == known.len() => known[n - 1][1],
            n => {
                let ([r0, v0], [r1, v1]) = (known[n - 1], known[n]);
                v0 + (v1 - v0) * (log - r0) / (r1 - r0)
            }
        };
        let mut over_srgb: [f64; NODES] = std::array::from_fn(|i| at(log_of(i.max(1))));
        let full = over_srgb[NODES - 1];
        over_srgb.iter_mut().for_each(|value| *value -= full);
        let curve = Self { over_srgb };
        match (1..=255).find(|&count| !(curve.rise(f64::from(count) / FULL) > 0.0)) {
            Some(count) => Err(CurveError::Bent(f64::from(count))),
            None => Ok(curve),
        }
    }

    /// The nodes: 8-bit counts and light, 1 at full scale.
    pub fn points(&self) -> Vec<[f64; 2]> {
        let point = |i: usize| {
            let code = log_of(i).exp();
            [FULL * code, self.light(code)]
        };
        (1..NODES).map(point).collect()
    }

    /// What the curve has over sRGB's at a code, and how that rises with the code's logarithm.
    fn over(&self, code: f64) -> (f64, f64) {
        let i = (((NODES - 1) as f64 * code.clamp(0.0, 1.0).sqrt()) as usize).min(NODES - 2);
        if i == 0 {
            return (self.over_srgb[1], 0.0);
        }
        let [from, to] = [log_of(i), log_of(i + 1)];
        let rise = (self.over_srgb[i + 1] - self.over_srgb[i]) / (to - from);
        (self.over_srgb[i] + rise * (code.ln() - from), rise)
    }

    fn light(&self, code: f64) -> f64 {
        srgb_to_linear(code) * self.over(code).0.exp()
    }

    /// Light per code.
    fn rise(&self, code: f64) -> f64 {
        let (over, rise) = self.over(code);
        let per_code = srgb_to_linear(code) / code.max(f64::MIN_POSITIVE);
        over.exp() * (srgb_rise(code) + per_code * rise)
    }

    /// The code of a light, by Newton's steps inside an interval that holds it.
    fn code(&self, light: f64) -> f64 {
        if !(light > 0.0) {
            return 0.0;
        }
        if light >= 1.0 {
            return 1.0;
        }
        let (mut low, mut high) = (0.0, 1.0);
        let mut code = linear_to_srgb(light);
        for _ in 0..64 {
            let off = self.light(code) - light;
            if off.abs() <= INVERSE * light {
                break;
            }
            if off > 0.0 {
                high = code;
            } else {
                low = code;
            }
            let next = code - off / self.rise(code);
            code = match low < next && next < high {
                true => next,
                false => 0.5 * (low + high),
            };
        }
        code
    }
}

impl TryFrom<Vec<[f64; 2]>> for ResponseCurve {
    type Error = CurveError;

    fn try_from(points: Vec<[f64; 2]>) -> Result<Self, CurveError> {
        Self::new(&points)
    }
}

impl From<ResponseCurve> for Vec<[f64; 2]> {
    fn from(curve: ResponseCurve) -> Self {
        curve.points()
    }
}

/// The logarithm of the code at a node, beginning with the first.
fn log_of(node: usize) -> f64 {
    2.0 * (node as f64 / (NODES - 1) as f64).ln()
}

fn check(points: &[[f64; 2]]) -> Result<(), CurveError> {
    for (i, &[counts, light]) in points.iter().enumerate() {
        let dark = counts == 0.0 && light == 0.0;
        let right = (0.0..=FULL).contains(&counts) && light > 0.0 && light.is_finite();
        if !(dark || right) {
            return Err(CurveError::OutOfRange {
                index: i + 1,
                counts,
                light,
            });
        }
    }
    if let Some(pair) = (points.windows(2)).find(|p| !(p[0][0] < p[1][0] && p[0][1] < p[1][1])) {
        return Err(CurveError::Falling {
            before: pair[0],
            after: pair[1],
        });
    }
    match points.iter().filter(|point| point[0] > 0.0).count() {
        n if n < 2 => Err(CurveError::TooFew(n)),
        _ => Ok(()),
    }
}

/// The sRGB transfer function (IEC 61966-2-1) from linear [0, 1] to encoded [0, 1].
#[inline]
pub fn linear_to_srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// Inverse of [`linear_to_srgb`].
#[inline]
pub fn srgb_to_linear(encoded: f64) -> f64 {
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// Light per code of [`srgb_to_linear`].
fn srgb_rise(encoded: f64) -> f64 {
    if encoded <= 0.040_45 {
        1.0 / 12.92
    } else {
        2.4 / 1.055 * ((encoded + 0.055) / 1.055).powf(1.4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A power of the count, by points as an exposure series gives them.
    fn power(gamma: f64) -> ResponseCurve {
        let points: Vec<[f64; 2]> = (1..=51)
            .map(|k| 5.0 * f64::from(k))
            .map(|counts| [counts, 3.0 * (counts / FULL).powf(gamma)])
            .collect();
        ResponseCurve::new(&points).expect("a curve")
    }

    #[test]
    fn srgb_meets_the_standard_and_its_inverse() {
        assert!((linear_to_srgb(0.002) - 0.025_84).abs() < 1e-12);
        // 0.5 in linear light is 187.5 of 255 counts; middle grey 0.2140 is half of full scale.
        assert!((linear_to_srgb(0.5) - 0.735_357).abs() < 1e-6);
        assert!((srgb_to_linear(0.5) - 0.214_041).abs() < 1e-6);
        for i in 0..=1000 {
            let linear = f64::from(i) / 1000.0;
            // The standard's two constants leave a step of 3e-8 between its branches.
            assert!((srgb_to_linear(linear_to_srgb(linear)) - linear).abs() < 1e-7);
        }
    }

    #[test]
    fn counts_and_light_are_inverse_and_the_slope_is_that_of_the_curve() {
        for encoding in [
            Encoding::Srgb,
            Encoding::Linear,
            Encoding::Curve(power(1.6)),
            Encoding::Curve(power(2.8)),
        ] {
            for counts in [0.0, 0.25, 3.0, 10.5, 100.0, 254.9, 255.0] {
                let light = encoding.light(counts);
                assert!((encoding.counts(light) - counts).abs() < 1e-4, "{counts}");
            }
            for light in [1e-3, 0.01, 0.2, 0.9] {
                let step = 1e-6;
                let rise = encoding.counts(light + step) - encoding.counts(light - step);
                let slope = rise / (2.0 * step);
                assert!(
                    (slope / encoding.slope(light) - 1.0).abs() < 1e-5,
                    "{} {light}: {slope} {}",
                    encoding.name(),
                    encoding.slope(light)
                );
            }
            assert!((encoding.counts(2.0) - 255.0).abs() < 1e-9);
            assert_eq!(encoding.counts(-1.0), 0.0);
        }
    }

    #[test]
    fn a_curve_is_the_one_it_was_made_of() {
        for gamma in [1.0, 1.4, 1.8, 2.2, 2.6] {
            let encoding = Encoding::Curve(power(gamma));
            // Between the first points, 5 and 10 counts, one of the nodes has the curve that goes on like sRGB: light is off by up to a
            // fifth.
            for counts in [10.0, 22.0, 60.0, 130.0, 200.0, 250.0] {
                let truth = (counts / FULL).powf(gamma);
                let off = encoding.light(counts) / truth - 1.0;
                // sRGB bends where its branches meet, at 10.3 counts.
                let most = if counts < 15.0 { 0.05 } else { 0.01 };
                assert!(off.abs() < most, "{gamma} {counts}: {off}");
            }
        }
        // sRGB itself, in any unit, has no bend at all.
        let points: Vec<[f64; 2]> = (1..=17)
            .map(|k| 15.0 * f64::from(k))
            .map(|counts| [counts, 70.0 * Encoding::Srgb.light(counts)])
            .collect();
        let same = Encoding::Curve(ResponseCurve::new(&points).expect("a curve"));
        for counts in 1..=255 {
            let off = same.light(f64::from(counts)) / Encoding::Srgb.light(f64::from(counts)) - 1.0;
            assert!(off.abs() < 1e-12, "{counts}: {off}");
        }
    }

    #[test]
    fn its_points_make_the_same_curve() {
        let curve = power(1.7);
        let again = ResponseCurve::new(&curve.points()).expect("a curve");
        for (a, b) in curve.over_srgb.iter().zip(&again.over_srgb).skip(1) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }

    #[test]
    fn what_is_no_rising_curve_is_refused() {
        let told =
            |points: &[[f64; 2]]| ResponseCurve::new(points).expect_err("refused").to_string();
        assert!(told(&[]).contains("two or more points"));
        assert!(told(&[[0.0, 0.0], [255.0, 1.0]]).ends_with("got 1"));
        assert!(told(&[[10.0, 0.1], [300.0, 1.0]]).contains("point 2 of a curve"));
        assert!(told(&[[10.0, 0.0], [200.0, 1.0]]).contains("point 1 of a curve"));
        assert!(told(&[[10.0, f64::NAN], [200.0, 1.0]]).contains("point 1 of a curve"));
        assert!(told(&[[10.0, 0.2], [20.0, 0.1]]).contains("got [20, 0.1] after [10, 0.2]"));
        assert!(told(&[[20.0, 0.1], [20.0, 0.2]]).contains("must rise"));
        // Flat from 100 to 250 counts but for a hair: lines over sRGB's slope fall in between.
        assert!(told(&[[100.0, 0.5], [250.0, 0.500_1]]).contains("falls at"));
    }
}
