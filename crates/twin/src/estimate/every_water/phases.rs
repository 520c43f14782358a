//! Between sets of paths for several phase functions.

use rayon::prelude::*;
use uw_media::Spectrum;
use uw_media::phase::{FournierForand, Phase, PhaseTable};
use uw_render::prepare::PreparedLamp;

use super::evaluate::{Derived, Field};
use super::{EveryWater, EveryWaterError, ScatteredSight, Values};
use crate::estimate::target_view::TargetView;

/// Phase functions of particles of one index at several backscatter fractions; they serve all views.
#[derive(Clone, Debug)]
pub struct Phases {
    ln_backscatter: Vec<f64>,
    tables: Vec<PhaseTable>,
}

impl Phases {
    /// Fournier-Forand functions of particles of relative refractive `index`, in water of the `backscatter` fractions given,
    /// in rising order.
    ///
    /// # Errors
    /// Fewer than two fractions, or one that is no fraction.
    pub fn new(index: f64, backscatter: &[f64]) -> Result<Self, EveryWaterError> {
        let (first, last) = (backscatter.first(), backscatter.last());
        let wrong = EveryWaterError::Backscatter(
            first.copied().unwrap_or(f64::NAN),
            last.copied().unwrap_or(f64::NAN),
        );
        if backscatter.len() < 2 || !backscatter.windows(2).all(|pair| pair[0] < pair[1]) {
            return Err(wrong);
        }
        let table = |&fraction: &f64| {
            let phase = FournierForand::new(index, fraction).map_err(|_| wrong)?;
            Ok(PhaseTable::new(&Phase::FournierForand(phase)))
        };
        Ok(Self {
            ln_backscatter: backscatter.iter().map(|fraction| fraction.ln()).collect(),
            tables: backscatter
                .par_iter()
                .map(table)
                .collect::<Result<_, _>>()?,
        })
    }
}

/// Paths of one view at several backscatter fractions, with the same random numbers: their values go smoothly from one
/// fraction to the next. In between, a polynomial in the logarithm of the fraction through all of them.
#[derive(Clone, Debug)]
pub struct EveryPhase {
    ln_backscatter: Vec<f64>,
    sets: Vec<EveryWater>,
}

impl EveryPhase {
    /// As [`EveryWater::with_frequencies`], one set for each of the `phases`.
    ///
    /// # Errors
    /// As there.
    pub fn new(
        view: &TargetView,
        lamps: &[PreparedLamp],
        phases: &Phases,
        frequencies: &[f64],
        paths: usize,
        seed: u64,
    ) -> Result<Self, EveryWaterError> {
        let set = |phase: &PhaseTable| {
            EveryWater::with_frequencies(view, lamps, phase, frequencies, paths, seed)
        };
        Ok(Self {
            ln_backscatter: phases.ln_backscatter.clone(),
            sets: phases.tables.iter().map(set).collect::<Result<_, _>>()?,
        })
    }

    /// Intensity of the lamps in each channel, over its mean over the channels.
    pub fn colour(&self) -> Spectrum {
        self.sets[0].colour()
    }

    /// The sets, in rising order of their backscatter fractions.
    pub fn sets(&self) -> &[EveryWater] {
        &self.sets
    }

    /// The image in water with absorption `a` >= 0 and scattering `b` > 0, 1/m, of which the share `backscatter` goes back;
    /// beyond the ends of the sets' range in proportion to its logarithm.
    pub fn at(&self, a: f64, b: f64, backscatter: f64) -> Values {
        self.between(backscatter, |set| set.at(a, b))
    }

    /// The same from one of the [`GROUPS`](super::GROUPS) of independent paths alone.
    pub fn of_group(&self, group: usize, a: f64, b: f64, backscatter: f64) -> Values {
        self.between(backscatter, |set| set.of_group(group, a, b))
    }

    fn between(&self, backscatter: f64, values: impl Fn(&EveryWater) -> Values) -> Values {
        let (first, last) = (
            self.ln_backscatter[0],
            self.ln_backscatter[self.sets.len() - 1],
        );
        let x = backscatter.ln().clamp(first, last);
        let beyond = backscatter.ln() - x;
        let parts: Vec<(f64, f64, Values)> = (0..self.sets.len())
            .map(|i| {
                let (weight, slope) = lagrange(&self.ln_backscatter, i, x);
                (weight + beyond * slope, slope, values(&self.sets[i]))
            })
            .collect();
        mixed(&parts)
    }
}

/// The polynomial that is 1 at node `i` and 0 at the others, and its derivative, at `x`.
fn lagrange(nodes: &[f64], i: usize, x: f64) -> (f64, f64) {
    let others = || (0..nodes.len()).filter(move |&j| j != i);
    let factor = |j: usize| (x - nodes[j]) / (nodes[i] - nodes[j]);
    let slope = others().map(|skipped| {
        let rest: f64 = others().filter(|&j| j != skipped).map(factor).product();
        rest / (nodes[i] - nodes[skipped])
    });
    (others().map(factor).product(), slope.sum())
}

/// Values mixed by weights, whose changes by the logarithm of the backscatter fraction are the second numbers.
fn mixed(parts: &[(f64, f64, Values)]) -> Values {
    let one = |of: &dyn Fn(&Values) -> Derived| {
        parts
            .iter()
            .fold(Derived::default(), |sum, (weight, slope, values)| {
                let value = of(values);
                sum + Derived {
                    by_ln_backscatter: slope * value.value,
                    ..value * *weight
                }
            })
    };
    let field = |of: fn(&Values) -> &Field| {
        let first = of(&parts[0].2);
        let terms = 0..first.coefficients.len();
        Field {
            basis: first.basis.clone(),
            coefficients: terms.map(|i| one(&|v| of(v).coefficients[i])).collect(),
        }
    };
    let sight = |of: fn(&Values) -> &ScatteredSight| ScatteredSight {
        share: std::array::from_fn(|i| one(&|v| of(v).share[i])),
        transfer: (0..of(&parts[0].2).transfer.len())
            .map(|i| one(&|v| of(v).transfer[i]))
            .collect(),
    };
    let first = &parts[0].2;
    Values {
        veil: field(|v| &v.veil),
        unscattered: first.unscattered.clone(),
        scattered: field(|v| &v.scattered),
        sight: sight(|v| &v.sight),
        even_sight: sight(|v| &v.even_sight),
        returned: one(&|v| v.returned),
        attenuation: first.attenuation,
    }
}
