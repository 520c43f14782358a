//! The network in the tensor library: 20 inputs, two hidden layers, 3 outputs.

use burn::module::{Module, Param};
use burn::nn::Linear;
use burn::tensor::activation::relu;
use burn::tensor::{Device, Tensor, TensorData};

use crate::Error;
use crate::columns::{INPUTS, OUTPUTS};
use crate::model_file::{Activation, Dense};
use crate::rng::Rng;

/// The trainable layers. Normalised inputs in, contrast in units of
/// [`crate::columns::CONTRAST_SCALE_COUNTS`] out.
#[derive(Module, Debug)]
pub(crate) struct Network {
    hidden_1: Linear,
    hidden_2: Linear,
    output: Linear,
}

impl Network {
    /// Random weights after Glorot and Bengio (2010): uniform within sqrt(6 / (inputs + units)),
    /// zero bias, `hidden` units in each hidden layer. Inputs that are not `used` have zero weight and count as absent.
    pub(crate) fn new(
        used: &[bool; INPUTS],
        hidden: usize,
        rng: &mut Rng,
        device: &Device,
    ) -> Self {
        let all = vec![true; hidden];
        Self {
            hidden_1: dense(used, hidden, rng, device),
            hidden_2: dense(&all, hidden, rng, device),
            output: dense(&all, OUTPUTS, rng, device),
        }
    }

    /// Predictions [rows][outputs] for normalised inputs [rows][inputs].
    pub(crate) fn forward(&self, inputs: Tensor<2>) -> Tensor<2> {
        let hidden = relu(self.hidden_1.forward(inputs));
        let hidden = relu(self.hidden_2.forward(hidden));
        self.output.forward(hidden)
    }

    /// The weights as plain numbers, first layer first.
    pub(crate) fn layers(&self) -> Result<Vec<Dense>, Error> {
        Ok(vec![
            plain(&self.hidden_1, Activation::Relu)?,
            plain(&self.hidden_2, Activation::Relu)?,
            plain(&self.output, Activation::Linear)?,
        ])
    }
}

fn dense(used: &[bool], units: usize, rng: &mut Rng, device: &Device) -> Linear {
    let fan_in = used.iter().filter(|&&used| used).count();
    let limit = (6.0 / (fan_in + units) as f64).sqrt();
    let mut kernel = Vec::with_capacity(used.len() * units);
    for &used in used {
        kernel.extend((0..units).map(|_| if used { rng.symmetric(limit) } else { 0.0 }));
    }
    Linear {
        weight: Param::from_data(TensorData::new(kernel, [used.len(), units]), device),
        bias: Some(Param::from_data(
            TensorData::new(vec![0.0f32; units], [units]),
            device,
        )),
    }
}

fn plain(layer: &Linear, activation: Activation) -> Result<Dense, Error> {
    let weight = layer.weight.val();
    let [_, units] = weight.dims();
    let kernel = numbers(weight)?;
    let bias = match &layer.bias {
        Some(bias) => numbers(bias.val())?,
        None => vec![0.0; units],
    };
    let kernel = kernel.chunks(units).map(<[f32]>::to_vec).collect();
    Ok(Dense {
        kind: "dense".to_owned(),
        units,
        activation,
        kernel,
        bias,
    })
}

/// The values of a tensor, last axis fastest.
pub(crate) fn numbers<const D: usize>(tensor: Tensor<D>) -> Result<Vec<f32>, Error> {
    tensor
        .try_into_vec_as::<f32>()
        .map_err(|error| Error::Backend(error.to_string()))
}
