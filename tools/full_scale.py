#!/usr/bin/env python3
"""How well is known what pixels at full scale would show?

    python3 tools/full_scale.py

No water, no noise: pictures of ten targets of `assets/textures` from 1 m (480 x 270 pixels, 60 degrees), lit evenly and by a beam, so bright that
a given share of the pixels is at full scale. The pixels that are cut off are filled in as crates/guidance/src/physics/full_scale.rs does (exponential), with
a normal distribution in its place, or left. Printed is by how many percent the contrast that follows for half and a quarter of the light is off:
mean, root mean square and largest over targets, channels and both lights. Needs numpy and pillow.
"""

from pathlib import Path
from statistics import NormalDist

import numpy as np

from nearer_contrast import OTHER_TILE_M, TARGETS, TILE_M, linear, view
from patch_quantiles import COLUMNS, ROWS, counts, patches

WIDTH, HEIGHT = 480, 270
SHARES = [0.01, 0.03, 0.1, 0.2]
LIGHT = [0.5, 0.25]
RADII_PX = [1, 4, 13]
WAYS = {
    "left": None,
    "normal": np.vectorize(lambda share: NormalDist().inv_cdf(1 - share)),
    "exponential": lambda share: -np.log(share),
}


def neighbours(full):
    """Shares of each pixel's neighbourhoods that are at full scale, summed."""
    sums = np.pad(np.cumsum(np.cumsum(full, axis=0), axis=1), ((1, 0), (1, 0)))
    y, x = np.mgrid[0 : full.shape[0], 0 : full.shape[1]]
    total = np.zeros(full.shape)
    for radius in RADII_PX:
        top, bottom = np.maximum(y - radius, 0), np.minimum(y + radius + 1, full.shape[0])
        left, right = np.maximum(x - radius, 0), np.minimum(x + radius + 1, full.shape[1])
        inside = sums[bottom, right] + sums[top, left] - sums[bottom, left] - sums[top, right]
        total += inside / ((bottom - top) * (right - left))
    return total


def filled_in(signal, tail):
    """A signal cut off at 1, with values that it may have had; `tail` tells by how many scales a share's least value is above the middle."""
    found, full = signal.copy(), signal >= 1
    depth = neighbours(full)
    cells, scales = [], []
    for i in range(ROWS * COLUMNS):
        row, column = i // COLUMNS, i % COLUMNS
        cell = np.s_[row * HEIGHT // ROWS : (row + 1) * HEIGHT // ROWS, column * WIDTH // COLUMNS : (column + 1) * WIDTH // COLUMNS]
        share = full[cell].mean()
        if share == 0:
            continue
        scale = None
        if share <= 0.5:
            telling = np.clip(3 * share, 0.2, 0.75)
            least = np.quantile(signal[cell], 1 - telling)
            scale = (1 - least) / (tail(share) - tail(telling))
            scales.append(scale)
        cells.append((cell, min(share, 0.5), scale))
    for cell, share, scale in cells:
        own = full[cell]
        rank = np.empty(own.sum())
        rank[np.argsort(depth[cell][own], kind="stable")] = (np.arange(rank.size) + 0.5) / rank.size
        scale = np.mean(scales or [0]) if scale is None else scale
        found[cell][own] = 1 + scale * (tail(share * (1 - rank)) - tail(share))
    return found


def contrast(signal):
    return counts(patches(signal)).std(axis=1).mean()


def main():
    folder = Path(__file__).parent.parent / "assets" / "textures"
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    beam = np.exp(-(((x - WIDTH / 2) / (0.45 * WIDTH)) ** 2) - ((y - HEIGHT / 2) / (0.6 * HEIGHT)) ** 2)
    off = {}
    for name in TARGETS:
        texture, tile_m = linear(folder, name), TILE_M.get(name, OTHER_TILE_M)
        whole = view(texture, tile_m, [0, 0], 1, 2 * np.tan(np.radians(30)) / WIDTH, WIDTH, HEIGHT)
        for light in (1, beam):
            for k in range(3):
                for share in SHARES:
                    truth = whole[:, :, k] * light
                    truth = truth / np.quantile(truth, 1 - share)
                    for way, tail in WAYS.items():
                        cut = np.minimum(truth, 1)
                        found = cut if tail is None else filled_in(cut, tail)
                        for less in LIGHT:
                            error = 100 * (contrast(less * found) / contrast(less * truth) - 1)
                            off.setdefault((share, less, way), []).append(error)
    print("| at full scale | light | " + " | ".join(WAYS) + " |")
    print("|---" * (2 + len(WAYS)) + "|")
    for share in SHARES:
        for less in LIGHT:
            all_ways = [np.array(off[share, less, way]) for way in WAYS]
            cells = [f"{e.mean():+.1f}, {np.sqrt((e**2).mean()):.1f}, {abs(e).max():.0f}" for e in all_ways]
            print(f"| {100 * share:.0f} % | {less} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
