//! Stage 6: the model file, format `uw-mlp` version 1.

use std::path::Path;

use serde::{Serialize, Serializer};

use crate::Error;
use crate::columns::{CONTRAST_SCALE_COUNTS, OUTPUT_NAMES, OUTPUT_UNIT, OUTPUTS, Offsets, inputs};
use crate::normalisation::Normalisation;
use crate::output;

/// A trained model. Prediction = layers((x − mean) / std) · scale, in 8-bit counts; each layer is
/// activation(x · kernel + bias).
#[derive(Clone, Debug, Serialize)]
pub struct Model {
    format: &'static str,
    version: u32,
    inputs: Vec<InputEntry>,
    normalisation: Normalisation,
    layers: Vec<Dense>,
    outputs: [OutputEntry; OUTPUTS],
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
    pub(crate) fn new(offsets: Offsets, normalisation: Normalisation, layers: Vec<Dense>) -> Self {
        let entry = |name| OutputEntry {
            name,
            unit: OUTPUT_UNIT,
            scale: CONTRAST_SCALE_COUNTS,
        };
        Self {
            format: "uw-mlp",
            version: 1,
            inputs: inputs(offsets)
                .into_iter()
                .map(|input| InputEntry {
                    name: input.name,
                    unit: input.unit,
                })
                .collect(),
            normalisation,
            layers,
            outputs: OUTPUT_NAMES.map(entry),
        }
    }

    /// The layers, first to last.
    pub fn layers(&self) -> &[Dense] {
        &self.layers
    }

    /// Writes the file whole or not at all; an existing file is replaced.
    ///
    /// # Errors
    /// When the folder or the disk refuses.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        output::write_json(path, self, output::Layout::Compact)
    }
}
