"""Writes assets/spectra/rgb_primaries.csv: three smooth reflectances that linear sRGB mixes.

r + g + b = 1 at every wavelength and none is negative, so that every mixture of numbers in [0, 1] reflects between none and
all of the light, and grey is the same at every wavelength. Under daylight (D65) each has the colour of its primary. Of all
such spectra these are the smoothest: the sum of the squares of their steps is least. The idea is that of Mallett and Yuksel
2019 (Spectral primary decomposition for rendering with sRGB reflectance, EGSR); the numbers are this script's own.
Observer: the fit of Wyman, Sloan and Shirley 2013 (JCGT 2(2)) to CIE 1931. Needs numpy and scipy.
"""

import pathlib

import numpy as np
from scipy.optimize import minimize

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
WAVELENGTHS_NM = np.arange(380.0, 781.0, 10.0)
# Chromaticities of the primaries, IEC 61966-2-1.
PRIMARIES_XY = np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]])


def lobe(nm, centre, below, above):
    width = np.where(nm < centre, below, above)
    return np.exp(-0.5 * ((nm - centre) / width) ** 2)


def observer(nm):
    x = 1.056 * lobe(nm, 599.8, 37.9, 31.0) + 0.362 * lobe(nm, 442.0, 16.0, 26.7) - 0.065 * lobe(nm, 501.1, 20.4, 26.2)
    y = 0.821 * lobe(nm, 568.8, 46.9, 40.5) + 0.286 * lobe(nm, 530.9, 16.3, 31.1)
    z = 1.217 * lobe(nm, 437.0, 11.8, 36.0) + 0.681 * lobe(nm, 459.0, 26.0, 13.8)
    return np.stack([x, y, z])


def daylight(nm):
    lines = [l for l in (ROOT / "assets/spectra/lamp_spectra.csv").read_text().splitlines() if not l.startswith("#")]
    names = lines[0].split(",")
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    return np.interp(nm, table[:, 0], table[:, names.index("D65")])


def solve():
    weights = observer(WAVELENGTHS_NM) * daylight(WAVELENGTHS_NM)
    weights /= weights[1].sum()
    white = weights.sum(axis=1)
    xyz = np.stack([PRIMARIES_XY[:, 0] / PRIMARIES_XY[:, 1], np.ones(3), (1 - PRIMARIES_XY.sum(axis=1)) / PRIMARIES_XY[:, 1]])
    to_xyz = xyz * np.linalg.solve(xyz, white)
    n = len(WAVELENGTHS_NM)

    def roughness(v):
        steps = np.diff(v.reshape(3, n), axis=1)
        gradient = np.zeros((3, n))
        gradient[:, 1:] += 2 * steps
        gradient[:, :-1] -= 2 * steps
        return (steps**2).sum(), gradient.ravel()

    # Blue follows from the two others, so that only their colours are asked for.
    equal = np.zeros((n + 6, 3 * n))
    goal = np.ones(n + 6)
    for i in range(n):
        equal[i, [i, n + i, 2 * n + i]] = 1.0
    for k in range(2):
        equal[n + 3 * k : n + 3 * k + 3, k * n : (k + 1) * n] = weights
        goal[n + 3 * k : n + 3 * k + 3] = to_xyz[:, k]
    start = np.full(3 * n, 1.0 / 3.0)
    found = minimize(
        roughness,
        start,
        jac=True,
        method="SLSQP",
        bounds=[(0.0, 1.0)] * (3 * n),
        constraints={"type": "eq", "fun": lambda v: equal @ v - goal, "jac": lambda v: equal},
        options={"maxiter": 2000, "ftol": 1e-12},
    )
    assert found.success, found.message
    spectra = np.clip(found.x.reshape(3, n), 0.0, 1.0)
    print("largest error of a colour", np.abs(weights @ spectra.T - to_xyz).max())
    return spectra


def main():
    spectra = solve()
    lines = [
        "# Reflectances that linear sRGB mixes, 380-780 nm, 10 nm: smoothest non-negative spectra that add up to 1 and have the",
        "# colours of the primaries under D65. Written by tools/spectra/rgb_primaries.py.",
        "wavelength_nm,r,g,b",
    ]
    for i, nm in enumerate(WAVELENGTHS_NM):
        r, g = (round(float(spectra[k, i]), 5) for k in range(2))
        lines.append(f"{nm:.0f},{r:.5f},{g:.5f},{abs(1 - r - g):.5f}")
    (ROOT / "assets/spectra/rgb_primaries.csv").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
