//! The network in one situation, for many candidates.
//!
//! Candidates differ in two inputs (or eight, with the calibration at their own distance) only, so the sums of the first layer over the other inputs are made
//! once. All room is taken when the query is made: evaluating allocates nothing.

use super::dense::{Dense, LANES, Real};
use super::{Model, Network};
use crate::features::{Candidate, FeatureValue, Situation, VaryingValue};

/// The network for one situation.
#[derive(Clone, Debug)]
pub struct Query<'a> {
    model: &'a Model,
    situation: Situation,
    /// Position and value of the inputs that differ from candidate to candidate.
    varying: Vec<(usize, VaryingValue)>,
    exact: Room<f64>,
    /// The search goes one by one: skipping what a ReLU made zero saves more than lanes do.
    quick: Room<f32>,
    arch: pulp::Arch,
}

/// Sums that all candidates share, and room for those that they do not.
#[derive(Clone, Debug)]
struct Room<T> {
    fixed_sums: Vec<T>,
    x: Vec<T>,
    sums: Vec<T>,
    active: Vec<u32>,
}

impl<T: Real> Room<T> {
    fn new(network: &Network<T>, fixed_sums: Vec<T>) -> Self {
        let widest = network.layers.iter().map(Dense::padded).max().unwrap_or(0);
        Self {
            fixed_sums,
            x: vec![T::default(); widest * LANES],
            sums: vec![T::default(); widest * LANES],
            active: Vec::with_capacity(widest),
        }
    }

    /// The last layer's outputs for a candidate whose varying inputs are given; they lie in `x`.
    #[inline(always)]
    fn one(&mut self, network: &Network<T>, varying: impl Iterator<Item = (usize, T)>) {
        let Some((first, rest)) = network.layers.split_first() else {
            return;
        };
        let sums = &mut self.x[..first.padded()];
        sums.copy_from_slice(&self.fixed_sums);
        for (input, x) in varying {
            first.add_input(sums, input, x);
        }
        first.activate(sums);
        for layer in rest {
            let sums = &mut self.sums[..layer.padded()];
            layer.one(&self.x, sums, &mut self.active);
            std::mem::swap(&mut self.x, &mut self.sums);
        }
    }

    /// The same for as many candidates as there are lanes.
    #[inline(always)]
    fn lanes(&mut self, network: &Network<T>, varying: impl Iterator<Item = (usize, [T; LANES])>) {
        let Some((first, rest)) = network.layers.split_first() else {
            return;
        };
        let sums = &mut self.x[..first.padded() * LANES];
        for (lanes, &fixed) in sums
            .as_chunks_mut::<LANES>()
            .0
            .iter_mut()
            .zip(&self.fixed_sums)
        {
            *lanes = [fixed; LANES];
        }
        for (input, x) in varying {
            first.add_input_lanes(sums, input, &x);
        }
        first.activate(sums);
        for layer in rest {
            let sums = &mut self.sums[..layer.padded() * LANES];
            layer.lanes(&self.x, sums);
            std::mem::swap(&mut self.x, &mut self.sums);
        }
    }
}

impl Model {
    /// Prepares the network for many candidates in one situation.
    pub fn query(&self, situation: &Situation) -> Query<'_> {
        let first = &self.layers[0];
        let mut fixed_sums = first.bias.clone();
        let mut varying = Vec::with_capacity(8);
        for (i, input) in self.inputs.iter().enumerate() {
            match input.value {
                FeatureValue::Fixed(of) => {
                    let x = self.scaled(i, of(situation));
                    for (sum, weight) in fixed_sums.iter_mut().zip(first.row(i)) {
                        *sum += x * weight;
                    }
                }
                FeatureValue::Varying(of) => varying.push((i, of)),
            }
        }
        let padded = self.exact.layers.first().map_or(0, Dense::padded);
        fixed_sums.resize(padded, 0.0);
        let quick_sums = fixed_sums.iter().map(|&sum| sum as f32).collect();
        Query {
            model: self,
            situation: situation.clone(),
            varying,
            exact: Room::new(&self.exact, fixed_sums),
            quick: Room::new(&self.quick, quick_sums),
            arch: pulp::Arch::new(),
        }
    }
}

impl Query<'_> {
    /// Predicted contrast per channel, 8-bit counts, when the vehicle takes the candidate.
    pub fn contrast(&mut self, candidate: &Candidate) -> [f64; 3] {
        let (model, situation, varying) = (self.model, &self.situation, &self.varying);
        let room = &mut self.exact;
        self.arch.dispatch(
            #[inline(always)]
            || room.one(&model.exact, scaled(model, situation, varying, candidate)),
        );
        model.contrast(&room.x)
    }

    /// The same in single precision: within some 1e-6 of the value, in half the time.
    pub fn quick_contrast(&mut self, candidate: &Candidate) -> [f64; 3] {
        let (model, situation, varying) = (self.model, &self.situation, &self.varying);
        let room = &mut self.quick;
        let inputs = scaled(model, situation, varying, candidate).map(|(i, x)| (i, x as f32));
        self.arch.dispatch(
            #[inline(always)]
            || room.one(&model.quick, inputs),
        );
        model
            .outputs
            .map(|(output, scale)| f64::from(room.x[output]) * scale)
    }

    /// Contrast of several candidates, the same bits as one by one.
    pub fn contrasts(&mut self, candidates: &[Candidate], found: &mut [[f64; 3]]) {
        let (model, situation, varying) = (self.model, &self.situation, &self.varying);
        let room = &mut self.exact;
        for (some, found) in candidates.chunks(LANES).zip(found.chunks_mut(LANES)) {
            let inputs = scaled_lanes(model, situation, varying, some);
            self.arch.dispatch(
                #[inline(always)]
                || room.lanes(&model.exact, inputs),
            );
            for (lane, found) in found.iter_mut().enumerate() {
                *found = model
                    .outputs
                    .map(|(output, scale)| room.x[output * LANES + lane] * scale);
            }
        }
    }
}

/// The candidate's own inputs, normalised.
#[inline(always)]
fn scaled<'q>(
    model: &'q Model,
    situation: &'q Situation,
    varying: &'q [(usize, VaryingValue)],
    candidate: &'q Candidate,
) -> impl Iterator<Item = (usize, f64)> + 'q {
    varying
        .iter()
        .map(move |&(i, of)| (i, model.scaled(i, of(situation, candidate))))
}

/// The same for up to as many candidates as there are lanes; the lanes left over repeat the first.
#[inline(always)]
fn scaled_lanes<'q>(
    model: &'q Model,
    situation: &'q Situation,
    varying: &'q [(usize, VaryingValue)],
    candidates: &'q [Candidate],
) -> impl Iterator<Item = (usize, [f64; LANES])> + 'q {
    varying.iter().map(move |&(i, of)| {
        let lane = |lane: usize| {
            let candidate = candidates.get(lane).unwrap_or(&candidates[0]);
            model.scaled(i, of(situation, candidate))
        };
        (i, std::array::from_fn(lane))
    })
}
