//! What layers are made of: sums of carriers, each known without noise, times polynomials of the place in the picture.

use super::guides::{Fragment, Guides};

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

/// A basis.
pub(super) struct Basis {
    pub(super) terms: Vec<Term>,
}

impl Basis {
    /// For light that met no surface.
    pub(super) fn of_veil() -> Self {
        let one = Carrier::One;
        Self::new(&[
            (one, 0, 0),
            (one, 1, 0),
            (one, 0, 1),
            (one, 2, 0),
            (one, 1, 1),
            (one, 0, 2),
            (Carrier::Transmittance, 0, 0),
        ])
    }

    /// For light that came straight from surfaces and sources.
    pub(super) fn of_straight() -> Self {
        let (lamps, seen) = (Carrier::Lamps, Carrier::Seen);
        Self::new(&[
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
        ])
    }

    /// For light that met a surface and scattered.
    pub(super) fn of_spread() -> Self {
        let (seen, one) = (Carrier::Seen, Carrier::One);
        Self::new(&[
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
        ])
    }

    /// For all light of a source.
    pub(super) fn of_source() -> Self {
        let (lamps, seen, one) = (Carrier::Lamps, Carrier::Seen, Carrier::One);
        Self::new(&[
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
        ])
    }

    fn new(terms: &[Term]) -> Self {
        debug_assert!(terms.len() <= MOST_TERMS);
        Self {
            terms: terms.to_vec(),
        }
    }

    /// Number of terms.
    pub(super) fn len(&self) -> usize {
        self.terms.len()
    }

    /// The carriers of a fragment of a pixel in channel `k`, term by term.
    pub(super) fn carriers(
        &self,
        fragment: &Fragment,
        blurred: &[[f32; 3]; BLURS.len()],
        k: usize,
    ) -> [f64; MOST_TERMS] {
        let mut values = [0.0; MOST_TERMS];
        for (value, (carrier, ..)) in values.iter_mut().zip(&self.terms) {
            *value = f64::from(match *carrier {
                Carrier::One => 1.0,
                Carrier::Transmittance => fragment.transmittance[k],
                Carrier::Seen => fragment.seen[k],
                Carrier::Turned(axis) => fragment.seen[k] * fragment.normal[axis],
                Carrier::Lamps => fragment.lamps[k],
                Carrier::Day => fragment.day[k],
                Carrier::Blurred(width) => blurred[width][k],
            });
        }
        values
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
                let of = |f: &Fragment| f.share * (f.lamps[k] + f.day[k]);
                guides.pixel(i).iter().map(of).sum()
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
