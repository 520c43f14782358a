"""Prints the colour error of reflectances that are mixed of sRGB, against the measured ones of a ColorChecker, in water.

For each Jerlov type and distance: a camera (canon5d2) and an LED lamp (LED-B4) both at the distance from a patch, nothing
scattered. The error of a channel is its difference from the measured patch by what a white patch shows there: root mean square
over 24 patches and three channels, and the largest. Two ways of making a spectrum of an sRGB colour: the mixture that the renderer uses
(assets/spectra/rgb_primaries.csv), and the smooth sigmoid of Jakob and Hanika 2019 (A low-dimensional function space for
efficient spectral upsampling), fitted to each patch. Needs numpy and scipy.
"""

import numpy as np
from scipy.optimize import least_squares

from rgb_primaries import PRIMARIES_XY, ROOT, observer

NM = np.arange(400.0, 701.0, 5.0)
DISTANCES_M = (0.0, 2.0, 5.0)


def table(path):
    lines = [line for line in (ROOT / "assets" / path).read_text().splitlines() if not line.startswith("#")]
    names = lines[0].split(",")
    return names, [line.split(",") for line in lines[1:]]


def columns(path):
    names, rows = table(path)
    values = np.array([[float(cell) for cell in row] for row in rows])
    return {name: np.interp(NM, values[:, 0], values[:, i]) for i, name in enumerate(names) if i > 0}


def waters():
    _, rows = table("water/jerlov_iop_10nm.csv")
    found = {}
    for kind, nm, _, _, c in rows:
        found.setdefault(kind, []).append((float(nm), float(c)))
    return {kind: np.interp(NM, *np.array(nodes).T) for kind, nodes in found.items()}


def to_srgb(reflectance, daylight):
    weights = observer(NM) * daylight
    weights /= weights[1].sum()
    xyz = np.stack([PRIMARIES_XY[:, 0] / PRIMARIES_XY[:, 1], np.ones(3), (1 - PRIMARIES_XY.sum(axis=1)) / PRIMARIES_XY[:, 1]])
    to_xyz = xyz * np.linalg.solve(xyz, weights.sum(axis=1))
    return np.linalg.solve(to_xyz, weights @ reflectance)


def sigmoid(coefficients):
    x = np.polyval(coefficients, (NM - 550.0) / 150.0)
    return 0.5 + 0.5 * x / np.sqrt(1 + x * x)


def main():
    lights = columns("spectra/lamp_spectra.csv")
    patches = columns("spectra/colorchecker_reflectances.csv")
    primaries = np.stack([columns("spectra/rgb_primaries.csv")[name] for name in "rgb"])
    camera = columns("water/camera_responses.csv")
    response = np.stack([camera[f"canon5d2_{channel}"] for channel in "rgb"])
    mixed, smooth = {}, {}
    for name, measured in patches.items():
        srgb = np.clip(to_srgb(measured, lights["D65"]), 0.0, 1.0)
        mixed[name] = srgb @ primaries
        fit = least_squares(lambda c: to_srgb(sigmoid(c), lights["D65"]) - srgb, [0.0, 0.0, 0.0])
        smooth[name] = sigmoid(fit.x)
    print("| water | " + " | ".join(f"{d:.0f} m, mixture | {d:.0f} m, sigmoid" for d in DISTANCES_M) + " |")
    print("|---" * (1 + 2 * len(DISTANCES_M)) + "|")
    for kind, c in waters().items():
        cells = []
        for distance in DISTANCES_M:
            seen = response * lights["LED-B4"] * np.exp(-2 * distance * c)
            white = seen.sum(axis=1)
            for spectra in (mixed, smooth):
                errors = np.array([(seen @ (spectra[name] - patches[name])) / white for name in patches])
                cells.append(f"{np.sqrt((errors**2).mean()):.3f} ({np.abs(errors).max():.2f})")
        print(f"| {kind} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
