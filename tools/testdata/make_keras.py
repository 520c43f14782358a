#!/usr/bin/env python3
"""Writes a small model and what it predicts, as the installed Keras saves it.

    pip install keras==3.4.1 "jax[cpu]<0.5" scipy && KERAS_BACKEND=jax python3 make_keras.py keras_3_4
    pip install keras==3.15.1 jax scipy && KERAS_BACKEND=jax python3 make_keras.py keras_3_15

More than ten layers of one kind, so that an order by the alphabet (dense_10 before dense_2) is a wrong one; names that
are not those of the groups in the file; layers without weights between them.
"""

import json
import pathlib
import sys

import keras
import numpy

INPUTS, UNITS = 4, 3
HERE = pathlib.Path(__file__).parent
chance = numpy.random.default_rng(34)
layers = keras.layers

normalization = layers.Normalization(axis=-1, name="scale")
normalization.adapt(chance.normal(3.0, 2.0, (64, INPUTS)).astype("float32"))
hidden = [layers.Dense(UNITS, activation="tanh", name=f"part_{20 - k}") for k in range(11)]
model = keras.Sequential(
    [keras.Input((INPUTS,)), normalization]
    + hidden[:5]
    + [layers.Dropout(0.1)]
    + hidden[5:]
    + [layers.Dense(UNITS, name="dense_1"), layers.LeakyReLU(negative_slope=0.2), layers.Dense(3, name="dense")]
)
for layer in model.layers:
    if isinstance(layer, layers.Dense):
        layer.set_weights([chance.normal(0.0, 0.7, w.shape).astype("float32") for w in layer.get_weights()])
inputs = chance.normal(3.0, 2.0, (5, INPUTS)).astype("float32")
model.save(HERE / f"{sys.argv[1]}.keras")
(HERE / f"{sys.argv[1]}_io.json").write_text(
    json.dumps({"inputs": inputs.tolist(), "outputs": numpy.asarray(model(inputs)).tolist()}) + "\n"
)
