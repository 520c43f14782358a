//! The network that predicts contrast: a stack of dense layers, evaluated in f64.
//!
//! A question evaluates hundreds of candidates that differ in two inputs only. [`Model::query`] therefore
//! multiplies the other inputs with the first layer once.

use uw_calib::json::FieldError;

use crate::features::{Candidate, Feature, FeatureValue, Situation, VaryingValue};

/// What a layer does to each of its sums.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Activation {
    /// max(0, x).
    Relu,
    /// x.
    Linear,
    /// Hyperbolic tangent.
    Tanh,
    /// 1 / (1 + exp(-x)).
    Sigmoid,
    /// x for x >= 0, `negative_slope` · x below.
    LeakyRelu {
        /// Slope below zero, finite.
        negative_slope: f64,
    },
}

impl Activation {
    fn apply(self, values: &mut [f64]) {
        let each = |values: &mut [f64], f: fn(f64) -> f64| {
            for value in values {
                *value = f(*value);
            }
        };
        match self {
            // `f64::max` would turn a NaN into 0 and hide it.
            Self::Relu => each(values, |x| if x < 0.0 { 0.0 } else { x }),
            Self::Linear => {}
            Self::Tanh => each(values, f64::tanh),
            Self::Sigmoid => each(values, |x| 1.0 / (1.0 + (-x).exp())),
            Self::LeakyRelu { negative_slope } => {
                for value in values {
                    if *value < 0.0 {
                        *value *= negative_slope;
                    }
                }
            }
        }
    }
}

/// A dense layer: activation(x · kernel + bias).
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Row by row, one row of `bias.len()` weights per input.
    pub(crate) kernel: Vec<f64>,
    pub(crate) bias: Vec<f64>,
    pub(crate) activation: Activation,
}

impl Layer {
    fn outputs(&self) -> usize {
        self.bias.len()
    }

    fn row(&self, input: usize) -> &[f64] {
        &self.kernel[input * self.outputs()..(input + 1) * self.outputs()]
    }

    fn forward(&self, inputs: &[f64], sums: &mut Vec<f64>) {
        sums.clear();
        sums.extend_from_slice(&self.bias);
        // After a ReLU about half of the inputs are zero. Four rows at a time, because most of the work is
        // loading and storing the sums.
        let mut some = inputs.iter().copied().zip(0..).filter(|&(x, _)| x != 0.0);
        while let Some(first) = some.next() {
            match (some.next(), some.next(), some.next()) {
                (Some(second), Some(third), Some(fourth)) => {
                    self.add_four(sums, [first, second, third, fourth]);
                }
                (second, third, fourth) => {
                    for (x, i) in [Some(first), second, third, fourth].into_iter().flatten() {
                        add_scaled(sums, x, self.row(i));
                    }
                }
            }
        }
        self.activation.apply(sums);
    }

    fn add_four(&self, sums: &mut [f64], inputs: [(f64, usize); 4]) {
        let [x0, x1, x2, x3] = inputs.map(|(x, _)| x);
        let [row0, row1, row2, row3] = inputs.map(|(_, i)| self.row(i));
        let rows = row0.iter().zip(row1).zip(row2).zip(row3);
        for (sum, (((w0, w1), w2), w3)) in sums.iter_mut().zip(rows) {
            *sum += (x0 * w0 + x1 * w1) + (x2 * w2 + x3 * w3);
        }
    }
}

fn add_scaled(sums: &mut [f64], x: f64, row: &[f64]) {
    for (sum, weight) in sums.iter_mut().zip(row) {
        *sum += x * weight;
    }
}

/// A checked model: every shape fits, every number is finite, no standard deviation is zero.
#[derive(Clone, Debug)]
pub struct Model {
    pub(crate) inputs: Vec<&'static Feature>,
    pub(crate) mean: Vec<f64>,
    pub(crate) std: Vec<f64>,
    /// At least one; the last has three outputs.
    pub(crate) layers: Vec<Layer>,
    /// For R, G, B: which output of the last layer, and counts per unit of it.
    pub(crate) outputs: [(usize, f64); 3],
}

impl Model {
    /// The inputs in the model's order.
    pub fn inputs(&self) -> &[&'static Feature] {
        &self.inputs
    }

    /// Width of each layer.
    pub fn layer_widths(&self) -> Vec<usize> {
        self.layers.iter().map(Layer::outputs).collect()
    }

    /// Contrast per channel, 8-bit counts, for inputs in the model's order and their units.
    pub fn forward(&self, inputs: &[f64]) -> Result<[f64; 3], FieldError> {
        if inputs.len() != self.inputs.len() {
            let expected = format!("{} numbers", self.inputs.len());
            return Err(FieldError::invalid("inputs", expected, inputs.len()));
        }
        let mut x: Vec<f64> = (0..inputs.len())
            .map(|i| self.scaled(i, inputs[i]))
            .collect();
        let mut sums = Vec::new();
        for layer in &self.layers {
            layer.forward(&x, &mut sums);
            std::mem::swap(&mut x, &mut sums);
        }
        Ok(self.contrast(&x))
    }

    /// Prepares the network for many candidates in one situation.
    pub fn query(&self, situation: &Situation) -> Query<'_> {
        let first = &self.layers[0];
        let mut fixed_sums = first.bias.clone();
        let mut varying = Vec::with_capacity(2);
        for (i, input) in self.inputs.iter().enumerate() {
            match input.value {
                FeatureValue::Fixed(of) => {
                    add_scaled(&mut fixed_sums, self.scaled(i, of(situation)), first.row(i));
                }
                FeatureValue::Varying(of) => varying.push((i, of)),
            }
        }
        Query {
            model: self,
            situation: *situation,
            fixed_sums,
            varying,
            x: Vec::new(),
            sums: Vec::new(),
        }
    }

    fn scaled(&self, input: usize, value: f64) -> f64 {
        (value - self.mean[input]) / self.std[input]
    }

    fn contrast(&self, last: &[f64]) -> [f64; 3] {
        self.outputs.map(|(output, scale)| last[output] * scale)
    }
}

/// The network for one situation; evaluates candidates one after the other.
#[derive(Clone, Debug)]
pub struct Query<'a> {
    model: &'a Model,
    situation: Situation,
    /// Sums of the first layer over the inputs that all candidates share.
    fixed_sums: Vec<f64>,
    /// Position and value of the other inputs.
    varying: Vec<(usize, VaryingValue)>,
    x: Vec<f64>,
    sums: Vec<f64>,
}

impl Query<'_> {
    /// Predicted contrast per channel, 8-bit counts, when the vehicle takes the candidate.
    pub fn contrast(&mut self, candidate: &Candidate) -> [f64; 3] {
        let Some((first, rest)) = self.model.layers.split_first() else {
            return [f64::NAN; 3];
        };
        self.x.clone_from(&self.fixed_sums);
        for &(i, of) in &self.varying {
            let value = self.model.scaled(i, of(&self.situation, candidate));
            add_scaled(&mut self.x, value, first.row(i));
        }
        first.activation.apply(&mut self.x);
        for layer in rest {
            layer.forward(&self.x, &mut self.sums);
            std::mem::swap(&mut self.x, &mut self.sums);
        }
        self.model.contrast(&self.x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn activations_have_their_values() {
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
            let mut values = [-1.0, 0.0, 2.0];
            activation.apply(&mut values);
            for k in 0..3 {
                assert!(
                    (values[k] - expected[k]).abs() < 1e-15,
                    "{activation:?} {values:?}"
                );
            }
        }
    }

    #[test]
    fn a_nan_is_not_hidden_by_relu() {
        let mut values = [f64::NAN];
        Activation::Relu.apply(&mut values);
        assert!(values[0].is_nan());
    }

    #[test]
    fn a_layer_multiplies_inputs_by_rows() {
        // Row i is [10^i, 2 · 10^i], so each digit of a sum is an input; some are zero and left out.
        let layer = Layer {
            kernel: (0..9)
                .flat_map(|i| [10f64.powi(i), 2.0 * 10f64.powi(i)])
                .collect(),
            bias: vec![0.5, -0.5],
            activation: Activation::Linear,
        };
        let mut sums = Vec::new();
        for inputs in [123_000_000.0, 123_456_789.0, 100_406_709.0, 123_406_789.0] {
            let digits: Vec<f64> = (0..9)
                .map(|i| (inputs / 10f64.powi(i)).floor() % 10.0)
                .collect();
            layer.forward(&digits, &mut sums);
            assert_eq!(sums, [inputs + 0.5, 2.0 * inputs - 0.5]);
        }
    }
}
