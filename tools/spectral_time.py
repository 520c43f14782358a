"""Time to equal error by wavelength over that in three bands, on shipped scenes.

Each scene is rendered with `water.bands = "mean"` and "spectral", alternating, with several seeds. The time to a relative
mean squared error E is (seconds per sample) x (relative error^2 x samples) / E, with the program's own estimate of its
error; it is the same multiple for every E that takes more samples than a render has here.

python3 tools/spectral_time.py [--uw target/release/uw] [--backend cpu-simd] [--samples 16] [--seeds 8] SCENE.toml ..
"""

import argparse
import json
import pathlib
import subprocess
import tempfile


def render(args, scene, bands, seed, folder):
    command = [args.uw, "render", "--json", scene, "--set", f"water.bands={bands}", "--output", f"{folder}/o.exr"]
    command += ["--spp", str(args.samples), "--width", "160", "--backend", args.backend, "--seed", str(seed)]
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    found = json.loads(told)
    return found["relative_error"] ** 2 * args.samples, found["render_s"] / args.samples


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="+", help="scenes with a Jerlov type")
    parser.add_argument("--uw", default="target/release/uw", help="the program")
    parser.add_argument("--backend", default="cpu-simd", help="as of `uw render`")
    parser.add_argument("--samples", type=int, default=16, help="samples per pixel")
    parser.add_argument("--seeds", type=int, default=8, help="renders of each kind")
    args = parser.parse_args()
    print("| scene | mean: s to 1e-2, 1e-3 | spectral | samples | time per sample | time |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for scene in args.scenes:
            sums = {"mean": [0.0, 0.0], "spectral": [0.0, 0.0]}
            for seed in range(args.seeds):
                for bands, total in sums.items():
                    error, seconds = render(args, scene, bands, seed, folder)
                    total[0] += error / args.seeds
                    total[1] += seconds / args.seeds
            to = {bands: [e * s / level for level in (1e-2, 1e-3)] for bands, (e, s) in sums.items()}
            samples, per_sample = (sums["spectral"][i] / sums["mean"][i] for i in (0, 1))
            seconds = {bands: ", ".join(f"{t:.3g}" for t in times) for bands, times in to.items()}
            name = pathlib.Path(scene).stem
            print(
                f"| {name} | {seconds['mean']} | {seconds['spectral']} | {samples:.2f} | {per_sample:.2f} "
                f"| {samples * per_sample:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
