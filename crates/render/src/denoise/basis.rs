//! What layers are made of: sums of carriers, each known without noise, times polynomials of the place in the picture.

use super::guides::{Fragment, Guides, Shown};
use super::samples::Points;

/// Most terms of a basis.
pub(super) const MOST_TERMS: usize = 16;
/// Widths of the blurred copies of the straight light, standard deviations in pixels of a picture 240 pixels wide.
const BLURS: [f64; 4] = [1.0, 2.5, 6.0, 16.0];
/// Width of the picture that they are given for, pixels.
const NOMINAL_WIDTH: f64 = 240.0;

/// A factor that is known without noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Carrier {
    /// 1.
    One,
    /// Transmittance of the water before the surface.
    Transmittance,
    /// Reflectance times transmittance.
    Seen,
    /// The same times a component of the normal.
    Turned(usize),
    /// Straight light of the lamps.
    Lamps,
    /// Straight light of sun and sky.
    Day,
    /// All straight light, blurred.
    Blurred(usize),
}

/// A carrier times u^i v^j, (u, v) the place in cells.
pub(super) type Term = (Carrier, u8, u8);

/// Where carriers are looked at, for which half of the samples.
#[derive(Clone, Copy, Debug)]
pub(super) enum View {
    /// All over the pixel.
    Shown(usize),
    /// Where the samples looked.
    Sampled(usize),
}

/// A basis.
pub(super) struct Basis {
    pub(super) terms: Vec<Term>,
    /// The image points that its light is seen at, but for sun and sky.
    points: Points,
    /// Whether all of the layer is straight light.
    is_straight: bool,
}

impl Basis {
    /// For light that met no surface.
    pub(super) fn of_veil() -> Self {
        let one = Carrier::One;
        Self::new(
            Points::Walks,
            &[
                (one, 0, 0),
                (one, 1, 0),
                (one, 0, 1),
                (one, 2, 0),
                (one, 1, 1),
                (one, 0, 2),
                (Carrier::Transmittance, 0, 0),
            ],
        )
    }

    /// For light that came straight from surfaces and sources, where there are `lamps` or not.
    pub(super) fn of_straight(lamps: usize) -> Self {
        let points = Points::of_lamps(lamps);
        let (lamps, seen) = (Carrier::Lamps, Carrier::Seen);
        let basis = Self::new(
            points,
            &[
                (lamps, 0, 0),
                (lamps, 1, 0),
                (lamps, 0, 1),
                (Carrier::Day, 0, 0),
                (seen, 0, 0),
                (seen, 1, 0),
                (seen, 0, 1),
                (Carrier::Turned(0), 0, 0),
                (Carrier::Turned(1), 0, 0),
                (Carrier::Turned(2), 0, 0),
                (Carrier::One, 0, 0),
            ],
        );
        Self {
            is_straight: true,
            ..basis
        }
    }

    /// For light that met a surface and scattered.
    pub(super) fn of_spread() -> Self {
        let (seen, one) = (Carrier::Seen, Carrier::One);
        Self::new(
            Points::Walks,
            &[
                (seen, 0, 0),
                (seen, 1, 0),
                (seen, 0, 1),
                (one, 0, 0),
                (one, 1, 0),
                (one, 0, 1),
                (Carrier::Blurred(0), 0, 0),
                (Carrier::Blurred(1), 0, 0),
                (Carrier::Blurred(2), 0, 0),
                (Carrier::Blurred(3), 0, 0),
                (Carrier::Lamps, 0, 0),
                (Carrier::Day, 0, 0),
                (Carrier::Turned(0), 0, 0),
                (Carrier::Turned(1), 0, 0),
                (Carrier::Turned(2), 0, 0),
            ],
        )
    }

    /// For all light of a source, which is one of `lamps` or, of none, daylight.
    pub(super) fn of_source(lamps: usize) -> Self {
        let points = Points::of_lamps(lamps);
        let (lamps, seen, one) = (Carrier::Lamps, Carrier::Seen, Carrier::One);
        Self::new(
            points,
            &[
                (lamps, 0, 0),
                (lamps, 1, 0),
                (lamps, 0, 1),
                (seen, 0, 0),
                (seen, 1, 0),
                (seen, 0, 1),
                (one, 0, 0),
                (one, 1, 0),
                (one, 0, 1),
                (Carrier::Transmittance, 0, 0),
                (Carrier::Day, 0, 0),
                (Carrier::Blurred(0), 0, 0),
                (Carrier::Blurred(1), 0, 0),
                (Carrier::Blurred(2), 0, 0),
                (Carrier::Blurred(3), 0, 0),
            ],
        )
    }

    fn new(points: Points, terms: &[Term]) -> Self {
        debug_assert!(terms.len() <= MOST_TERMS);
        Self {
            terms: terms.to_vec(),
            points,
            is_straight: false,
        }
    }

    /// Number of terms.
    pub(super) fn len(&self) -> usize {
        self.terms.len()
    }

    /// The carriers of a fragment of a pixel in channel `k`, term by term, times the fragment's share of the pixel.
    pub(super) fn carriers(
        &self,
        fragment: &Fragment,
        blurred: &[[f32; 3]; BLURS.len()],
        k: usize,
        view: View,
    ) -> [f64; MOST_TERMS] {
        let (shown, own, walked) = match view {
            View::Shown(half) => {
                let shown = &fragment.shown[half];
                (shown, shown.sampled(), shown.sampled())
            }
            View::Sampled(half) => {
                let (walked, lit) = (fragment.walked[half], fragment.lit[half]);
                let own = match self.points {
                    Points::Walks => walked,
                    Points::Lit => lit,
                };
                (&fragment.shown[half], own, walked)
            }
        };
        let mut values = [0.0; MOST_TERMS];
        for (value, (carrier, ..)) in values.iter_mut().zip(&self.terms) {
            *value = f64::from(match *carrier {
                Carrier::One => own.share,
                Carrier::Transmittance => own.share * shown.transmittance[k],
                Carrier::Seen => own.share * own.seen[k],
                Carrier::Turned(axis) => own.share * own.seen[k] * fragment.normal[axis],
                Carrier::Lamps => own.share * own.seen[k] * shown.lamps[k],
                Carrier::Day => walked.share * walked.seen[k] * shown.day[k],
                Carrier::Blurred(width) => own.share * blurred[width][k],
            });
        }
        values
    }

    /// The carriers of a fragment that follows the fit of another one, term by term: its own; but where the straight light of both is known,
    /// and all of the layer is straight light, those of the other times the ratio of that, as what the other does not vary in is
    /// not told apart by its fit.
    pub(super) fn carriers_beside(
        &self,
        fragment: &Fragment,
        other: &Fragment,
        blurred: &[[f32; 3]; BLURS.len()],
        k: usize,
        view: View,
    ) -> [f64; MOST_TERMS] {
        let own = self.carriers(fragment, blurred, k, view);
        if !self.is_straight {
            return own;
        }
        let others = self.carriers(other, blurred, k, view);
        let light = |values: &[f64; MOST_TERMS]| {
            let known = self.terms.iter().zip(values);
            known
                .filter(|(term, _)| matches!(term, (Carrier::Lamps | Carrier::Day, 0, 0)))
                .map(|(_, value)| value)
                .sum::<f64>()
        };
        let of_other = light(&others);
        match of_other > 0.0 {
            true => others.map(|value| value * light(&own) / of_other),
            false => own,
        }
    }

    /// The monomials at (u, v), term by term.
    #[inline]
    pub(super) fn monomials(&self, u: f64, v: f64) -> [f64; MOST_TERMS] {
        let power = |x: f64, n: u8| match n {
            0 => 1.0,
            1 => x,
            _ => x * x,
        };
        let mut values = [0.0; MOST_TERMS];
        for (value, &(_, i, j)) in values.iter_mut().zip(&self.terms) {
            *value = power(u, i) * power(v, j);
        }
        values
    }

    /// The terms that make each term where u and v are larger by `a` and `b`: (index, factor), itself first.
    pub(super) fn shifted(&self, a: f64, b: f64) -> Vec<Vec<(usize, f64)>> {
        let find = |wanted: Term| self.terms.iter().position(|&term| term == wanted);
        let of_term = |&(carrier, i, j): &Term| {
            let mut parts = Vec::new();
            for p in (0..=i).rev() {
                for q in (0..=j).rev() {
                    let factor = binomial(i, p)
                        * a.powi(i32::from(i - p))
                        * binomial(j, q)
                        * b.powi(i32::from(j - q));
                    if let Some(index) = find((carrier, p, q)).filter(|_| factor != 0.0) {
                        parts.push((index, factor));
                    }
                }
            }
            parts
        };
        self.terms.iter().map(of_term).collect()
    }
}

fn binomial(n: u8, k: u8) -> f64 {
    match (n, k) {
        (2, 1) => 2.0,
        _ => 1.0,
    }
}

/// Blurred copies of the straight light of every pixel.
pub(super) fn blurred_light(guides: &Guides) -> Vec<[[f32; 3]; BLURS.len()]> {
    let pixels = guides.width * guides.height;
    let unit = guides.width as f64 / NOMINAL_WIDTH;
    let mut all = vec![[[0.0; 3]; BLURS.len()]; pixels];
    for k in 0..3 {
        let light: Vec<f32> = (0..pixels)
            .map(|i| {
                let of_half = |s: &Shown| s.share * s.seen[k] * (s.lamps[k] + s.day[k]);
                let of = |f: &Fragment| f.shown.iter().map(of_half).sum::<f32>();
                0.5 * guides.pixel(i).iter().map(of).sum::<f32>()
            })
            .collect();
        for (b, sigma) in BLURS.iter().enumerate() {
            let plane = super::blur::gaussian(&light, guides.width, sigma * unit);
            for (pixel, value) in all.iter_mut().zip(plane) {
                pixel[b][k] = value;
            }
        }
    }
    all
}
