#!/usr/bin/env python3
"""What can a picture from afar tell of contrast from nearer at all?

    python3 tools/nearer_contrast.py [PLACES]

No water, no noise, no curve of a camera: at PLACES places of each of ten targets of `assets/textures` the view from a distance and the one
from 2, 3 and 6 times as far are taken from the texture itself. From what the farther view shows in the part that the nearer one will see
(logarithms of its deviation inside windows of 2 to 32 pixels, as far as there are such windows, of all three channels), and in all of it,
the nearer view's contrast (mean deviation of its 10 x 6 patches, over its mean) is predicted: by the finest octaves going on, as they are or
with SMOOTHING, and by what ridge regression changes in that, having learned from the nine other targets or from other places of the same. Printed are mean absolute errors, percent;
2 % of 15 counts is 0.02 of 15. Needs numpy and pillow.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

TARGETS = [
    "concrete_pier", "coral_rock", "fishing_net", "gravel", "hull_black_fouled", "hull_red", "kelp_sediment", "pipeline_coating",
    "rusted_pile", "seabed",
]
TILE_M = {"hull_red": 6.0, "seabed": 6.0}
OTHER_TILE_M = 3.6
# The default camera: pixels, and focal length in pixels.
WIDTH, HEIGHT, FOCAL_PX = 320, 180, 277.0
NEAR_M = [0.5, 1.0]
RATIOS = [2, 3, 6]
COLUMNS, ROWS = 10, 6
WINDOWS = [2, 4, 8, 16, 32]
FLOOR = 1e-9
FARTHEST_M = 3.5
WEIGHTS = [1, 10, 100, 1000, 10000]
# Twin: SMOOTHING of crates/guidance/src/physics/detail.rs.
SMOOTHING = 0.8


def linear(name):
    path = Path(__file__).parent.parent / "assets" / "textures" / f"{name}.png"
    s = np.asarray(Image.open(path).convert("RGB"), dtype=np.float32) / 255.0
    return np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4)


def view(texture, tile_m, centre_m, pixel_m, width, height):
    """The texture at the middles of pixels, bilinear, tiled."""
    n = texture.shape[0]

    def along(centre, count):
        at = (centre + (np.arange(count) - 0.5 * (count - 1)) * pixel_m) / tile_m * n - 0.5
        first = np.floor(at).astype(int)
        return first % n, (first + 1) % n, (at - first).astype(np.float32)

    x0, x1, fx = along(centre_m[0], width)
    y0, y1, fy = along(centre_m[1], height)
    fx, fy = fx[None, :, None], fy[:, None, None]
    top = texture[y0][:, x0] * (1 - fx) + texture[y0][:, x1] * fx
    low = texture[y1][:, x0] * (1 - fx) + texture[y1][:, x1] * fx
    return top * (1 - fy) + low * fy


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


def samples(name, near_m, ratio, places):
    """Per place and channel: what the farther view tells, its octaves going on as they are and smoother, and the truth (logarithms)."""
    texture, tile_m = linear(name), TILE_M.get(name, OTHER_TILE_M)
    draw = np.random.default_rng([TARGETS.index(name), ratio, int(10 * near_m)])
    told, going_on, expected, truth = [], [], [], []
    for _ in range(places):
        centre_m = draw.uniform(0, tile_m, 2)
        near_px = near_m / FOCAL_PX
        fine = view(texture, tile_m, centre_m, near_px, ratio * WIDTH, ratio * HEIGHT)
        far = blocks(fine, ratio, ratio).mean(axis=(1, 3))
        top, left = (ratio - 1) * HEIGHT // 2, (ratio - 1) * WIDTH // 2
        near = fine[top : top + HEIGHT, left : left + WIDTH]
        top, left = top // ratio, left // ratio
        middle = far[top : top + HEIGHT // ratio, left : left + WIDTH // ratio]
        inner, whole = spectrum(middle), spectrum(far)
        variance = np.exp(inner)
        # What the farther view shows of the nearer one's patches; finer than its pixels the last octave's share goes on.
        seen = patches_of(middle)
        falling = np.clip(variance[0] / np.maximum(variance[1] - variance[0], FLOOR), 0.2, 1.0)
        octaves = np.log2(ratio)
        octaves = [min(1.0, octaves - i) for i in range(int(np.ceil(octaves)))]
        evenly, smoother = (
            variance[0] * sum((share * falling) ** (i + 1) * part for i, part in enumerate(octaves)) for share in (1.0, SMOOTHING)
        )
        for k in range(3):
            told.append(np.concatenate([inner[:, k], whole[:, k], inner.ravel(), np.eye(3)[k]]))
        going_on.extend(0.5 * np.log(seen**2 + evenly))
        expected.extend(0.5 * np.log(seen**2 + smoother))
        truth.extend(np.log(patches_of(near)))
    return np.array(told), np.array(going_on), np.array(expected), np.array(truth)


def ridge(told, truth, asked, weight):
    mean, spread = told.mean(axis=0), told.std(axis=0) + 1e-6
    x = np.column_stack([(told - mean) / spread, np.ones(len(told))])
    fit = np.linalg.solve(x.T @ x + weight * np.eye(x.shape[1]), x.T @ truth)
    return np.column_stack([(asked - mean) / spread, np.ones(len(asked))]) @ fit


def error_pct(found, truth):
    return 100 * np.abs(np.expm1(found - truth)).mean()


def main():
    places = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    print("| near, m | times as far | octaves go on | each with SMOOTHING | learned from nine others | from other places of the same |")
    print("|---|---|---|---|---|---|")
    for near_m in NEAR_M:
        for ratio in RATIOS:
            if near_m * ratio > FARTHEST_M:
                continue
            rows = [samples(name, near_m, ratio, places) for name in TARGETS]
            going_on, smoother, others, same = [], [], [], []
            for i, (told, evenly, expected, truth) in enumerate(rows):
                rest = [row for j, row in enumerate(rows) if j != i]
                x, base, y = (np.concatenate([row[part] for row in rest]) for part in (0, 2, 3))
                going_on.append(error_pct(evenly, truth))
                smoother.append(error_pct(expected, truth))
                others.append([error_pct(expected + ridge(x, y - base, told, weight), truth) for weight in WEIGHTS])
                half = len(truth) // 2
                learned = [ridge(told[:half], (truth - expected)[:half], told[half:], weight) for weight in WEIGHTS]
                same.append([error_pct(expected[half:] + change, truth[half:]) for change in learned])
            # The weights that are best for the targets that are predicted: kinder to learning than can be had.
            best = [np.array(errors).mean(axis=0).min() for errors in (others, same)]
            print(f"| {near_m} | {ratio} | {np.mean(going_on):.1f} | {np.mean(smoother):.1f} | {best[0]:.1f} | {best[1]:.1f} |", flush=True)


if __name__ == "__main__":
    main()
