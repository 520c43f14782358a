"""The same by COLMAP, through the package `pycolmap` (tried with 4.2): its own track, and its points where the poses are those of the exported model."""

import json
import pathlib
import tempfile

import numpy as np
import pycolmap

from .pictures import Refused

pycolmap.logging.minloglevel = 2
EYES = ("rgb/", "rgb_right/")
# Frames that a picture is matched with where the poses are known.
OVERLAP = 3


def reader(rig):
    """COLMAP counts image points from the corner of the picture."""
    fx, fy, cx, cy, _ = rig.numbers
    options = pycolmap.ImageReaderOptions()
    options.camera_model, options.camera_params = "PINHOLE", ",".join(repr(float(x)) for x in (fx, fy, cx + 0.5, cy + 0.5))
    return options


def options_of_mapper():
    """Intrinsics and baseline are known and stay."""
    options = pycolmap.IncrementalPipelineOptions()
    options.ba_refine_focal_length = options.ba_refine_principal_point = options.ba_refine_extra_params = False
    options.ba_refine_sensor_from_rig = False
    return options


def rig_file(path, rig):
    right = {"image_prefix": EYES[1], "cam_from_rig_rotation": [1, 0, 0, 0], "cam_from_rig_translation": [-rig.baseline_m, 0, 0]}
    path.write_text(json.dumps([{"cameras": [{"image_prefix": EYES[0], "ref_sensor": True}, right]}]))
    return pycolmap.read_rig_config(path)


def mapped(folder, names, rig, work):
    """COLMAP's model of pictures whose poses nobody tells it."""
    database = work / "track.db"
    pycolmap.extract_features(database, folder, image_names=names, camera_mode=pycolmap.CameraMode.PER_FOLDER, reader_options=reader(rig))
    with pycolmap.Database.open(database) as opened:
        pycolmap.apply_rig_config(rig_file(work / "rig.json", rig), opened)
    pycolmap.match_sequential(database)
    models = pycolmap.incremental_mapping(database, folder, work, options_of_mapper())
    if not models:
        raise Refused(f"{folder}: COLMAP finds no model")
    return max(models.values(), key=lambda model: model.num_reg_images())


def track(folder, left_files, right_files, rig):
    """Positions, m, and rotations from camera to world of the left eye, median depth of the points, m, and what was seen."""
    names = [str(file.relative_to(folder)) for file in [*left_files, *right_files]]
    with tempfile.TemporaryDirectory() as work:
        model = mapped(folder, names, rig, pathlib.Path(work))
    placed = {image.name: image for image in model.images.values() if image.has_pose}
    images = [placed[name] for name in names[: len(left_files)] if name in placed]
    if len(images) < len(left_files):
        raise Refused(f"{folder}: COLMAP places {len(images)} of {len(left_files)} frames")
    matrices = np.array([image.cam_from_world().matrix() for image in images])
    depths_m = [image.cam_from_world().matrix()[2] @ [*model.points3D[p.point3D_id].xyz, 1] for image in images for p in image.get_observation_points2D()]
    seen = {"points": model.num_points3D(), "observations": model.compute_num_observations(), "residual_px": model.compute_mean_reprojection_error()}
    positions_m = np.array([image.projection_center() for image in images])
    return positions_m, np.swapaxes(matrices[:, :, :3], 1, 2), float(np.median(depths_m)), seen


def known_poses_residual_px(folder):
    """Mean reprojection error of COLMAP's points with the poses and the camera of DIR/colmap; `None` where that is not there."""
    if not (folder / "colmap" / "images.txt").exists():
        return None
    with tempfile.TemporaryDirectory() as work:
        database = pathlib.Path(work) / "known.db"
        model = pycolmap.Reconstruction(folder / "colmap")
        enter(model, database)
        names = [image.name for image in model.images.values()]
        pycolmap.extract_features(database, folder, image_names=names, camera_mode=pycolmap.CameraMode.SINGLE)
        match_neighbours(model, database, pathlib.Path(work) / "pairs.txt")
        points = pycolmap.triangulate_points(model, database, folder, work)
    return points.compute_mean_reprojection_error()


def match_neighbours(model, database, pairs_file):
    """Matches the eyes of a frame, and each with the next frames' (COLMAP's own order is by name: no left one would meet a right one)."""
    frames = {}
    for image in model.images.values():
        frames.setdefault(image.name.split("/")[-1], []).append(image.name)
    groups = [sorted(names) for _, names in sorted(frames.items())]
    pairs = []
    for k, names in enumerate(groups):
        later = [name for group in groups[k + 1 : k + 1 + OVERLAP] for name in group]
        pairs += [(name, other) for at, name in enumerate(names) for other in [*names[at + 1 :], *later]]
    pairs_file.write_text("".join(f"{one} {other}\n" for one, other in pairs))
    options = pycolmap.ImportedPairingOptions()
    options.match_list_path = str(pairs_file)
    pycolmap.match_image_pairs(database, pairing_options=options)


def enter(model, database):
    """A new database with the model's images under its numbers: COLMAP would give them numbers of its own."""
    with pycolmap.Database.open(database) as opened:
        for camera in model.cameras.values():
            opened.write_camera(camera, use_camera_id=True)
        for rig in model.rigs.values():
            opened.write_rig(rig, use_rig_id=True)
        for _, frame in sorted(model.frames.items()):
            opened.write_frame(frame, use_frame_id=True)
        for _, image in sorted(model.images.items()):
            opened.write_image(image, use_image_id=True)
