//! Paths as their numbers of scatterings and lengths, and what they sum up to in any water.

use std::ops::{Add, Mul, Range};

use crate::estimate::basis::{Basis, solve};

/// A value in a water, and how it changes with the water.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Derived {
    /// The value.
    pub value: f64,
    /// Its derivative with respect to the absorption a, m.
    pub by_a: f64,
    /// Its derivative with respect to the scattering b, m.
    pub by_b: f64,
    /// Its derivative with respect to the logarithm of the backscatter fraction; 0 where that is fixed.
    pub by_ln_backscatter: f64,
}

impl Derived {
    /// A value that no water changes.
    pub fn constant(value: f64) -> Self {
        Self {
            value,
            ..Self::default()
        }
    }

    /// f of the value, given f and its derivative there.
    pub fn chain(self, value: f64, slope: f64) -> Self {
        Self {
            value,
            ..self * slope
        }
    }

    /// One over the value.
    pub fn inverse(self) -> Self {
        self.chain(1.0 / self.value, -1.0 / (self.value * self.value))
    }
}

impl Add for Derived {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            by_a: self.by_a + other.by_a,
            by_b: self.by_b + other.by_b,
            by_ln_backscatter: self.by_ln_backscatter + other.by_ln_backscatter,
        }
    }
}

impl Mul<f64> for Derived {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self {
            value: factor * self.value,
            by_a: factor * self.by_a,
            by_b: factor * self.by_b,
            by_ln_backscatter: factor * self.by_ln_backscatter,
        }
    }
}

impl Mul for Derived {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let product = self * other.value + other * self.value;
        Self {
            value: self.value * other.value,
            ..product
        }
    }
}

/// A smooth function over the image: a polynomial in its coordinates p and q in [-1, 1].
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// The functions.
    pub basis: Basis,
    /// Their coefficients; the first one is the mean over the image.
    pub coefficients: Vec<Derived>,
}

impl Field {
    /// Mean over the image.
    pub fn mean(&self) -> Derived {
        self.coefficients[0]
    }

    /// Value at (p, q).
    pub fn at(&self, p: f64, q: f64) -> Derived {
        let mut phi = vec![0.0; self.basis.len()];
        self.basis.values(p, q, &mut phi);
        let terms = self.coefficients.iter().zip(phi);
        terms.fold(Derived::default(), |sum, (c, value)| sum + *c * value)
    }
}

/// Exponent of a path's weight in a water, and its derivatives.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exponent {
    pub(super) value: f64,
    pub(super) by_a: f64,
    pub(super) by_b: f64,
}

/// A water as the paths need it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coefficients {
    pub(super) a: f64,
    pub(super) b: f64,
    ln_b: f64,
}

/// Least scattering: what is left of a water that does not scatter, 1/m.
const LEAST_SCATTERING: f64 = 1e-12;

impl Coefficients {
    pub(super) fn new(a: f64, b: f64) -> Self {
        let b = b.max(LEAST_SCATTERING);
        Self { a, b, ln_b: b.ln() }
    }

    /// Of b^k e^(-(a+b)s).
    #[inline]
    pub(super) fn exponent(&self, scatterings: f64, length_m: f64) -> Exponent {
        Exponent {
            value: scatterings * self.ln_b - (self.a + self.b) * length_m,
            by_a: -length_m,
            by_b: scatterings / self.b - length_m,
        }
    }
}

/// One path: what it counts for in any water.
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    pub(super) scatterings: f32,
    pub(super) length_m: f64,
    /// Logarithm of all else.
    pub(super) log_weight: f64,
    /// Logarithm of the light where it ends, over that where its image point looks, as a polynomial in the light's
    /// losses per metre: coefficients of the first and of the second power. 0 where it does not matter.
    pub(super) light: [f32; 2],
}

/// Paths of all groups, each with the values of some functions where it counts.
#[derive(Clone, Debug)]
pub(super) struct Paths {
    paths: Vec<Path>,
    /// Per path the values of all functions.
    functions: Vec<f32>,
    columns: usize,
    /// Per group the end of its paths.
    ends: Vec<usize>,
    /// Per group the number of points drawn, those without light included.
    points: Vec<f64>,
    /// Per group the moments of the functions to be fitted, over all points.
    moments: Vec<Vec<f64>>,
    fitted: usize,
}

/// The paths of one group.
pub(super) struct Group {
    paths: Vec<Path>,
    functions: Vec<f32>,
    points: f64,
    moments: Vec<f64>,
    fitted: usize,
}

impl Group {
    /// None yet; `fitted` functions are fitted to what the paths bring.
    pub(super) fn new(fitted: usize) -> Self {
        Self {
            paths: Vec::new(),
            functions: Vec::new(),
            points: 0.0,
            moments: vec![0.0; fitted * fitted],
            fitted,
        }
    }

    /// Counts an image point at which the fitted functions are `phi`.
    pub(super) fn point(&mut self, phi: &[f64]) {
        self.points += 1.0;
        for i in 0..self.fitted {
            for j in 0..self.fitted {
                self.moments[i * self.fitted + j] += phi[i] * phi[j];
            }
        }
    }

    /// Adds a path with the values of all functions, the fitted ones first.
    pub(super) fn add(&mut self, path: Path, functions: impl Iterator<Item = f64>) {
        if path.log_weight.is_finite() && path.length_m.is_finite() {
            self.paths.push(path);
            self.functions.extend(functions.map(|f| f as f32));
        }
    }
}

impl Paths {
    /// Those of `groups`, with `columns` functions each, the fitted ones included.
    pub(super) fn new(groups: Vec<Group>, columns: usize) -> Self {
        let mut all = Self {
            paths: Vec::new(),
            functions: Vec::new(),
            columns,
            ends: Vec::new(),
            points: Vec::new(),
            moments: Vec::new(),
            fitted: groups.first().map_or(0, |g| g.fitted),
        };
        for group in groups {
            all.paths.extend(group.paths);
            all.functions.extend(group.functions);
            all.ends.push(all.paths.len());
            all.points.push(group.points);
            all.moments.push(group.moments);
        }
        all
    }

    /// Number of paths kept.
    pub(super) fn len(&self) -> usize {
        self.paths.len()
    }

    /// Mean of every function times the paths' weights over the points of `groups`.
    pub(super) fn means(
        &self,
        groups: Range<usize>,
        exponent: impl Fn(&Path) -> Exponent,
    ) -> Vec<Derived> {
        let n = self.columns;
        let (mut values, mut by_a, mut by_b) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let from = groups.start.checked_sub(1).map_or(0, |g| self.ends[g]);
        let range = from..self.ends[groups.end - 1];
        let rows = self.functions[range.start * n..range.end * n].chunks_exact(n);
        for (path, row) in self.paths[range].iter().zip(rows) {
            let e = exponent(path);
            let weight = (path.log_weight + e.value).exp();
            let (of_a, of_b) = (weight * e.by_a, weight * e.by_b);
            let sums = values.iter_mut().zip(&mut by_a).zip(&mut by_b);
            for (((value, a), b), &function) in sums.zip(row) {
                let function = f64::from(function);
                *value += weight * function;
                *a += of_a * function;
                *b += of_b * function;
            }
        }
        let points: f64 = self.points[groups].iter().sum::<f64>().max(1.0);
        (0..n)
            .map(|j| Derived {
                value: values[j] / points,
                by_a: by_a[j] / points,
                by_b: by_b[j] / points,
                by_ln_backscatter: 0.0,
            })
            .collect()
    }

    /// Coefficients of the fitted functions that come closest to what the paths bring, given its `means`; only the mean
    /// where the points do not tell the functions apart.
    pub(super) fn fit(&self, groups: Range<usize>, means: &[Derived]) -> Vec<Derived> {
        let n = self.fitted;
        let points: f64 = self.points[groups.clone()].iter().sum();
        let moment = |i: usize| {
            self.moments[groups.clone()]
                .iter()
                .map(|m| m[i])
                .sum::<f64>()
        };
        let matrix: Vec<f64> = (0..n * n).map(|i| moment(i) / points).collect();
        project(&matrix, &means[..n]).unwrap_or_else(|| {
            let mut coefficients = vec![Derived::default(); n];
            coefficients[0] = means[0];
            coefficients
        })
    }
}

/// Least-squares coefficients from the `matrix` of the functions' moments and the `means` of function · value.
pub(super) fn project(matrix: &[f64], means: &[Derived]) -> Option<Vec<Derived>> {
    let solved = |of: fn(&Derived) -> f64| {
        let mut right: Vec<f64> = means.iter().map(of).collect();
        solve(&mut matrix.to_vec(), &mut right)?;
        right.iter().all(|x| x.is_finite()).then_some(right)
    };
    let (value, by_a, by_b) = (
        solved(|m| m.value)?,
        solved(|m| m.by_a)?,
        solved(|m| m.by_b)?,
    );
    let coefficients = (0..means.len()).map(|i| Derived {
        value: value[i],
        by_a: by_a[i],
        by_b: by_b[i],
        by_ln_backscatter: 0.0,
    });
    Some(coefficients.collect())
}
