"""Error against processor time of Mitsuba on scenes of `assets/benchmarks`, as rows of `peers.csv`.

    pip install mitsuba==3.9.1 numpy OpenEXR
    apt-get install libllvm19
    python tools/peers/mitsuba_time.py --uw target/release/uw --spp 4,16,64 s1_clear s1d_clear_disk s2_turbid s2d_turbid_disk

The scenes are built from their scene files: water, camera, one lamp, one plane. Rendered with `llvm_ad_rgb` and
`volpathmis`; the Fournier-Forand phase function is a Python class over tables that `uw phase` makes. A first render of one
sample compiles the kernels and is not counted. Mitsuba's threads are those of the process: use `taskset -c 0` for one.
"""

import argparse
import os
import subprocess
import time
import tomllib

import numpy as np
from stored_references import BENCHMARKS, reference, rel_mse

os.environ.setdefault("DRJIT_LIBLLVM_PATH", "/usr/lib/x86_64-linux-gnu/libLLVM-19.so")
import drjit as dr  # noqa: E402  (the library's path must be known first)
import mitsuba as mi  # noqa: E402

mi.set_variant("llvm_ad_rgb")

ENTRIES = 1 << 14
LN_LEAST = np.log(1e-18)


def phase_tables(uw, phase):
    """Phase function over ln sin²(θ/2), and ln sin²(θ/2) over the share of light scattered by less, both from `uw phase`."""
    model = ["--model", "fournier-forand", "--n", str(phase["n"])]
    model += ["--backscatter-fraction", str(phase["backscatter_fraction"])]

    def ask(option, numbers):
        text = "\n".join(repr(float(x)) for x in numbers)
        found = subprocess.run([uw, "phase", *model, option, "-"], input=text, capture_output=True, text=True, check=True)
        return np.array([[float(x) for x in line.split(",")] for line in found.stdout.splitlines()[1:]])

    x = np.exp(np.linspace(LN_LEAST, 0.0, ENTRIES))
    value = ask("--angles-deg", np.degrees(2 * np.arcsin(np.sqrt(x))))[:, 1]
    # Evenly in ln(u / (1 - u)), which resolves both ends.
    u = 1 / (1 + np.exp(-np.linspace(-20, 20, ENTRIES)))
    half = np.radians(ask("--inverse-cdf", u)[:, 1]) / 2
    return np.log(value), np.log(np.maximum(np.sin(half) ** 2, np.exp(LN_LEAST)))


class Tabulated(mi.PhaseFunction):
    """A phase function that lives in two tables of the class."""

    tables = None

    def __init__(self, props):
        super().__init__(props)
        self.ln_value, self.ln_x = (mi.Float(t) for t in Tabulated.tables)
        self.m_flags = mi.PhaseFunctionFlags.Anisotropic

    @staticmethod
    def look_up(table, position):
        i = mi.UInt32(dr.clip(position, 0, ENTRIES - 2))
        low, high = dr.gather(mi.Float, table, i), dr.gather(mi.Float, table, i + 1)
        return dr.lerp(low, high, position - mi.Float(i))

    def value(self, x):
        position = (dr.log(dr.maximum(x, np.exp(LN_LEAST))) - LN_LEAST) / -LN_LEAST * (ENTRIES - 1)
        return dr.exp(Tabulated.look_up(self.ln_value, position))

    def sample(self, ctx, mei, sample1, sample2, active):
        u = dr.clip(sample2.x, 1e-7, 1 - 1e-7)
        position = (dr.log(u / (1 - u)) + 20) / 40 * (ENTRIES - 1)
        x = dr.exp(Tabulated.look_up(self.ln_x, position))
        sine = 2 * dr.sqrt(x * (1 - x))
        azimuth = 2 * np.pi * sample2.y
        # Incident directions point back along the ray.
        wo = mei.to_world(mi.Vector3f(sine * dr.cos(azimuth), sine * dr.sin(azimuth), -(1 - 2 * x)))
        pdf = self.value(x)
        return wo, mi.Spectrum(1.0), pdf

    def eval_pdf(self, ctx, mei, wo, active):
        # sin²(θ/2) is a quarter of the squared distance of the two directions, which keeps its digits at small angles.
        x = 0.25 * dr.squared_norm(wo + mei.wi)
        pdf = self.value(x)
        return mi.Spectrum(pdf), pdf

    def to_string(self):
        return "Tabulated[]"


mi.register_phase("tabulated", Tabulated)


def build(scene):
    """The content of a scene file as a Mitsuba scene."""
    water, camera, lamp, target = scene["water"], scene["camera"], scene["lamp"][0], scene["object"][0]
    c = [a + b for a, b in zip(water["a"], water["b"])]
    medium = {
        "type": "homogeneous",
        "sigma_t": {"type": "rgb", "value": [x / max(c) for x in c]},
        "albedo": {"type": "rgb", "value": [b / x for b, x in zip(water["b"], c)]},
        "scale": max(c),
        "phase": {"type": "tabulated"},
    }
    T, position = mi.ScalarTransform4f, lamp["position_m"]
    at_lamp = T().look_at(origin=position, target=np.add(position, [1, 0, 0]).tolist(), up=[0, 0, 1])
    intensity = {"type": "rgb", "value": lamp["intensity"]}
    if lamp["radius_m"] == 0.0:
        half = lamp["half_angle_deg"]
        light = {"type": "spot", "to_world": at_lamp, "intensity": intensity, "cutoff_angle": half, "beam_width": half}
        light["medium"] = {"type": "ref", "id": "water"}
    else:
        radiance = [i / (np.pi * lamp["radius_m"] ** 2) for i in lamp["intensity"]]
        light = {
            "type": "disk",
            "to_world": at_lamp @ T().scale(lamp["radius_m"]),
            "bsdf": {"type": "diffuse", "reflectance": 0.0},
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": radiance}},
            "exterior": {"type": "ref", "id": "water"},
        }
    plane = target["plane"]
    tiles = plane["size_m"][0] / target["reflectance"]["tile_m"][0]
    x = plane["center_m"][0]
    texture = {
        "type": "bitmap",
        "filename": str(BENCHMARKS / target["reflectance"]["texture"]),
        "raw": True,
        "filter_type": "nearest",
        "to_uv": T().scale([tiles, -tiles, 1]),
    }
    wall = {
        "type": "rectangle",
        "to_world": T().look_at(origin=[x, 0, 0], target=[0, 0, 0], up=[0, 0, 1]) @ T().scale(plane["size_m"][0] / 2),
        "bsdf": {"type": "diffuse", "reflectance": texture},
        "exterior": {"type": "ref", "id": "water"},
    }
    return mi.load_dict(
        {
            "type": "scene",
            "water": medium | {"id": "water"},
            "integrator": {"type": "volpathmis", "max_depth": 128, "rr_depth": 128},
            "sea": {
                "type": "sphere",
                "radius": 60.0,
                "bsdf": {"type": "null"},
                "interior": {"type": "ref", "id": "water"},
            },
            "sensor": {
                "type": "perspective",
                "fov": camera["hfov_deg"],
                "fov_axis": "x",
                "to_world": T().look_at(origin=[0, 0, 0], target=[1, 0, 0], up=[0, 0, 1]),
                "medium": {"type": "ref", "id": "water"},
                "film": {
                    "type": "hdrfilm",
                    "width": camera["width"],
                    "height": camera["height"],
                    "rfilter": {"type": "box"},
                    "pixel_format": "rgb",
                },
                "sampler": {"type": "independent"},
            },
            "light": light,
            "wall": wall,
        }
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--uw", default="target/release/uw")
    parser.add_argument("--spp", default="4,16,64")
    parser.add_argument("--save", help="folder for the pictures, as .npy")
    args = parser.parse_args()
    print("renderer,scene,spp,cpu_s,rel_mse")
    for name in args.scenes:
        scene_file = tomllib.loads((BENCHMARKS / f"{name}.toml").read_text())
        Tabulated.tables = phase_tables(args.uw, scene_file["water"]["phase"])
        scene = build(scene_file)
        np.array(mi.render(scene, spp=1, seed=1))
        ref = reference(name)
        for spp in map(int, args.spp.split(",")):
            before = time.process_time()
            picture = np.array(mi.render(scene, spp=spp, seed=100 + spp))
            seconds = time.process_time() - before
            error = rel_mse(picture, ref)
            print(f"Mitsuba {mi.__version__},{name},{spp},{seconds:.2f},{error:.4g}", flush=True)
            if args.save:
                np.save(f"{args.save}/{name}_{spp}.npy", picture)


if __name__ == "__main__":
    main()
