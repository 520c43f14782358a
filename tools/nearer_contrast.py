#!/usr/bin/env python3
"""What can a picture from afar tell of contrast from nearer at all?

    python3 tools/nearer_contrast.py [--width 1280] [--smoothing 1 0.9 0.8 0.7]

No water, no noise, no curve of a camera: at some places of each of ten targets of `assets/textures` the view from a distance and the one
from 2, 3 and 6 times as far are taken from the texture itself. From what the farther view shows in the part that the nearer one will see
(logarithms of its deviation inside windows of 2 to 64 pixels, as far as there are such windows, of all three channels), and in all of it,
the nearer view's contrast (mean deviation of its 10 x 6 patches, over its mean) is predicted: by the finest octaves going on, each holding
so much of what the last two say (SMOOTHING of crates/guidance/src/physics/scales.rs), and by what ridge regression changes in the last of these, having
learned from the other targets or from other places of the same. Printed are mean absolute errors, percent (in brackets by how much too
high on average); 2 % of 15 counts is 0.02 of 15. Needs numpy and pillow.
"""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image

TARGETS = [
    "concrete_pier", "coral_rock", "fishing_net", "gravel", "hull_black_fouled", "hull_red", "kelp_sediment", "pipeline_coating",
    "rusted_pile", "seabed",
]
TILE_M = {"hull_red": 6.0, "seabed": 6.0}
OTHER_TILE_M = 3.6
# Field of view of the default camera, and proportions of its pictures.
HFOV_DEG, ASPECT = 60.0, 9 / 16
NEAR_M = [0.5, 1.0]
RATIOS = [2, 3, 6]
COLUMNS, ROWS = 10, 6
WINDOWS = [2, 4, 8, 16, 32, 64]
FLOOR = 1e-9
FARTHEST_M = 3.5
WEIGHTS = [1, 10, 100, 1000, 10000]


def linear(folder, name):
    s = np.asarray(Image.open(folder / f"{name}.png").convert("RGB"), dtype=np.float32) / 255.0
    return np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4)


def view(texture, tile_m, centre_m, ratio, near_px, width, height):
    """What pixels of `ratio` x `ratio` points a side see; between texels bilinear, tiled."""
    n = texture.shape[0]

    def along(centre, count):
        """Which texels the pixels of a row or a column see, and by how much."""
        points = count * ratio
        at = (centre + (np.arange(points) - 0.5 * (points - 1)) * near_px) / tile_m * n - 0.5
        first = np.floor(at).astype(int)
        share = (at - first) / ratio
        pixel = np.arange(points) // ratio
        weights = np.zeros((count, n), dtype=np.float32)
        np.add.at(weights, (pixel, first % n), 1 / ratio - share)
        np.add.at(weights, (pixel, (first + 1) % n), share)
        return weights

    rows, columns = along(centre_m[1], height), along(centre_m[0], width)
    return np.stack([rows @ texture[:, :, k] @ columns.T for k in range(3)], axis=-1)


def blocks(picture, height, width):
    """The picture in blocks, whole ones only."""
    rows, columns = picture.shape[0] // height, picture.shape[1] // width
    return picture[: rows * height, : columns * width].reshape(rows, height, columns, width, 3)


def patches_of(picture):
    """Contrast: the mean deviation inside 10 x 6 patches, over the mean."""
    patches = blocks(picture, picture.shape[0] // ROWS, picture.shape[1] // COLUMNS)
    return patches.std(axis=(1, 3)).mean(axis=(0, 1)) / picture.mean(axis=(0, 1))


def spectrum(picture):
    """Logarithm of the variance inside windows over the squared mean, per channel; windows that do not fit have what the last had."""
    told = []
    for window in WINDOWS:
        if min(picture.shape[:2]) >= window:
            told.append(np.log(blocks(picture, window, window).var(axis=(1, 3)).mean(axis=(0, 1)) / picture.mean(axis=(0, 1)) ** 2 + FLOOR))
        else:
            told.append(told[-1])
    return np.array(told)


def samples(asked, name, near_m, ratio):
    """Per place and channel: what the farther view tells, its octaves going on with each smoothing, and the truth (logarithms)."""
    texture, tile_m = linear(asked.textures, name), TILE_M.get(name, OTHER_TILE_M)
    width, height = asked.width, round(asked.width * ASPECT)
    near_px = near_m * 2 * np.tan(np.radians(HFOV_DEG / 2)) / width
    draw = np.random.default_rng([*name.encode(), ratio, int(10 * near_m)])
    told, expected, truth = [], [], []
    for _ in range(asked.places):
        centre_m = draw.uniform(0, tile_m, 2)
        far = view(texture, tile_m, centre_m, ratio, near_px, width, height)
        top, left = (ratio - 1) * height // 2 // ratio, (ratio - 1) * width // 2 // ratio
        middle = far[top : top + height // ratio, left : left + width // ratio]
        near = view(texture, tile_m, centre_m, 1, near_px, width, height)
        inner, whole = spectrum(middle), spectrum(far)
        variance = np.exp(inner)
        # What the farther view shows of the nearer one's patches; finer than its pixels the last octave's share goes on.
        seen = patches_of(middle)
        falling = np.clip(variance[0] / np.maximum(variance[1] - variance[0], FLOOR), 0.2, 1.0)
        octaves = [min(1.0, np.log2(ratio) - i) for i in range(int(np.ceil(np.log2(ratio))))]
        finer = [variance[0] * sum((own * falling) ** (i + 1) * part for i, part in enumerate(octaves)) for own in asked.smoothing]
        for k in range(3):
            told.append(np.concatenate([inner[:, k], whole[:, k], inner.ravel(), np.eye(3)[k]]))
        expected.append(0.5 * np.log(seen**2 + np.array(finer)))
        truth.extend(np.log(patches_of(near)))
    return np.array(told), np.concatenate(expected, axis=1), np.array(truth)


def ridge(told, truth, asked, weight):
    mean, spread = told.mean(axis=0), told.std(axis=0) + 1e-6
    x = np.column_stack([(told - mean) / spread, np.ones(len(told))])
    fit = np.linalg.solve(x.T @ x + weight * np.eye(x.shape[1]), x.T @ truth)
    return np.column_stack([(asked - mean) / spread, np.ones(len(asked))]) @ fit


def error_pct(found, truth):
    return 100 * np.abs(np.expm1(found - truth)).mean()


def row(asked, near_m, ratio):
    found = [samples(asked, name, near_m, ratio) for name in asked.targets]
    rules = [np.concatenate([np.expm1(own[1][i] - own[2]) for own in found]) for i in range(len(asked.smoothing))]
    cells = [f"{100 * np.abs(off).mean():.1f} ({100 * off.mean():+.1f})" for off in rules]
    others, same = [], []
    for i, (told, rule, truth) in enumerate(found):
        half = len(truth) // 2
        learned = [ridge(told[:half], (truth - rule[-1])[:half], told[half:], weight) for weight in WEIGHTS]
        same.append([error_pct(rule[-1][half:] + change, truth[half:]) for change in learned])
        rest = [own for j, own in enumerate(found) if j != i]
        if rest:
            x, y = np.concatenate([own[0] for own in rest]), np.concatenate([own[2] - own[1][-1] for own in rest])
            others.append([error_pct(rule[-1] + ridge(x, y, told, weight), truth) for weight in WEIGHTS])
    # The weights that are best for the targets that are predicted: kinder to learning than can be had.
    cells += [f"{np.array(errors).mean(axis=0).min():.1f}" if errors else "" for errors in (others, same)]
    return f"| {near_m} | {ratio} | " + " | ".join(cells) + " |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--places", type=int, default=24, help="of each target")
    parser.add_argument("--width", type=int, default=1280, help="of a picture, pixels")
    parser.add_argument("--smoothing", type=float, nargs="+", default=[1.0, 0.8], help="what a finer octave holds over what the last two say")
    parser.add_argument("--targets", nargs="+", default=TARGETS)
    parser.add_argument("--textures", type=Path, default=Path(__file__).parent.parent / "assets" / "textures")
    asked = parser.parse_args()
    print("| near, m | times as far |", *(f"{own} (mean) |" for own in asked.smoothing), "learned from the other targets | from other places of the same |")
    print("|---" * (4 + len(asked.smoothing)) + "|")
    for near_m in NEAR_M:
        for ratio in RATIOS:
            if near_m * ratio <= FARTHEST_M:
                print(row(asked, near_m, ratio), flush=True)


if __name__ == "__main__":
    main()
