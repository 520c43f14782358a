"""Profiles and waters are those of `uw calibrate` and `uw fit`."""

import json
import pathlib
import tempfile
import unittest

import numpy as np
import uwguide
from programs import a_picture, quiet, uw, uw_error

VEHICLE = """
format = "uw-vehicle/1"
width = 160
height = 90
"""
DISTANCES_M = (0.8, 1.3, 2.0)


def without_maker(text):
    told = json.loads(text)
    told.pop("made_by", None)
    told.get("source", {}).pop("made_by", None)
    return told


class Calibration(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def routine(self, looks_up=True):
        """Pictures of a routine and their manifest."""
        rows = ["file,kind,depth_m,distance_m,light_pct"]
        for at, distance_m in enumerate(DISTANCES_M):
            for light_pct in (0, 60):
                name = f"target{at}_{light_pct}.png"
                share = (0.4 + 0.01 * light_pct) / distance_m
                uwguide.save(self.folder / name, np.clip(share * a_picture(), 0, 255).astype(np.uint8))
                rows.append(f"{name},contrast,3,{distance_m},{light_pct}")
        for at, depth_m in enumerate((0.5, 3.0, 6.0) if looks_up else ()):
            name = f"up{at}.png"
            uwguide.save(self.folder / name, (a_picture() / (1 + at)).astype(np.uint8))
            rows.append(f"{name},depth,{depth_m},,")
        manifest = self.folder / "manifest.csv"
        manifest.write_text("\n".join(rows) + "\n")
        return manifest

    def test_a_profile_is_that_of_uw(self):
        manifest, out = self.routine(), self.folder / "profile.json"
        uw("calibrate", manifest, "-o", out)
        ours = uwguide.calibrate(manifest)
        self.assertEqual(without_maker(ours.to_json()), without_maker(out.read_text()))
        distances_m, k_c = ours.contrast_on
        self.assertEqual(distances_m.tolist(), list(DISTANCES_M))
        self.assertEqual(k_c.shape, (3, 3))
        expected = [uwguide.contrast(self.folder / f"target{at}_60.png") for at in range(3)]
        np.testing.assert_allclose(k_c, expected, rtol=1e-12)
        np.testing.assert_allclose(ours.k_c_on(1.05), (k_c[0] + k_c[1]) / 2, rtol=1e-12)
        self.assertEqual(ours.k_z(0.5).tolist(), [1.0, 1.0, 1.0])
        self.assertEqual((ours.depth_range_m, ours.distance_range_m), ((0.5, 6.0), (0.8, 2.0)))
        with self.assertRaisesRegex(ValueError, r"distance_m must be between 0.8 and 2.0 m \(calibrated\), got 9"):
            ours.k_c_off(9.0)
        ours.write(self.folder / "again.json")
        again = uwguide.Profile.from_file(self.folder / "again.json")
        self.assertEqual(again.to_json(), ours.to_json())

    def test_choices_are_those_of_uw(self):
        manifest, out = self.routine(), self.folder / "profile.json"
        options = ["--light-pct", "30", "--encoding", "linear", "--noise-a", "1e-4", "--noise-b", "1e-6"]
        uw("calibrate", manifest, "-o", out, *options)
        with self.assertWarns(UserWarning):
            ours = uwguide.calibrate(manifest, light_pct=30, encoding="linear", noise_a=1e-4, noise_b=1e-6)
        self.assertEqual(without_maker(ours.to_json()), without_maker(out.read_text()))
        self.assertTrue(any("30" in warning for warning in ours.warnings))

    def test_photographs_are_treated_as_by_uw(self):
        manifest, out = self.routine(), self.folder / "profile.json"
        height, width = a_picture().shape[:2]
        vehicle, camera, mask = (self.folder / name for name in ("vehicle.toml", "camera.toml", "mask.toml"))
        vehicle.write_text(f'format = "uw-vehicle/1"\nwidth = {width}\nheight = {height}\nhfov_deg = 50\n')
        camera.write_text(
            'format = "uw-scene/1"\n[camera]\nposition_m = [0, 0, 0]\nforward = [1, 0, 0]\n'
            f"width = {width}\nheight = {height}\nhfov_deg = 65\ndistortion = [-0.1, 0, 0, 0, 0]\n"
        )
        mask.write_text(
            f'format = "uw-mask/1"\nwidth = {width}\nheight = {height}\n'
            f"[[polygon]]\npoints = [[0, 0], [{width // 4}, 0], [{width // 4}, {height // 2}], [0, {height // 2}]]\n"
        )
        given = {"vehicle": vehicle, "camera": camera, "mask": mask}
        uw("calibrate", manifest, "-o", out, *(word for name, file in given.items() for word in (f"--{name}", file)))
        with quiet():
            ours, plain = uwguide.calibrate(manifest, **given), uwguide.calibrate(manifest, vehicle=vehicle)
        self.assertEqual(without_maker(ours.to_json()), without_maker(out.read_text()))
        for at in range(len(DISTANCES_M)):
            self.assertTrue((ours.contrast_on[1][at] != plain.contrast_on[1][at]).all())
        with quiet(), self.assertRaisesRegex(ValueError, "^camera needs vehicle, whose width, height and hfov_deg"):
            uwguide.calibrate(manifest, camera=camera)

    def test_without_pictures_that_look_up(self):
        manifest, out = self.routine(looks_up=False), self.folder / "profile.json"
        uw("calibrate", manifest, "-o", out, "--kd-per-m", "0.4,0.1,0.15")
        with self.assertWarns(UserWarning):
            ours = uwguide.calibrate(manifest, kd_per_m=[0.4, 0.1, 0.15])
        self.assertEqual(without_maker(ours.to_json()), without_maker(out.read_text()))
        self.assertIn("approximate: ", ours.to_json())

    def test_what_cannot_be_calibrated_is_told_as_by_uw(self):
        manifest, out = self.routine(looks_up=False), self.folder / "profile.json"
        for options, arguments in (
            ({}, []),
            ({"kd_per_m": [1.0, 0.0, 1.0]}, ["--kd-per-m", "1,0,1"]),
            ({"jerlov": "4C"}, ["--jerlov", "4C"]),
            ({"light_pct": 0}, ["--light-pct", "0"]),
            ({"light_pct": 101.5}, ["--light-pct", "101.5"]),
            ({"exposure": 0}, ["--exposure", "0"]),
            ({"mask": "none.toml"}, ["--mask", "none.toml"]),
        ):
            told = uw_error("calibrate", manifest, "-o", out, *arguments)
            with self.subTest(options), self.assertRaises(ValueError) as raised:
                uwguide.calibrate(manifest, **options)
            option = f"--{next(iter(options)).replace('_', '-')}" if options else ""
            name = next(iter(options), "")
            self.assertEqual(str(raised.exception).replace(name, option, 1), told)
        with self.assertRaisesRegex(ValueError, "jerlov and kd_per_m must not be given both"):
            uwguide.calibrate(manifest, jerlov="1C", kd_per_m=[1, 1, 1])
        self.assertFalse(out.exists())

    def pictures(self):
        """What a small vehicle's camera sees of a wall in water; the manifest and the vehicle's file."""
        vehicle = self.folder / "vehicle.toml"
        vehicle.write_text(VEHICLE)
        rows = ["file,kind,depth_m,distance_m,light_pct"]
        for distance_m in DISTANCES_M:
            wall = {"center_m": [distance_m, 0, -3], "normal": [-1, 0, 0], "size_m": [12, 5.6]}
            for light_pct in (0, 60):
                name = f"wall_{distance_m}_{light_pct}.png"
                scene = uwguide.Scene.from_file(
                    "flat_hull",
                    settings={
                        "water.jerlov": "1C",
                        "water.bands": "mean",
                        "object.0.plane": {**wall, "up": [0, 0, 1]},
                        "lamp.left.level_pct": light_pct,
                        "lamp.right.level_pct": light_pct,
                    },
                    width=160,
                )
                uwguide.save(self.folder / name, uwguide.expose(uwguide.render(scene, spp=16)["image"], scene))
                rows.append(f"{name},contrast,3,{distance_m},{light_pct}")
        manifest = self.folder / "walls.csv"
        manifest.write_text("\n".join(rows) + "\n")
        return manifest, vehicle

    def test_a_water_is_that_of_uw(self):
        (manifest, vehicle), out = self.pictures(), self.folder / "water.json"
        uw("fit", manifest, "--vehicle", vehicle, "-o", out, "--kilo-paths", "4", "--table-kilo-paths", "8")
        ours = uwguide.fit(manifest, vehicle=vehicle, kilo_paths=4, table_kilo_paths=8)
        self.assertEqual(without_maker(ours.to_json()), without_maker(out.read_text()))
        self.assertTrue(all(0.0 < a < 5.0 for a in ours.a_per_m), ours)
        ours.write(self.folder / "again.json")
        self.assertEqual((self.folder / "again.json").read_text(), ours.to_json())

    def test_a_water_is_read_written_and_rendered(self):
        made, again = self.folder / "made.json", self.folder / "again.json"
        vehicle = self.folder / "vehicle.toml"
        vehicle.write_text(VEHICLE)
        tables = ["--views", "2", "--kilo-paths", "8", "--depths-m", "3", "--vehicle", vehicle]
        uw("water-tables", "--a", "0.4,0.1,0.2", "--b", "0.3,0.3,0.3", "-o", made, *tables)
        water = uwguide.Water.from_file(made)
        water.write(again)
        self.assertEqual(json.loads(again.read_text()), json.loads(made.read_text()))
        self.assertEqual((water.a_per_m, water.b_per_m), ([0.4, 0.1, 0.2], [0.3, 0.3, 0.3]))
        self.assertEqual((water.backscatter_fraction, water.not_identified), (0.0183, []))
        scene = {
            "water": {"fitted": again},
            "camera": {"position_m": [0, 0, 0], "forward": [1, 0, 0], "hfov_deg": 60, "width": 8, "height": 8},
        }
        self.assertEqual(uwguide.render(scene, spp=1)["image"].shape, (8, 8, 3))

    def test_what_cannot_be_fitted_is_told_as_by_uw(self):
        manifest, out = self.routine(), self.folder / "water.json"
        for options, arguments in (
            ({}, []),
            ({"vehicle": "submarine"}, ["--vehicle", "submarine"]),
            ({"backscatter_fraction": 0.9}, ["--backscatter-fraction", "0.9"]),
            ({"gain_error": 0.0}, ["--gain-error", "0"]),
        ):
            told = uw_error("fit", manifest, "-o", out, *arguments)
            with self.subTest(options), quiet(), self.assertRaises(ValueError) as raised:
                uwguide.fit(manifest, **options)
            text = str(raised.exception)
            for name in ("backscatter_fraction", "gain_error"):
                text = text.replace(name, f"--{name.replace('_', '-')}")
            self.assertEqual(text, told)
        with quiet(), self.assertRaisesRegex(ValueError, "kilo_paths must be a whole number in 4..=1024, got 1"):
            uwguide.fit(manifest, kilo_paths=1)


if __name__ == "__main__":
    unittest.main()
