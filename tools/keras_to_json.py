#!/usr/bin/env python3
"""Converts a Keras 3 model (.keras) to the model file that uwguide reads (docs/interfaces.md, section 5).

    python3 tools/keras_to_json.py MODEL.keras --inputs NAMES.json -o MODEL.json

NAMES.json holds what Keras does not know, the inputs in the model's order:

    {"inputs": [{"name": "kz_r", "unit": "1", "mean": 0.53, "std": 0.21}, ...],
     "outputs": [{"name": "contrast_r", "unit": "8bit_counts", "scale": 15.0}, ...]}

Each input may also carry "min" and "max", its range in training (all of them or none), and the file the objects
"camera", "sensor", "lamps" and "training" of a model file, without which the daemon can check less.

mean and std are those by which the inputs were normalised before they reached the model; leave them out when the
model begins with a Normalization layer. Without "outputs" they are contrast_r, contrast_g, contrast_b in 8-bit counts.
Dense layers in a row are converted; InputLayer, Dropout and Activation layers between them are understood.

Needs h5py (apt-get install python3-h5py, or pip install h5py); Keras itself is not needed.
"""

import argparse
import io
import json
import math
import os
import re
import sys
import tempfile
import zipfile

import h5py

ACTIVATIONS = ("relu", "linear", "tanh", "sigmoid", "leaky_relu")
# Keras divides by the larger of this and the standard deviation.
LEAST_STD = 1e-7
OUTPUTS = [{"name": f"contrast_{k}", "unit": "8bit_counts"} for k in "rgb"]


# What may be told of an input besides its name and unit, and of a model besides its network.
RANGE = ("min", "max")
OF_MODEL = ("camera", "sensor", "lamps", "training")


class Unusable(Exception):
    """What is wrong with a file, and where."""


def read_keras(path):
    """The configuration of the layers and their variables by the layers' names."""
    try:
        with zipfile.ZipFile(path) as archive:
            config = json.loads(archive.read("config.json"))
            weights = io.BytesIO(archive.read("model.weights.h5"))
    except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise Unusable(f"{path}: not a Keras 3 model (.keras): {error}") from error
    if config.get("class_name") not in ("Sequential", "Functional"):
        raise Unusable(f"{path}: must be Sequential or Functional, got {config.get('class_name')}")
    layers = config["config"]["layers"]
    with h5py.File(weights) as file:
        return layers, variables_by_layer(layers, file)


def group_names(layers):
    """The groups that Keras gives to layers in a file of weights: by class and order, whatever the layers' names."""
    taken = {}
    for layer in layers:
        kind = re.sub(r"(.)([A-Z][a-z]+)", r"\1_\2", layer["class_name"])
        kind = re.sub(r"([a-z])([A-Z])", r"\1_\2", kind).lower()
        number = taken.setdefault(kind, 0)
        taken[kind] += 1
        yield f"{kind}_{number}" if number else kind


def variables_by_layer(layers, file):
    """Variables by the layers' names: of groups that tell them, else (Keras 3.4 and before) by the order of the layers."""
    groups = {}

    def collect(name, node):
        parts = name.split("/")
        if isinstance(node, h5py.Group) and len(parts) == 3 and parts[-1] == "vars":
            groups[parts[1]] = (node.attrs.get("name"), [node[key][()] for key in sorted(node, key=int)])

    file.visititems(collect)
    told = {str(name): values for name, values in groups.values() if name is not None}
    if told:
        return told
    return {
        layer["config"]["name"]: groups[group][1]
        for layer, group in zip(layers, group_names(layers), strict=True)
        if group in groups
    }


def activation_of(value, where):
    """The name of an activation in a layer's configuration."""
    if isinstance(value, dict):
        value = value.get("config", {}).get("name", value.get("class_name"))
    if value not in ACTIVATIONS:
        raise Unusable(f"{where}: activation must be one of {', '.join(ACTIVATIONS)}, got {value}")
    return value


def dense(config, variables, where):
    """One dense layer of the model file."""
    if not variables:
        raise Unusable(f"{where}: has no weights")
    kernel = variables[0].tolist()
    bias = variables[1].tolist() if config.get("use_bias", True) else [0.0] * config["units"]
    return {
        "type": "dense",
        "units": config["units"],
        "activation": activation_of(config["activation"], where),
        "kernel": kernel,
        "bias": bias,
    }


def normalisation_of(variables, where):
    """Mean and standard deviation of a Normalization layer."""
    if len(variables) < 2 or variables[0].ndim != 1:
        raise Unusable(f"{where}: must be adapted along its last axis")
    mean, variance = variables[0].tolist(), variables[1].tolist()
    return {"mean": mean, "std": [max(math.sqrt(v), LEAST_STD) for v in variance]}


def add_activation(layer, kind, config, where):
    """Gives a dense layer the activation of the layer that follows it."""
    if layer["activation"] != "linear":
        raise Unusable(f"{where}: follows another activation")
    if kind == "LeakyReLU":
        layer.update(activation="leaky_relu", negative_slope=config["negative_slope"])
    elif kind == "ReLU":
        plain = (config.get("max_value"), config.get("negative_slope", 0.0), config.get("threshold", 0.0))
        if plain != (None, 0.0, 0.0):
            raise Unusable(f"{where}: must have no max_value, negative_slope or threshold, got {plain}")
        layer["activation"] = "relu"
    else:
        layer["activation"] = activation_of(config["activation"], where)


def convert_layers(layers, variables):
    """Dense layers, and the normalisation of the inputs where the model holds it."""
    normalisation, converted = None, []
    for layer in layers:
        kind, config = layer["class_name"], layer["config"]
        where = f"layer {config.get('name')} ({kind})"
        if kind in ("InputLayer", "Dropout"):
            continue
        if kind == "Normalization" and not converted and normalisation is None:
            normalisation = normalisation_of(variables.get(config["name"], []), where)
        elif kind == "Dense":
            converted.append(dense(config, variables.get(config["name"], []), where))
        elif kind in ("Activation", "ReLU", "LeakyReLU") and converted:
            add_activation(converted[-1], kind, config, where)
        else:
            raise Unusable(f"{where}: cannot be converted here; Dense layers in a row are")
    if not converted:
        raise Unusable("the model has no Dense layer")
    return normalisation, converted


def convert(model_path, names_path):
    """The model file's content."""
    layers, variables = read_keras(model_path)
    normalisation, converted = convert_layers(layers, variables)
    with open(names_path, encoding="utf-8") as file:
        names = json.load(file)
    inputs = names.get("inputs", [])
    if len(inputs) != len(converted[0]["kernel"]):
        raise Unusable(f"{names_path}: inputs must name {len(converted[0]['kernel'])} inputs, got {len(inputs)}")
    told = [("mean" in i, "std" in i) for i in inputs]
    if normalisation is None:
        if not all(mean and std for mean, std in told):
            raise Unusable(f"{names_path}: each input needs mean and std, as the model has no Normalization layer")
        normalisation = {key: [float(i[key]) for i in inputs] for key in ("mean", "std")}
    elif any(mean or std for mean, std in told):
        raise Unusable(f"{names_path}: inputs must have no mean and std, as the model has a Normalization layer")
    return {
        "format": "uw-mlp",
        "version": 1,
        "inputs": [described(i) for i in inputs],
        "normalisation": normalisation,
        "layers": converted,
        "outputs": names.get("outputs", OUTPUTS),
        **{key: names[key] for key in OF_MODEL if key in names},
    }


def described(entry):
    """An input as the model file has it: name and unit, and its range where it is told."""
    if ("min" in entry) != ("max" in entry):
        raise Unusable(f"input {entry['name']}: must have both min and max, or neither")
    return {"name": entry["name"], "unit": entry["unit"], **{key: entry[key] for key in RANGE if key in entry}}


def write(path, content):
    """Writes JSON; the file appears whole or not at all."""
    folder = os.path.dirname(os.path.abspath(path))
    with tempfile.NamedTemporaryFile("w", dir=folder, suffix=".partial", delete=False, encoding="utf-8") as file:
        json.dump(content, file)
    os.replace(file.name, path)


def main():
    """Reads the arguments and converts; 2 for unusable files."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", metavar="MODEL.keras")
    parser.add_argument("--inputs", required=True, metavar="NAMES.json")
    parser.add_argument("-o", "--output", required=True, metavar="MODEL.json")
    arguments = parser.parse_args()
    try:
        write(arguments.output, convert(arguments.model, arguments.inputs))
    except (Unusable, OSError, ValueError, KeyError) as error:
        print(f"keras_to_json: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
