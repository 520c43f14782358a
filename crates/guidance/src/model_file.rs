//! The model file: format `uw-mlp` version 1, JSON.
//!
//! Everything is checked while loading, so that a model that loads can be evaluated: names and units against
//! the table of features, shapes from layer to layer, finite numbers, standard deviations that are not zero.

use std::path::Path;

use serde_json::Value;
use thiserror::Error;
use uw_calib::json::{FieldError, Object, array, expect_format, nearest, number};

use crate::card::{self, Card};
use crate::features::{
    CANDIDATE_PAIRS, COUNTS, FEATURES, Feature, FeatureValue, TARGET_PROFILE, feature,
};
use crate::mlp::{Activation, Layer, Model};

/// Slope of `leaky_relu` below zero where a layer does not give one; the default of Keras' activation.
const DEFAULT_NEGATIVE_SLOPE: f64 = 0.2;
const ACTIVATIONS: [&str; 5] = ["relu", "linear", "tanh", "sigmoid", "leaky_relu"];
const OUTPUTS: [&str; 3] = ["contrast_r", "contrast_g", "contrast_b"];

/// Why a model cannot be loaded.
#[derive(Debug, Error)]
pub enum ModelError {
    /// The file cannot be read.
    #[error("{file}: cannot be read: {source}")]
    Read {
        /// File name.
        file: String,
        /// The system's answer.
        source: std::io::Error,
    },
    /// The file is not JSON (which has no NaN and no infinity).
    #[error("{file}: not valid JSON: {source}")]
    Json {
        /// File name.
        file: String,
        /// What the parser found, with line and column.
        source: serde_json::Error,
    },
    /// A field is wrong.
    #[error("{file}: {source}")]
    Field {
        /// File name.
        file: String,
        /// The field and what is wrong with it.
        source: FieldError,
    },
}

/// 16 hexadecimal digits that tell a file's bytes from others (FNV-1a, 64 bits: against mix-ups, not against forgery).
pub(crate) fn digest(bytes: &[u8]) -> String {
    let digest = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{digest:016x}")
}

impl Model {
    /// Reads and checks a model file, a shipped one (`shipped:models/default.json`) too.
    pub fn read(path: &Path) -> Result<Self, ModelError> {
        Ok(Self::read_with_digest(path)?.0)
    }

    /// The same with a digest of the file's bytes that tells it from others.
    pub fn read_with_digest(path: &Path) -> Result<(Self, String), ModelError> {
        let file = path.display().to_string();
        let bytes = uw_assets::SMALL
            .read(path)
            .map_err(|source| ModelError::Read {
                file: file.clone(),
                source,
            })?;
        let value: Value = serde_json::from_slice(&bytes).map_err(|source| ModelError::Json {
            file: file.clone(),
            source,
        })?;
        let model = Self::from_json(&value).map_err(|source| ModelError::Field { file, source })?;
        Ok((model, digest(&bytes)))
    }

    /// A model from the parsed JSON of a model file.
    pub fn from_json(value: &Value) -> Result<Self, FieldError> {
        expect_format(value, "uw-mlp")?;
        let document = Object::new(value, "")?;
        let known = [
            "format",
            "version",
            "comment",
            "source",
            "inputs",
            "normalisation",
            "layers",
            "outputs",
        ];
        document.only(&[&known[..], &card::FIELDS].concat())?;
        check_version(&document)?;
        let inputs = read_inputs(&document)?;
        let (mean, std) = read_normalisation(&document, &inputs)?;
        let layers = read_layers(&document, inputs.len())?;
        let outputs = read_outputs(&document, &layers)?;
        let card = Card::read(&document, &inputs)?;
        Ok(Self::new(inputs, mean, std, layers, outputs, card))
    }
}

fn check_version(document: &Object) -> Result<(), FieldError> {
    let format = document.text("format")?;
    if format != "uw-mlp" {
        return Err(FieldError::invalid(
            "format",
            "\"uw-mlp\"",
            format!("{format:?}"),
        ));
    }
    match document.required("version")?.as_u64() {
        Some(1) => Ok(()),
        _ => Err(FieldError::invalid(
            "version",
            "1",
            document.required("version")?,
        )),
    }
}

fn read_inputs(document: &Object) -> Result<Vec<&'static Feature>, FieldError> {
    let mut inputs: Vec<&'static Feature> = Vec::new();
    for (k, item) in document.array("inputs")?.iter().enumerate() {
        let input = Object::new(item, format!("inputs[{k}]"))?;
        input.only(&["name", "unit", "min", "max"])?;
        let (name, unit) = (input.text("name")?, input.text("unit")?);
        let known = feature(name).ok_or_else(|| unknown_input(&input.path_of("name"), name))?;
        if unit != known.unit {
            let expected = format!("{:?} (the unit of {name})", known.unit);
            return Err(FieldError::invalid(
                input.path_of("unit"),
                expected,
                format!("{unit:?}"),
            ));
        }
        if inputs.iter().any(|earlier| earlier.name == name) {
            let expected = "an input that is not listed before";
            return Err(FieldError::invalid(
                input.path_of("name"),
                expected,
                format!("{name:?}"),
            ));
        }
        inputs.push(known);
    }
    check_complete(&inputs)?;
    Ok(inputs)
}

fn unknown_input(path: &str, name: &str) -> FieldError {
    let names: Vec<&str> = FEATURES.iter().map(|f| f.name).collect();
    let expected = match nearest(name, &names) {
        Some(near) => format!("the name of an input (perhaps {near:?})"),
        None => format!("one of {}", names.join(", ")),
    };
    FieldError::invalid(path, expected, format!("{name:?}"))
}

fn check_complete(inputs: &[&'static Feature]) -> Result<(), FieldError> {
    let has = |name: &str| inputs.iter().any(|input| input.name == name);
    let missing: Vec<&str> = FEATURES
        .iter()
        .filter(|f| matches!(f.value, FeatureValue::Fixed(_)) && !has(f.name))
        .map(|f| f.name)
        .collect();
    if !missing.is_empty() {
        let got = format!("{} inputs without {}", inputs.len(), missing.join(", "));
        return Err(FieldError::invalid("inputs", "complete", got));
    }
    let ahead = TARGET_PROFILE.iter().filter(|name| has(name)).count();
    if ahead != 0 && ahead != TARGET_PROFILE.len() {
        let expected = format!("with all of {} or none", TARGET_PROFILE.join(", "));
        return Err(FieldError::invalid(
            "inputs",
            expected,
            format!("{ahead} of them"),
        ));
    }
    let varying: Vec<&str> = inputs
        .iter()
        .filter(|f| matches!(f.value, FeatureValue::Varying(_)))
        .map(|f| f.name)
        .filter(|name| !TARGET_PROFILE.contains(name))
        .collect();
    let is_pair = CANDIDATE_PAIRS
        .iter()
        .any(|pair| varying.len() == 2 && pair.iter().all(|&n| has(n)));
    if is_pair {
        return Ok(());
    }
    let expected = "with either delta_distance and delta_light or target_distance and target_light";
    let got = if varying.is_empty() {
        "neither".to_owned()
    } else {
        varying.join(", ")
    };
    Err(FieldError::invalid("inputs", expected, got))
}

fn read_normalisation(
    document: &Object,
    inputs: &[&'static Feature],
) -> Result<(Vec<f64>, Vec<f64>), FieldError> {
    let normalisation = document.object("normalisation")?;
    normalisation.only(&["mean", "std"])?;
    let list = |name: &str| {
        let path = normalisation.path_of(name);
        vector(
            normalisation.required(name)?,
            &path,
            inputs.len(),
            "one for each input",
        )
    };
    let (mean, std) = (list("mean")?, list("std")?);
    match std.iter().position(|&s| s <= 0.0) {
        None => Ok((mean, std)),
        Some(k) => {
            let field = format!("normalisation.std[{k}]");
            let expected = format!("> 0 (it divides the input {})", inputs[k].name);
            Err(FieldError::invalid(field, expected, std[k]))
        }
    }
}

fn read_layers(document: &Object, inputs: usize) -> Result<Vec<Layer>, FieldError> {
    let mut layers: Vec<Layer> = Vec::new();
    let mut width = inputs;
    for (k, item) in document.array("layers")?.iter().enumerate() {
        let layer = read_layer(&Object::new(item, format!("layers[{k}]"))?, width)?;
        width = layer.bias.len();
        layers.push(layer);
    }
    if layers.is_empty() {
        return Err(FieldError::invalid("layers", "at least one layer", "none"));
    }
    if width != OUTPUTS.len() {
        let field = format!("layers[{}].units", layers.len() - 1);
        return Err(FieldError::invalid(
            field,
            "3 in the last layer (one for each output)",
            width,
        ));
    }
    Ok(layers)
}

fn read_layer(layer: &Object, inputs: usize) -> Result<Layer, FieldError> {
    layer.only(&[
        "type",
        "name",
        "units",
        "activation",
        "negative_slope",
        "kernel",
        "bias",
    ])?;
    let kind = layer.text("type")?;
    if kind != "dense" {
        let got = format!("{kind:?}");
        return Err(FieldError::invalid(layer.path_of("type"), "\"dense\"", got));
    }
    let units_value = layer.required("units")?;
    let units = units_value
        .as_u64()
        .and_then(|units| usize::try_from(units).ok())
        .filter(|&units| units > 0)
        .ok_or_else(|| {
            FieldError::wrong_type(layer.path_of("units"), "a whole number > 0", units_value)
        })?;
    let path = layer.path_of("kernel");
    let rows = layer.array("kernel")?;
    if rows.len() != inputs {
        let expected = format!("{inputs} rows (one for each input of the layer)");
        return Err(FieldError::invalid(
            path,
            expected,
            format!("{} rows", rows.len()),
        ));
    }
    let mut kernel = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        kernel.extend(vector(
            row,
            &format!("{path}[{i}]"),
            units,
            "one for each unit",
        )?);
    }
    let bias = vector(
        layer.required("bias")?,
        &layer.path_of("bias"),
        units,
        "one for each unit",
    )?;
    Ok(Layer {
        kernel,
        bias,
        activation: read_activation(layer)?,
    })
}

fn read_activation(layer: &Object) -> Result<Activation, FieldError> {
    let path = layer.path_of("activation");
    let activation = match layer.text("activation")? {
        "relu" => Activation::Relu,
        "linear" => Activation::Linear,
        "tanh" => Activation::Tanh,
        "sigmoid" => Activation::Sigmoid,
        "leaky_relu" => Activation::LeakyRelu {
            negative_slope: match layer.get("negative_slope") {
                Some(_) => layer.number("negative_slope")?,
                None => DEFAULT_NEGATIVE_SLOPE,
            },
        },
        other => {
            let expected = format!("one of {}", ACTIVATIONS.join(", "));
            return Err(FieldError::invalid(path, expected, format!("{other:?}")));
        }
    };
    let has_slope = layer.get("negative_slope").is_some();
    if has_slope && !matches!(activation, Activation::LeakyRelu { .. }) {
        let field = layer.path_of("negative_slope");
        return Err(FieldError::invalid(
            field,
            "absent unless activation is leaky_relu",
            "a value",
        ));
    }
    Ok(activation)
}

fn read_outputs(document: &Object, layers: &[Layer]) -> Result<[(usize, f64); 3], FieldError> {
    let items = document.array("outputs")?;
    let width = layers[layers.len() - 1].bias.len();
    if items.len() != width {
        let expected = format!("an array of {width} (one for each unit of the last layer)");
        return Err(FieldError::invalid(
            "outputs",
            expected,
            format!("{}", items.len()),
        ));
    }
    let mut outputs = [None; 3];
    for (k, item) in items.iter().enumerate() {
        let output = Object::new(item, format!("outputs[{k}]"))?;
        output.only(&["name", "unit", "scale"])?;
        let (name, unit) = (output.text("name")?, output.text("unit")?);
        let channel = OUTPUTS.iter().position(|&known| known == name);
        match channel {
            Some(channel) if outputs[channel].is_none() => {
                outputs[channel] = Some((k, read_scale(&output)?));
            }
            _ => {
                let expected = format!("each of {} once", OUTPUTS.join(", "));
                let got = format!("{name:?}");
                return Err(FieldError::invalid(output.path_of("name"), expected, got));
            }
        }
        if unit != COUNTS {
            let expected = format!("{COUNTS:?}");
            return Err(FieldError::invalid(
                output.path_of("unit"),
                expected,
                format!("{unit:?}"),
            ));
        }
    }
    match outputs {
        [Some(r), Some(g), Some(b)] => Ok([r, g, b]),
        _ => Err(FieldError::missing(format!(
            "outputs: one of {}",
            OUTPUTS.join(", ")
        ))),
    }
}

/// 8-bit counts per unit of the network's output, 1 where the file gives none.
fn read_scale(output: &Object) -> Result<f64, FieldError> {
    if output.get("scale").is_none() {
        return Ok(1.0);
    }
    let scale = output.number("scale")?;
    if scale > 0.0 {
        Ok(scale)
    } else {
        Err(FieldError::invalid(output.path_of("scale"), "> 0", scale))
    }
}

fn vector(value: &Value, path: &str, length: usize, why: &str) -> Result<Vec<f64>, FieldError> {
    let items = array(value, path)?;
    if items.len() != length {
        let expected = format!("an array of {length} numbers ({why})");
        return Err(FieldError::invalid(
            path,
            expected,
            format!("{} of them", items.len()),
        ));
    }
    items
        .iter()
        .enumerate()
        .map(|(k, item)| number(item, &format!("{path}[{k}]")))
        .collect()
}
