//! Stage 6: the model file, format `uw-mlp` version 1.

use std::path::Path;

use serde::{Serialize, Serializer};

use crate::Error;
use crate::columns::{
    CONTRAST_SCALE_COUNTS, INPUTS, OUTPUT_NAMES, OUTPUT_UNIT, OUTPUTS, Offsets, inputs,
};
use crate::normalisation::Normalisation;
use crate::output;

/// A trained model. Prediction = layers((x − mean) / std) · scale, in 8-bit counts; each layer is
/// activation(x · kernel + bias).
#[derive(Clone, Debug, Serialize)]
pub struct Model {
    format: &'static str,
    version: u32,
    inputs: Vec<InputEntry>,
    normalisation: Stored,
    layers: Vec<Dense>,
    outputs: [OutputEntry; OUTPUTS],
}

/// Mean and standard deviation of the inputs that the network has.
#[derive(Clone, Debug, Serialize)]
struct Stored {
    mean: Vec<f32>,
    std: Vec<f32>,
}

#[derive(Clone, Debug, Serialize)]
struct InputEntry {
    name: &'static str,
    unit: &'static str,
}

#[derive(Clone, Debug, Serialize)]
struct OutputEntry {
    name: &'static str,
    unit: &'static str,
    scale: f32,
}

/// One dense layer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Dense {
    /// Always `dense`.
    #[serde(rename = "type")]
    pub kind: &'static str,
    /// Number of outputs of the layer.
    pub units: usize,
    /// Function applied to each output.
    pub activation: Activation,
    /// Weights, [inputs][units].
    pub kernel: Vec<Vec<f32>>,
    /// Added before the activation, one per unit.
    pub bias: Vec<f32>,
}

impl Dense {
    fn apply(&self, inputs: &[f32]) -> Vec<f32> {
        let mut sums = self.bias.clone();
        for (input, weights) in inputs.iter().zip(&self.kernel) {
            // Rectified units are often 0.
            if *input != 0.0 {
                sums.iter_mut()
                    .zip(weights)
                    .for_each(|(s, w)| *s += input * w);
            }
        }
        if self.activation == Activation::Relu {
            sums.iter_mut().for_each(|s| *s = s.max(0.0));
        }
        sums
    }

    /// True when every weight and bias is finite.
    pub fn is_finite(&self) -> bool {
        self.kernel
            .iter()
            .chain([&self.bias])
            .flatten()
            .all(|value| value.is_finite())
    }
}

/// Activation function of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activation {
    /// max(x, 0)
    Relu,
    /// x
    Linear,
}

impl Serialize for Activation {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(match self {
            Self::Relu => "relu",
            Self::Linear => "linear",
        })
    }
}

impl Model {
    pub(crate) fn new(
        offsets: Offsets,
        normalisation: &Normalisation,
        mut layers: Vec<Dense>,
    ) -> Self {
        let inputs = inputs(offsets);
        // Rows of inputs that the network does not have are 0.
        if let Some(first) = layers.first_mut() {
            first.kernel.truncate(inputs.len());
        }
        let entry = |name| OutputEntry {
            name,
            unit: OUTPUT_UNIT,
            scale: CONTRAST_SCALE_COUNTS,
        };
        Self {
            format: "uw-mlp",
            version: 1,
            normalisation: Stored {
                mean: normalisation.mean[..inputs.len()].to_vec(),
                std: normalisation.std[..inputs.len()].to_vec(),
            },
            inputs: inputs
                .into_iter()
                .map(|input| InputEntry {
                    name: input.name,
                    unit: input.unit,
                })
                .collect(),
            layers,
            outputs: OUTPUT_NAMES.map(entry),
        }
    }

    /// The layers, first to last.
    pub fn layers(&self) -> &[Dense] {
        &self.layers
    }

    /// Predicted contrast of rows of [`Table::inputs`](crate::Table::inputs), 8-bit counts.
    pub fn predict(&self, rows: &[[f32; INPUTS]]) -> Vec<[f32; OUTPUTS]> {
        let mut result = Vec::with_capacity(rows.len());
        for row in rows {
            let Stored { mean, std } = &self.normalisation;
            let normalised = row
                .iter()
                .zip(mean)
                .zip(std)
                .map(|((x, mean), std)| (x - mean) / std);
            let mut values: Vec<f32> = normalised.collect();
            for layer in &self.layers {
                values = layer.apply(&values);
            }
            result.push(std::array::from_fn(|k| {
                values.get(k).copied().unwrap_or(f32::NAN) * self.outputs[k].scale
            }));
        }
        result
    }

    /// Writes the file whole or not at all; an existing file is replaced.
    ///
    /// # Errors
    /// When the folder or the disk refuses.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        output::write_json(path, self, output::Layout::Compact)
    }
}
