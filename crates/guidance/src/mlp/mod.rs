//! The network that predicts contrast: a stack of dense layers.
//!
//! Predictions that are told are made in double precision; the search looks around in single precision.

use uw_calib::json::FieldError;

use crate::card::Card;
use crate::features::Feature;

mod dense;
mod known;
mod query;

use dense::{Dense, Real};
pub use query::Query;

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

/// A dense layer as a file has it: activation(x · kernel + bias).
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Layer {
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
}

/// All layers, ready to be evaluated.
#[derive(Clone, Debug)]
struct Network<T> {
    layers: Vec<Dense<T>>,
}

impl<T: Real> Network<T> {
    fn new(layers: &[Layer]) -> Self {
        Self {
            layers: layers.iter().map(Dense::new).collect(),
        }
    }
}

/// A checked model: every shape fits, every number is finite, no standard deviation is zero.
#[derive(Clone, Debug)]
pub struct Model {
    inputs: Vec<&'static Feature>,
    mean: Vec<f64>,
    std: Vec<f64>,
    /// At least one; the last has three outputs.
    layers: Vec<Layer>,
    /// For R, G, B: which output of the last layer, and counts per unit of it.
    outputs: [(usize, f64); 3],
    exact: Network<f64>,
    quick: Network<f32>,
    card: Card,
}

impl Model {
    /// A model from its checked parts.
    pub(crate) fn new(
        inputs: Vec<&'static Feature>,
        mean: Vec<f64>,
        std: Vec<f64>,
        layers: Vec<Layer>,
        outputs: [(usize, f64); 3],
        card: Card,
    ) -> Self {
        let (exact, quick) = (Network::new(&layers), Network::new(&layers));
        Self {
            inputs,
            mean,
            std,
            layers,
            outputs,
            exact,
            quick,
            card,
        }
    }

    /// The inputs in the model's order.
    pub fn inputs(&self) -> &[&'static Feature] {
        &self.inputs
    }

    /// What the file says about where the network can be trusted.
    pub fn card(&self) -> &Card {
        &self.card
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
        for layer in &self.exact.layers {
            let mut sums = vec![0.0; layer.padded()];
            layer.one(&x, &mut sums, &mut Vec::new());
            x = sums;
        }
        Ok(self.contrast(&x))
    }

    fn scaled(&self, input: usize, value: f64) -> f64 {
        (value - self.mean[input]) / self.std[input]
    }

    fn contrast(&self, last: &[f64]) -> [f64; 3] {
        self.outputs.map(|(output, scale)| last[output] * scale)
    }
}
