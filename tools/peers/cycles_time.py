"""Error against processor time of Cycles on scenes of `assets/benchmarks`, as rows of `peers.csv`.

    pip install "bpy==4.5.*" numpy OpenEXR                     # Python 3.11
    apt-get install libxrender1 libxi6 libxkbcommon0 libsm6 libgl1 libegl1 libxxf86vm1 libxfixes3
    python tools/peers/cycles_time.py --spp 16,64 s1_clear s1d_clear_disk s2_turbid s2d_turbid_disk s3_sun

The scenes are built from their scene files: water, camera, one lamp before one plane, or the sun over an index-matched surface. Water is a
Volume Coefficients node with the Fournier-Forand phase function in a box of 60 m; nothing is clamped, no light is left
out, 128 bounces, no adaptive sampling. One thread. A first render of one sample loads the kernels and is not counted.
"""

import argparse
import math
import sys
import tempfile
import time
import tomllib

import bpy
import numpy as np
import OpenEXR
from stored_references import BENCHMARKS, reference, rel_mse

EXTENT_M = 60.0
TOWARDS_X = (math.pi / 2, 0.0, -math.pi / 2)


def mesh(name, vertices, faces, material, uv=None):
    """An object of the scene; `uv` gives texture coordinates at a vertex."""
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices, [], faces)
    if uv is not None:
        layer = data.uv_layers.new()
        for loop in data.loops:
            layer.data[loop.index].uv = uv(*vertices[loop.vertex_index])
    data.materials.append(material)
    found = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(found)


def material(name):
    """A material without nodes but its output."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes = made.node_tree.nodes
    nodes.clear()
    return made, nodes, nodes.new("ShaderNodeOutputMaterial"), made.node_tree.links


def add_water(water, top_m):
    made, nodes, output, links = material("water")
    volume = nodes.new("ShaderNodeVolumeCoefficients")
    volume.phase = "FOURNIER_FORAND"
    volume.inputs["Absorption Coefficients"].default_value = water["a"]
    volume.inputs["Scatter Coefficients"].default_value = water["b"]
    volume.inputs["IOR"].default_value = water["phase"]["n"]
    volume.inputs["Backscatter"].default_value = water["phase"]["backscatter_fraction"]
    links.new(volume.outputs[0], output.inputs["Volume"])
    made.cycles.homogeneous_volume = True
    made.cycles.volume_sampling = "MULTIPLE_IMPORTANCE"
    low, high = -EXTENT_M, EXTENT_M
    corners = [(x, y, z) for x in (low, high) for y in (low, high) for z in (low, top_m)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh("water", corners, faces, made)


def add_plane(target):
    plane, reflectance = target["plane"], target["reflectance"]
    made, nodes, output, links = material("plane")
    picture = nodes.new("ShaderNodeTexImage")
    picture.image = bpy.data.images.load(str(BENCHMARKS / reflectance["texture"]))
    picture.image.colorspace_settings.name = "Non-Color"
    picture.interpolation = "Closest"
    picture.extension = "REPEAT"
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    links.new(picture.outputs["Color"], diffuse.inputs["Color"])
    links.new(diffuse.outputs[0], output.inputs["Surface"])
    x, half, tile = plane["center_m"][0], plane["size_m"][0] / 2, reflectance["tile_m"][0]
    corners = [(x, half, -half), (x, half, half), (x, -half, half), (x, -half, -half)]
    mesh("plane", corners, [(0, 1, 2, 3)], made, lambda _, y, z: ((half - y) / tile, (z + half) / tile))


def add_light(kind, energy, position, rotation, **settings):
    data = bpy.data.lights.new("light", kind)
    data.energy = energy
    for name, value in settings.items():
        setattr(data, name, value)
    light = bpy.data.objects.new("light", data)
    light.location, light.rotation_euler = position, rotation
    bpy.context.collection.objects.link(light)


def add_lamp(lamp):
    strength = lamp["intensity"][0]
    if lamp["radius_m"] == 0.0:
        cone = {"spot_size": 2 * math.radians(lamp["half_angle_deg"]), "spot_blend": 0.0, "shadow_soft_size": 0.0}
        add_light("SPOT", 4 * math.pi * strength, lamp["position_m"], TOWARDS_X, **cone)
    else:
        disk = {"shape": "DISK", "size": 2 * lamp["radius_m"]}
        add_light("AREA", math.pi * strength, lamp["position_m"], TOWARDS_X, **disk)


def build(content):
    """Makes the content of a scene file Blender's scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene, camera = bpy.context.scene, content["camera"]
    add_water(content["water"], content.get("surface", {}).get("height_m", EXTENT_M))
    if "object" in content:
        add_plane(content["object"][0])
    if "lamp" in content:
        add_lamp(content["lamp"][0])
    if "sun" in content:
        tilt = math.radians(content["sun"]["zenith_deg"])
        add_light("SUN", content["sun"]["irradiance"][0], (0, 0, 0), (0, tilt, 0), angle=0.0)
    data = bpy.data.cameras.new("camera")
    data.sensor_fit, data.angle_x, data.clip_start = "HORIZONTAL", math.radians(camera["hfov_deg"]), 1e-4
    eye = bpy.data.objects.new("camera", data)
    eye.rotation_euler = TOWARDS_X
    bpy.context.collection.objects.link(eye)
    scene.camera = eye
    settle(scene, camera)
    return scene


def settle(scene, camera):
    """The settings of the renderer."""
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y, render.resolution_percentage = camera["width"], camera["height"], 100
    render.threads_mode, render.threads = "FIXED", 1
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    cycles.use_adaptive_sampling = cycles.use_denoising = cycles.use_light_tree = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.light_sampling_threshold = 0.0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.volume_bounces = 128
    cycles.transparent_max_bounces = 128
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0


def picture(scene, spp, seed, folder):
    """A render and its processor seconds."""
    scene.cycles.samples, scene.cycles.seed = spp, seed
    scene.render.filepath = f"{folder}/out.exr"
    before = time.process_time()
    bpy.ops.render.render(write_still=True)
    seconds = time.process_time() - before
    channels = OpenEXR.File(scene.render.filepath).channels()
    key = next(k for k in channels if k.startswith("RGB"))
    return np.asarray(channels[key].pixels, dtype=float)[..., :3], seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--spp", default="16,64")
    args = parser.parse_args()
    print("renderer,scene,spp,cpu_s,rel_mse")
    with tempfile.TemporaryDirectory() as folder:
        for name in args.scenes:
            scene = build(tomllib.loads((BENCHMARKS / f"{name}.toml").read_text()))
            picture(scene, 1, 1, folder)
            ref = reference(name)
            for spp in map(int, args.spp.split(",")):
                found, seconds = picture(scene, spp, 100 + spp, folder)
                error = rel_mse(found, ref)
                print(f"Cycles {bpy.app.version_string.split()[0]},{name},{spp},{seconds:.2f},{error:.4g}", flush=True)
                means = " ".join(f"{m:.3f}" for m in found.mean((0, 1)) / ref.mean((0, 1)))
                print(f"# mean of the picture by that of the reference, red green blue: {means}", file=sys.stderr)


if __name__ == "__main__":
    main()
