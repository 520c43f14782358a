//! Dense layers in the order in which processors like to read them.
//!
//! Weights are kept in tiles of neighbouring outputs, input after input, so that the sums of a tile stay in
//! registers while its weights stream by. Each sum is bias + x_0·w_0 + x_1·w_1 + .. in the order of the
//! inputs, whether one candidate or several are evaluated and however wide the processor's registers are:
//! the same bits everywhere (no fused multiply-add, which would round differently).

use std::fmt::Debug;
use std::ops::{AddAssign, Mul};

use super::{Activation, Layer};

/// Candidates evaluated side by side.
pub(super) const LANES: usize = 16;
/// Outputs of a wide tile; of a narrow one, for layers with few outputs.
const WIDE: usize = 32;
const NARROW: usize = 8;
/// Outputs whose sums for all lanes are held at once.
const GROUP: usize = 8;

/// Single or double precision.
pub(super) trait Real:
    Copy + Debug + Default + PartialOrd + AddAssign + Mul<Output = Self> + 'static
{
    fn of(value: f64) -> Self;
    fn tanh(self) -> Self;
    fn sigmoid(self) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }

    fn tanh(self) -> Self {
        f64::tanh(self)
    }

    fn sigmoid(self) -> Self {
        1.0 / (1.0 + (-self).exp())
    }
}

impl Real for f32 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value as f32
    }

    fn tanh(self) -> Self {
        f32::tanh(self)
    }

    fn sigmoid(self) -> Self {
        1.0 / (1.0 + (-self).exp())
    }
}

/// A layer in tiles.
#[derive(Clone, Debug)]
pub(super) struct Dense<T> {
    inputs: usize,
    tile: usize,
    /// Tile after tile, in each one row of `tile` weights per input; outputs beyond the last have zeros.
    weights: Vec<T>,
    /// As many as the tiles have outputs.
    bias: Vec<T>,
    activation: Activation,
}

impl<T: Real> Dense<T> {
    pub fn new(layer: &Layer) -> Self {
        let outputs = layer.outputs();
        let inputs = layer.kernel.len() / outputs;
        let tile = if outputs <= NARROW { NARROW } else { WIDE };
        let tiles = outputs.div_ceil(tile);
        let mut weights = vec![T::default(); tiles * inputs * tile];
        let mut bias = vec![T::default(); tiles * tile];
        for output in 0..outputs {
            bias[output] = T::of(layer.bias[output]);
            for input in 0..inputs {
                let at = (output / tile * inputs + input) * tile + output % tile;
                weights[at] = T::of(layer.row(input)[output]);
            }
        }
        Self {
            inputs,
            tile,
            weights,
            bias,
            activation: layer.activation,
        }
    }

    /// Outputs with those that only fill the last tile.
    pub fn padded(&self) -> usize {
        self.bias.len()
    }

    /// Adds x times the weights of one input to the sums of all outputs.
    #[inline(always)]
    pub fn add_input(&self, sums: &mut [T], input: usize, x: T) {
        let tiles = self.weights.chunks_exact(self.inputs * self.tile);
        for (sums, weights) in sums.chunks_exact_mut(self.tile).zip(tiles) {
            let row = &weights[input * self.tile..(input + 1) * self.tile];
            for (sum, &weight) in sums.iter_mut().zip(row) {
                *sum += x * weight;
            }
        }
    }

    /// The same for as many candidates as there are lanes; `sums` holds the lanes of each output together.
    #[inline(always)]
    pub fn add_input_lanes(&self, sums: &mut [T], input: usize, x: &[T; LANES]) {
        let tiles = self.weights.chunks_exact(self.inputs * self.tile);
        let outputs = sums.as_chunks_mut::<LANES>().0;
        for (outputs, weights) in outputs.chunks_exact_mut(self.tile).zip(tiles) {
            let row = &weights[input * self.tile..(input + 1) * self.tile];
            for (sums, &weight) in outputs.iter_mut().zip(row) {
                for lane in 0..LANES {
                    sums[lane] += x[lane] * weight;
                }
            }
        }
    }

    /// Outputs for the inputs of one candidate. `active` is room for a list.
    #[inline(always)]
    pub fn one(&self, x: &[T], sums: &mut [T], active: &mut Vec<u32>) {
        // After a ReLU about half of the inputs are zero.
        active.clear();
        let zero = T::default();
        active.extend((0u32..).zip(&x[..self.inputs]).filter_map(|(i, &x)| {
            // A NaN differs from zero and stays in.
            (x != zero).then_some(i)
        }));
        match self.tile {
            NARROW => self.one_in::<NARROW>(x, sums, active),
            _ => self.one_in::<WIDE>(x, sums, active),
        }
        self.activate(sums);
    }

    #[inline(always)]
    fn one_in<const TILE: usize>(&self, x: &[T], sums: &mut [T], active: &[u32]) {
        let tiles = self.weights.chunks_exact(self.inputs * TILE);
        let biases = self.bias.as_chunks::<TILE>().0;
        let outputs = sums.as_chunks_mut::<TILE>().0;
        for ((output, bias), weights) in outputs.iter_mut().zip(biases).zip(tiles) {
            let rows = weights.as_chunks::<TILE>().0;
            let mut sums = *bias;
            for &i in active {
                let (x, row) = (x[i as usize], &rows[i as usize]);
                for k in 0..TILE {
                    sums[k] += x * row[k];
                }
            }
            *output = sums;
        }
    }

    /// Outputs for as many candidates as there are lanes; the lanes of each input and output lie together.
    #[inline(always)]
    pub fn lanes(&self, x: &[T], sums: &mut [T]) {
        match self.tile {
            NARROW => self.lanes_in::<NARROW>(x, sums),
            _ => self.lanes_in::<WIDE>(x, sums),
        }
        self.activate(sums);
    }

    #[inline(always)]
    fn lanes_in<const TILE: usize>(&self, x: &[T], sums: &mut [T]) {
        let x = &x.as_chunks::<LANES>().0[..self.inputs];
        let tiles = self.weights.chunks_exact(self.inputs * TILE);
        let biases = self.bias.as_chunks::<TILE>().0;
        let outputs = sums.as_chunks_mut::<LANES>().0;
        for ((outputs, bias), weights) in outputs.chunks_exact_mut(TILE).zip(biases).zip(tiles) {
            let rows = weights.as_chunks::<TILE>().0;
            for (group, outputs) in outputs.as_chunks_mut::<GROUP>().0.iter_mut().enumerate() {
                let first = group * GROUP;
                // Separate variables, as the compiler keeps an array of arrays in memory.
                let [
                    mut s0,
                    mut s1,
                    mut s2,
                    mut s3,
                    mut s4,
                    mut s5,
                    mut s6,
                    mut s7,
                ] = [0, 1, 2, 3, 4, 5, 6, 7].map(|k| [bias[first + k]; LANES]);
                for (row, x) in rows.iter().zip(x) {
                    let w: [T; GROUP] = std::array::from_fn(|k| row[first + k]);
                    add_scaled(&mut s0, x, w[0]);
                    add_scaled(&mut s1, x, w[1]);
                    add_scaled(&mut s2, x, w[2]);
                    add_scaled(&mut s3, x, w[3]);
                    add_scaled(&mut s4, x, w[4]);
                    add_scaled(&mut s5, x, w[5]);
                    add_scaled(&mut s6, x, w[6]);
                    add_scaled(&mut s7, x, w[7]);
                }
                *outputs = [s0, s1, s2, s3, s4, s5, s6, s7];
            }
        }
    }

    /// Applies the activation to each sum.
    #[inline(always)]
    pub fn activate(&self, sums: &mut [T]) {
        let zero = T::default();
        match self.activation {
            Activation::Linear => {}
            // A maximum would turn a NaN into 0 and hide it.
            Activation::Relu => sums.iter_mut().for_each(|x| {
                *x = if *x < zero { zero } else { *x };
            }),
            Activation::Tanh => sums.iter_mut().for_each(|x| *x = x.tanh()),
            Activation::Sigmoid => sums.iter_mut().for_each(|x| *x = x.sigmoid()),
            Activation::LeakyRelu { negative_slope } => {
                let slope = T::of(negative_slope);
                sums.iter_mut().for_each(|x| {
                    *x = if *x < zero { *x * slope } else { *x };
                });
            }
        }
    }
}

#[inline(always)]
fn add_scaled<T: Real>(sums: &mut [T; LANES], x: &[T; LANES], weight: T) {
    for lane in 0..LANES {
        sums[lane] += x[lane] * weight;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(inputs: usize, outputs: usize, activation: Activation) -> Layer {
        let number = |k: usize| ((k * 7919 % 1009) as f64 / 1009.0 - 0.5) * 2.0;
        Layer {
            kernel: (0..inputs * outputs).map(number).collect(),
            bias: (0..outputs).map(|k| number(k + 5)).collect(),
            activation,
        }
    }

    /// bias + Σ x·w, written out.
    fn plain(layer: &Layer, x: &[f64]) -> Vec<f64> {
        (0..layer.outputs())
            .map(|output| {
                let mut sum = layer.bias[output];
                for (input, x) in x.iter().enumerate() {
                    sum += x * layer.row(input)[output];
                }
                sum
            })
            .collect()
    }

    #[test]
    fn one_and_many_candidates_have_the_bits_of_the_plain_sum() {
        for (inputs, outputs) in [(1, 1), (20, 3), (7, 4), (9, 5), (33, 32), (128, 70)] {
            let layer = layer(inputs, outputs, Activation::Linear);
            let dense = Dense::<f64>::new(&layer);
            let candidate = |lane: usize| -> Vec<f64> {
                (0..inputs)
                    .map(|i| {
                        if (i + lane).is_multiple_of(3) {
                            0.0
                        } else {
                            (i * lane) as f64 * 0.37 - 1.0
                        }
                    })
                    .collect()
            };
            let mut x = vec![0.0; inputs * LANES];
            for lane in 0..LANES {
                for (i, value) in candidate(lane).into_iter().enumerate() {
                    x[i * LANES + lane] = value;
                }
            }
            let mut many = vec![f64::NAN; dense.padded() * LANES];
            dense.lanes(&x, &mut many);
            for lane in 0..LANES {
                let mut one = vec![f64::NAN; dense.padded()];
                dense.one(&candidate(lane), &mut one, &mut Vec::new());
                let expected = plain(&layer, &candidate(lane));
                assert_eq!(one[..outputs], expected[..]);
                let lanes: Vec<f64> = (0..outputs).map(|o| many[o * LANES + lane]).collect();
                assert_eq!(lanes, expected, "{inputs} x {outputs}, lane {lane}");
            }
        }
    }

    #[test]
    fn activations_have_their_values_in_both_precisions() {
        let cases = [
            (Activation::Relu, [0.0, 0.0, 2.0]),
            (Activation::Linear, [-1.0, 0.0, 2.0]),
            (
                Activation::Tanh,
                [-0.761_594_155_955_764_9, 0.0, 0.964_027_580_075_816_9],
            ),
            (
                Activation::Sigmoid,
                [0.268_941_421_369_995_1, 0.5, 0.880_797_077_977_882_3],
            ),
            (
                Activation::LeakyRelu {
                    negative_slope: 0.2,
                },
                [-0.2, 0.0, 2.0],
            ),
        ];
        for (activation, expected) in cases {
            let layer = layer(1, 1, activation);
            let (mut wide, mut narrow) = ([-1.0, 0.0, 2.0], [-1.0f32, 0.0, 2.0]);
            Dense::<f64>::new(&layer).activate(&mut wide);
            Dense::<f32>::new(&layer).activate(&mut narrow);
            for k in 0..3 {
                assert!((wide[k] - expected[k]).abs() < 1e-15, "{activation:?}");
                assert!((f64::from(narrow[k]) - expected[k]).abs() < 1e-7);
            }
        }
    }

    #[test]
    fn a_nan_is_not_hidden_by_relu() {
        let dense = Dense::<f64>::new(&layer(1, 1, Activation::Relu));
        let mut sums = [0.0; NARROW];
        dense.one(&[f64::NAN], &mut sums, &mut Vec::new());
        assert!(sums[0].is_nan());
    }
}
