#!/usr/bin/env python3
"""How well do few values stand for those of a patch where an encoding bends them and full scale cuts them off?

    python3 tools/patch_quantiles.py

No water, no noise: pictures of ten targets of `assets/textures` from 0.5 m, as dark and as bright as daylight and lamps make them (mean
counts), through sRGB. Printed is contrast (mean deviation of the counts inside 10 x 6 patches) over the true one when each patch is replaced
by its mean, its deviation and quantiles: seven of equal shares for all patches together, seven of equal shares of its own, and nine of its
own with little in the outermost (SHARES of crates/guidance/src/physics/shape.rs), in brackets with those of the same part seen from 3 m.
Needs numpy and pillow.
"""

import numpy as np

from nearer_contrast import OTHER_TILE_M, TARGETS, TILE_M, linear, view
from pathlib import Path

EQUAL = np.full(7, 1 / 7)
SHARES = np.array([0.01, 0.04, 0.12, 0.2, 0.26, 0.2, 0.12, 0.04, 0.01])
MEAN_COUNTS = [90, 164]
NEAR_M, RATIO, WIDTH, HEIGHT = 0.5, 6, 1280, 720
COLUMNS, ROWS = 10, 6


def counts(signal):
    s = np.clip(signal, 0, 1)
    return 255 * np.where(s <= 0.0031308, 12.92 * s, 1.055 * np.maximum(s, 1e-9) ** (1 / 2.4) - 0.055)


def patches(channel):
    """A row of values for each patch."""
    height, width = channel.shape[0] // ROWS, channel.shape[1] // COLUMNS
    whole = channel[: ROWS * height, : COLUMNS * width].reshape(ROWS, height, COLUMNS, width)
    return whole.transpose(0, 2, 1, 3).reshape(ROWS * COLUMNS, -1)


def quantiles(rows, shares):
    """Means of shares of the sorted values of each row, mean 0, mean square 1."""
    n = rows.shape[1]
    sums = np.concatenate([np.zeros((len(rows), 1)), np.cumsum(np.sort(rows, axis=1), axis=1)], axis=1)
    ends = np.minimum(np.concatenate([[0], np.cumsum(shares)]) * n, n)
    parts = np.diff([np.interp(ends, np.arange(n + 1), own) for own in sums], axis=1) / np.diff(ends)
    parts = parts - (shares * parts).sum(axis=1, keepdims=True)
    return parts / np.maximum(np.sqrt((shares * parts**2).sum(axis=1, keepdims=True)), 1e-12)


def contrast(rows, parts, shares, gain):
    """Mean over patches of the deviation of the counts, each patch having the mean and deviation of its row and such quantiles."""
    values = counts(gain * (rows.mean(axis=1, keepdims=True) + rows.std(axis=1, keepdims=True) * parts))
    mean = (shares * values).sum(axis=1)
    return np.sqrt(np.maximum((shares * values**2).sum(axis=1) - mean**2, 0)).mean()


def main():
    folder = Path(__file__).parent.parent / "assets" / "textures"
    print("| target | channel | mean, counts | at full scale | one list of seven | seven of each patch | nine of each (from 3 m) |")
    print("|---" * 7 + "|")
    for name in TARGETS:
        texture, tile_m = linear(folder, name), TILE_M.get(name, OTHER_TILE_M)
        pixel_m = NEAR_M * 2 * np.tan(np.radians(30)) / WIDTH
        near = view(texture, tile_m, [0, 0], 1, pixel_m, WIDTH, HEIGHT)
        far = view(texture, tile_m, [0, 0], RATIO, pixel_m, WIDTH, HEIGHT)
        top, left = (HEIGHT - HEIGHT // RATIO) // 2, (WIDTH - WIDTH // RATIO) // 2
        middle = far[top : top + HEIGHT // RATIO, left : left + WIDTH // RATIO]
        for k in range(3):
            own, seen = patches(near[:, :, k]), patches(middle[:, :, k])
            alike = (own - own.mean(axis=1, keepdims=True)) / np.maximum(own.std(axis=1, keepdims=True), 1e-12)
            for mean in MEAN_COUNTS:
                gain = ((mean / 255 + 0.055) / 1.055) ** 2.4 / own.mean()
                truth = counts(gain * own).std(axis=1).mean()
                pooled = contrast(own, quantiles(alike.reshape(1, -1), EQUAL), EQUAL, gain) / truth
                equal = contrast(own, quantiles(own, EQUAL), EQUAL, gain) / truth
                nine, from_afar = (contrast(own, quantiles(rows, SHARES), SHARES, gain) / truth for rows in (own, seen))
                full = 100 * (gain * own > 1).mean()
                print(f"| {name} | {k} | {mean} | {full:.1f} % | {pooled:.3f} | {equal:.3f} | {nine:.3f} ({from_afar:.3f}) |", flush=True)


if __name__ == "__main__":
    main()
