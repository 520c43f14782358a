//! What layers are made of: sums of carriers, each known without noise, times polynomials of the place in the picture.

use super::guides::{Fragment, Guides, Sampled, Shown};
use super::lanes::{Lanes, ZERO, lane, scaled};
use super::samples::Points;

/// Most terms of a basis.
pub(super) const MOST_TERMS: usize = 16;
/// Most different carriers of a basis.
pub(super) const MOST_CARRIERS: usize = 12;
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

/// Where carriers are looked at, by each half of the samples.
#[derive(Clone, Copy, Debug)]
pub(super) enum View {
    /// All over the pixel.
    Shown,
    /// Where the samples looked.
    Sampled,
}

/// The carriers of a fragment, each once.
pub(super) type Carried = [Lanes; MOST_CARRIERS];

/// A basis.
pub(super) struct Basis {
    terms: Vec<Term>,
    /// The carriers of its terms, each once.
    carriers: Vec<Carrier>,
    /// Which carriers go with which powers of u: index of the carrier and power, each pair once.
    slopes: Vec<(usize, u8)>,
    /// Of each term the index of its carrier and of its slope.
    places: Vec<(usize, usize)>,
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
        let (mut carriers, mut slopes, mut places) = (Vec::new(), Vec::new(), Vec::new());
        for &(carrier, power, _) in terms {
            let carrier = place_in(&mut carriers, carrier);
            places.push((carrier, place_in(&mut slopes, (carrier, power))));
        }
        debug_assert!(carriers.len() <= MOST_CARRIERS);
        Self {
            terms: terms.to_vec(),
            carriers,
            slopes,
            places,
            points,
            is_straight: false,
        }
    }

    /// Number of terms.
    pub(super) fn len(&self) -> usize {
        self.terms.len()
    }

    /// Number of different carriers.
    pub(super) fn carrier_count(&self) -> usize {
        self.carriers.len()
    }

    /// Which carriers go with which powers of u: index of the carrier and power.
    pub(super) fn slopes(&self) -> &[(usize, u8)] {
        &self.slopes
    }

    /// Of each term the index of its slope and its power of v.
    pub(super) fn powers_of_v(&self) -> impl Iterator<Item = (usize, u8)> {
        let places = self.places.iter().zip(&self.terms);
        places.map(|(&(_, slope), &(.., power))| (slope, power))
    }

    /// The carriers of a fragment of a pixel, times the fragment's share of the pixel.
    pub(super) fn carriers(
        &self,
        fragment: &Fragment,
        blurred: &[[f32; 3]; BLURS.len()],
        view: View,
    ) -> Carried {
        let mut carried = [ZERO; MOST_CARRIERS];
        for half in 0..2 {
            let shown = &fragment.shown[half];
            let (own, walked) = match view {
                View::Shown => (shown.sampled(), shown.sampled()),
                View::Sampled => match self.points {
                    Points::Walks => (fragment.walked[half], fragment.walked[half]),
                    Points::Lit => (fragment.lit[half], fragment.walked[half]),
                },
            };
            for (values, carrier) in carried.iter_mut().zip(&self.carriers) {
                let of = carrier_values(*carrier, fragment, blurred, (shown, &own, &walked));
                (0..3).for_each(|k| values[lane(k, half)] = f64::from(of[k]));
            }
        }
        carried
    }

    /// The carriers of a fragment that follows the fit of another one: its own; but where the straight light of both is known,
    /// and all of the layer is straight light, those of the other times the ratio of that, as what the other does not vary in is
    /// not told apart by its fit.
    pub(super) fn carriers_beside(
        &self,
        fragment: &Fragment,
        other: &Fragment,
        blurred: &[[f32; 3]; BLURS.len()],
        view: View,
    ) -> Carried {
        let own = self.carriers(fragment, blurred, view);
        if !self.is_straight {
            return own;
        }
        let others = self.carriers(other, blurred, view);
        let light = |carried: &Carried, lane: usize| {
            let known = self.carriers.iter().zip(carried);
            known
                .filter(|(carrier, _)| matches!(carrier, Carrier::Lamps | Carrier::Day))
                .map(|(_, values)| values[lane])
                .sum::<f64>()
        };
        let mut beside = own;
        for lane in 0..ZERO.len() {
            let (of_own, of_other) = (light(&own, lane), light(&others, lane));
            if of_other > 0.0 {
                for (value, other) in beside.iter_mut().zip(&others) {
                    value[lane] = other[lane] * of_own / of_other;
                }
            }
        }
        beside
    }

    /// Carriers times the monomials at (u, v), term by term.
    pub(super) fn terms_at(&self, carried: &Carried, u: f64, v: f64, terms: &mut [Lanes]) {
        let places = self.terms.iter().zip(&self.places);
        for (term, (&(_, i, j), &(carrier, _))) in terms.iter_mut().zip(places) {
            let monomial = power(u, i) * power(v, j);
            *term = scaled(&carried[carrier], monomial);
        }
    }

    /// The terms that make each term where (u, v) are `scale` times what they are there and larger by `a` and `b`: (index, factor).
    pub(super) fn recast(&self, scale: f64, (a, b): (f64, f64)) -> Vec<Vec<(usize, f64)>> {
        let find = |wanted: Term| self.terms.iter().position(|&term| term == wanted);
        let of_power = |n: u8, left: u8, shift: f64| {
            binomial(n, left) * power(scale, left) * power(shift, n - left)
        };
        let of_term = |&(carrier, i, j): &Term| {
            let mut parts = Vec::new();
            for p in (0..=i).rev() {
                for q in (0..=j).rev() {
                    let factor = of_power(i, p, a) * of_power(j, q, b);
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

/// x to the power of `n`, 2 at most.
pub(super) fn power(x: f64, n: u8) -> f64 {
    match n {
        0 => 1.0,
        1 => x,
        _ => x * x,
    }
}

/// Place of `value` in a list to which it is added where it is not there yet.
fn place_in<T: PartialEq>(list: &mut Vec<T>, value: T) -> usize {
    let found = list.iter().position(|own| *own == value);
    found.unwrap_or_else(|| {
        list.push(value);
        list.len() - 1
    })
}

/// A carrier of a fragment for a half of the samples, per channel, by what is shown, and by what the samples of the basis and walks saw.
fn carrier_values(
    carrier: Carrier,
    fragment: &Fragment,
    blurred: &[[f32; 3]; BLURS.len()],
    (shown, own, walked): (&Shown, &Sampled, &Sampled),
) -> [f32; 3] {
    let seen: [f32; 3] = std::array::from_fn(|k| own.share * own.seen[k]);
    let per_channel = |of: &dyn Fn(usize) -> f32| [of(0), of(1), of(2)];
    match carrier {
        Carrier::One => [own.share; 3],
        Carrier::Transmittance => per_channel(&|k| own.share * shown.transmittance[k]),
        Carrier::Seen => seen,
        Carrier::Turned(axis) => per_channel(&|k| seen[k] * fragment.normal[axis]),
        Carrier::Lamps => per_channel(&|k| seen[k] * shown.lamps[k]),
        Carrier::Day => per_channel(&|k| walked.share * walked.seen[k] * shown.day[k]),
        Carrier::Blurred(width) => per_channel(&|k| own.share * blurred[width][k]),
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
