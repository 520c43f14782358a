//! Stage 6: the model file, format `uw-mlp` version 1.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::card::{self, Pictures};
use crate::columns::{
    CONTRAST_SCALE_COUNTS, INPUTS, OUTPUT_NAMES, OUTPUT_UNIT, OUTPUTS, Offsets, inputs,
};
use crate::normalisation::Normalisation;
use crate::output;
use crate::{Error, Table};

/// A trained model. Prediction = layers((x − mean) / std) · scale, in 8-bit counts; each layer is
/// activation(x · kernel + bias).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Model {
    format: String,
    version: u32,
    inputs: Vec<InputEntry>,
    normalisation: Stored,
    layers: Vec<Dense>,
    outputs: [OutputEntry; OUTPUTS],
    /// Camera, sensor, lamps and training.
    #[serde(flatten)]
    card: Map<String, Value>,
}

/// Mean and standard deviation of the inputs that the network has.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Stored {
    mean: Vec<f32>,
    std: Vec<f32>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct InputEntry {
    name: String,
    unit: String,
    /// Smallest value in training.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    min: Option<f32>,
    /// Largest value in training.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    max: Option<f32>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct OutputEntry {
    name: String,
    unit: String,
    scale: f32,
}

/// One dense layer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Dense {
    /// Always `dense`.
    #[serde(rename = "type")]
    pub kind: String,
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Activation {
    /// max(x, 0)
    Relu,
    /// x
    Linear,
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
        let entry = |name: &str| OutputEntry {
            name: name.to_owned(),
            unit: OUTPUT_UNIT.to_owned(),
            scale: CONTRAST_SCALE_COUNTS,
        };
        Self {
            format: "uw-mlp".to_owned(),
            version: 1,
            normalisation: Stored {
                mean: normalisation.mean[..inputs.len()].to_vec(),
                std: normalisation.std[..inputs.len()].to_vec(),
            },
            inputs: inputs
                .into_iter()
                .map(|input| InputEntry {
                    name: input.name.to_owned(),
                    unit: input.unit.to_owned(),
                    min: None,
                    max: None,
                })
                .collect(),
            layers,
            outputs: OUTPUT_NAMES.map(entry),
            card: Map::new(),
        }
    }

    /// Reads a model that this program has written.
    ///
    /// # Errors
    /// When the file cannot be read or is no such model.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let refuse = |reason: String| Error::ModelFile {
            path: path.to_path_buf(),
            reason,
        };
        let text =
            std::fs::read(path).map_err(|error| refuse(format!("cannot be read: {error}")))?;
        let model: Self =
            serde_json::from_slice(&text).map_err(|error| refuse(error.to_string()))?;
        if model.format != "uw-mlp" || model.version != 1 {
            return Err(refuse("format must be \"uw-mlp\", version 1".to_owned()));
        }
        match model.is_consistent() {
            true => Ok(model),
            false => Err(refuse("its layers do not fit together".to_owned())),
        }
    }

    fn is_consistent(&self) -> bool {
        let Stored { mean, std } = &self.normalisation;
        let mut width = self.inputs.len();
        let fits = self.layers.iter().all(|layer| {
            let units = layer.units;
            let rows = layer.kernel.len() == width && layer.bias.len() == units;
            width = units;
            rows && layer.kernel.iter().all(|row| row.len() == units)
        });
        fits && width == OUTPUTS
            && mean.len() == self.inputs.len()
            && std.len() == self.inputs.len()
    }

    /// How the model is given the candidate, by the names of its inputs.
    ///
    /// # Errors
    /// When its inputs are not in the order in which this program writes them.
    pub fn offsets(&self, path: &Path) -> Result<Offsets, Error> {
        let names = || self.inputs.iter().map(|input| input.name.as_str());
        [Offsets::Delta, Offsets::Target, Offsets::Ahead]
            .into_iter()
            .find(|&offsets| inputs(offsets).iter().map(|input| input.name).eq(names()))
            .ok_or_else(|| Error::ModelFile {
                path: path.to_path_buf(),
                reason: "its inputs must be in the order in which uwtrain writes them".to_owned(),
            })
    }

    /// States where the network can be trusted: the range of every input and the residuals at the present place over the
    /// listed rows (not empty), and what the pictures were.
    pub fn describe(&mut self, table: &Table, rows: &[usize], pictures: Option<&Pictures>) {
        for (input, [min, max]) in self.inputs.iter_mut().zip(card::ranges(table, rows)) {
            (input.min, input.max) = (Some(min), Some(max));
        }
        let residual_here = card::residual_here(self, table, rows);
        self.card
            .extend(card::fields(rows.len(), residual_here, pictures));
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
        output::write_json(path, self, output::JsonLayout::Compact)
    }
}
