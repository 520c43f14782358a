#!/usr/bin/env python3
"""Does a network that corrects predictions by physics beat physics before targets that it has not seen?

    python3 tools/hybrid_trial.py ROWS.csv

ROWS.csv is of the example `physics_accuracy` (docs/physics.md). A network of 64 and 64 hidden units gets the physical prediction, its
error, what the picture shows (contrast, mean, variance inside windows of 2 to 64 pixels), where it was taken and where it asks for, and
tells the logarithm by which the prediction is to be changed. It is trained on all targets but one and tried on that one, for each. Needs
numpy.
"""

import csv
import sys

import numpy as np

WINDOWS = ["within_%d_px" % px for px in (2, 4, 8, 16, 32, 64)]
HIDDEN = 64
EPOCHS = 60
BATCH = 256
FLOOR_COUNTS = 0.05


def read(path):
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    number = lambda name: np.array([float(row[name]) for row in rows])
    log = lambda name: np.log(np.maximum(number(name), FLOOR_COUNTS))
    bands = [np.log(np.maximum(number(name), 1e-9)) for name in WINDOWS]
    channel = number("channel")
    inputs = np.stack(
        [
            log("predicted"), log("error"), log("predicted_here"), log("contrast"), number("mean") / 255.0, number("depth_m"),
            np.log(number("distance_m")), np.log(number("to_distance_m")), number("light_pct") / 100.0, number("to_light_pct") / 100.0,
            *[channel == k for k in range(3)], *bands,
        ],
        axis=1,
    ).astype(np.float64)
    return rows, inputs, number("predicted"), number("truth")


class Network:
    """Two hidden layers of rectified units, trained by Adam on the absolute error in counts."""

    def __init__(self, inputs, seed):
        draw = np.random.default_rng(seed)
        sizes = [inputs, HIDDEN, HIDDEN, 1]
        self.w = [draw.normal(0, np.sqrt(2 / a), (a, b)) for a, b in zip(sizes, sizes[1:])]
        self.w[-1] *= 0.01
        self.b = [np.zeros(b) for b in sizes[1:]]

    def forward(self, x):
        layers = [x]
        for i, (w, b) in enumerate(zip(self.w, self.b)):
            z = layers[-1] @ w + b
            layers.append(np.maximum(z, 0) if i < 2 else np.clip(z, -2, 2))
        return layers

    def train(self, x, predicted, truth, seed, decay):
        draw = np.random.default_rng(seed)
        every = self.w + self.b
        first, second = [np.zeros_like(p) for p in every], [np.zeros_like(p) for p in every]
        step = 0
        for epoch in range(EPOCHS):
            rate = 1e-3 * 0.5 * (1 + np.cos(np.pi * epoch / EPOCHS))
            order = draw.permutation(len(x))
            for start in range(0, len(x), BATCH):
                batch = order[start : start + BATCH]
                layers = self.forward(x[batch])
                changed = predicted[batch] * np.exp(layers[-1][:, 0])
                slope = (np.sign(changed - truth[batch]) * changed / 15 / len(batch))[:, None]
                grads_w, grads_b = [], []
                for i in (2, 1, 0):
                    grads_w.insert(0, layers[i].T @ slope + decay * self.w[i])
                    grads_b.insert(0, slope.sum(axis=0))
                    slope = (slope @ self.w[i].T) * (layers[i] > 0)
                step += 1
                for p, g, m, v in zip(every, grads_w + grads_b, first, second):
                    m += 0.1 * (g - m)
                    v += 0.001 * (g * g - v)
                    p -= rate * (m / (1 - 0.9**step)) / (np.sqrt(v / (1 - 0.999**step)) + 1e-8)


def main():
    rows, inputs, predicted, truth = read(sys.argv[1])
    texture = np.array([row["texture"] for row in rows])
    water = np.array([row["water"] for row in rows])
    inputs = (inputs - inputs.mean(axis=0)) / np.maximum(inputs.std(axis=0), 1e-6)
    physics = np.abs(predicted - truth) / 15
    hybrid = np.zeros_like(physics)
    for left_out in sorted(set(texture)):
        own = texture == left_out
        changes = []
        for seed in range(3):
            network = Network(inputs.shape[1], seed)
            network.train(inputs[~own], predicted[~own], truth[~own], seed, 1e-4)
            changes.append(network.forward(inputs[own])[-1][:, 0])
        changed = predicted[own] * np.exp(np.mean(changes, axis=0))
        hybrid[own] = np.abs(changed - truth[own]) / 15
        print(f"{left_out:24} {own.sum():6} predictions: physics {physics[own].mean():.4f}, hybrid {hybrid[own].mean():.4f}", flush=True)
    for name in sorted(set(water)):
        own = water == name
        print(f"{name:24} {own.sum():6} predictions: physics {physics[own].mean():.4f}, hybrid {hybrid[own].mean():.4f}")
    print(f"all: MAE/15 physics {physics.mean():.4f}, hybrid {hybrid.mean():.4f}")


if __name__ == "__main__":
    main()
