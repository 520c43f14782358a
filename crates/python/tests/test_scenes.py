"""Scenes from files and dictionaries, and what is wrong with them in the words of `uw`."""

import os
import pathlib
import tempfile
import unittest
import warnings

import numpy as np
import uwguide
from programs import LAMP_SCENE, LAMP_SCENE_TEXT, uw_error


def image(scene, **options):
    return uwguide.render(scene, spp=2, backend="cpu-simd", **options)["image"]


class Scenes(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.file = self.folder / "lamp.toml"
        self.file.write_text(LAMP_SCENE_TEXT)

    def test_a_dictionary_is_the_file_with_the_same_fields(self):
        expected = image(uwguide.Scene.from_file(self.file))
        np.testing.assert_array_equal(image(uwguide.Scene.from_dict(LAMP_SCENE)), expected)
        for scene in (self.file, str(self.file), LAMP_SCENE):
            np.testing.assert_array_equal(image(scene), expected)

    def test_values_may_be_of_numpy_and_tuples(self):
        camera = {**LAMP_SCENE["camera"], "position_m": np.zeros(3), "forward": (1, 0, 0), "width": np.int32(48)}
        lamp = {**LAMP_SCENE["lamp"][0], "intensity": np.full(3, 10.0, np.float32), "half_angle_deg": np.float64(50)}
        scene = {**LAMP_SCENE, "camera": camera, "lamp": (lamp,)}
        del scene["format"]
        np.testing.assert_array_equal(image(scene), image(LAMP_SCENE))

    def test_paths_start_from_the_folder_that_is_given(self):
        uwguide.save(self.folder / "texture.png", np.full((4, 4, 3), 128, np.uint8))
        textured = {**LAMP_SCENE["object"][0], "reflectance": {"texture": pathlib.Path("texture.png")}}
        scene = {**LAMP_SCENE, "object": [textured]}
        self.assertEqual(uwguide.Scene.from_dict(scene, base_dir=self.folder).width, 48)
        with self.assertRaisesRegex(ValueError, "dict: object 1 reflectance.texture: .*texture.png"):
            uwguide.Scene.from_dict(scene, base_dir=self.folder / "elsewhere")
        shipped = {**LAMP_SCENE["object"][0], "reflectance": {"texture": "shipped:textures/gravel.png"}}
        self.assertEqual(uwguide.Scene.from_dict({**LAMP_SCENE, "object": [shipped]}).height, 27)

    def test_settings_and_size(self):
        scene = uwguide.Scene.from_file(
            self.file, settings={"water.jerlov": "7C", "lamp.left.intensity": np.ones(3), "camera.width": 96}
        )
        self.assertEqual((scene.width, scene.height, scene.lamps), (96, 27, ["left"]))
        scene = uwguide.Scene.from_dict(LAMP_SCENE, width=96)
        self.assertEqual((scene.width, scene.height), (96, 54))
        self.assertIn("96 x 54", repr(scene))

    def test_what_is_wrong_with_a_file_is_told_as_by_uw(self):
        wrong = {
            "jerlov": ('jerlov = "3C"', 'jerlov = "4C"'),
            "unknown": ("width = 48", "widht = 48"),
            "syntax": ("hfov_deg = 60.0", "hfov_deg = "),
            "range": ("half_angle_deg = 50.0", "half_angle_deg = 500.0"),
            "missing": ("intensity = [10.0, 10.0, 10.0]", ""),
        }
        for name, (old, new) in wrong.items():
            with self.subTest(name):
                self.file.write_text(LAMP_SCENE_TEXT.replace(old, new))
                told = uw_error("render", self.file, "-o", self.folder / "x.exr", "--spp", "1")
                with self.assertRaises(ValueError) as raised:
                    uwguide.Scene.from_file(self.file)
                self.assertEqual(str(raised.exception), told)
                self.assertIn("lamp.toml:", told)

    def test_what_is_no_scene_is_told_as_by_uw(self):
        png, nothing = self.folder / "x.png", self.folder / "no.toml"
        uwguide.save(png, np.zeros((2, 2, 3), np.uint8))
        for file in (png, nothing, self.folder, "no_such_scene"):
            with self.subTest(file=file):
                told = uw_error("render", file, "-o", self.folder / "x.exr", "--spp", "1")
                with self.assertRaises(ValueError) as raised:
                    uwguide.Scene.from_file(file)
                self.assertEqual(str(raised.exception), told)

    def test_what_is_wrong_with_settings_is_told_as_by_uw(self):
        told = uw_error("render", self.file, "-o", self.folder / "x.exr", "--set", "water.jerlow=3")
        with self.assertRaises(ValueError) as raised:
            uwguide.Scene.from_file(self.file, settings={"water.jerlow": 3})
        self.assertEqual(str(raised.exception), told)
        told = uw_error("render", self.file, "-o", self.folder / "x.exr", "--width", "0")
        self.assertIn("--width, --height: ", told)
        for width in (0, -1, 1.5, 20_000, "wide", float("nan"), 1 << 70):
            with self.assertRaisesRegex(ValueError, "width must be a whole number in 1..=16384, got"):
                uwguide.Scene.from_file(self.file, width=width)

    def test_what_is_wrong_with_a_dictionary_names_its_field(self):
        def scene(**changes):
            return {**LAMP_SCENE, **changes}

        camera, endless = LAMP_SCENE["camera"], []
        endless.append(endless)
        wrong = [
            (scene(watre={}), "dict: unknown field `watre`"),
            (scene(camera={**camera, "width": 0}), "dict: camera.width must be .*, got 0"),
            (scene(camera={**camera, "hfov_deg": float("nan")}), "dict: camera.hfov_deg must be .*, got nan"),
            (scene(camera={**camera, "width": None}), "dict: camera.width must be a number, .*, got None"),
            (scene(camera={**camera, "position_m": {1, 2}}), "dict: camera.position_m must be .*, got {1, 2}"),
            (scene(camera={**camera, "width": 1 << 70}), "dict: camera.width must be"),
            (scene(camera={3: 4}), "dict: the names of fields in camera must be texts, got 3"),
            (scene(lamp=endless), r"dict: lamp\[0\].* must not lie more than"),
            (scene(format="uw-scene/9"), "dict: format must be"),
            ({}, "dict: .*camera"),
        ]
        for given, text in wrong:
            with self.subTest(text), self.assertRaisesRegex(ValueError, text):
                uwguide.Scene.from_dict(given)
        for given in (3, None, [1]):
            with self.assertRaisesRegex(ValueError, "scene must be a Scene, a path, a name or a dictionary, got"):
                uwguide.render(given)

    def test_warnings_are_warnings(self):
        scene = {**LAMP_SCENE, "lamp": [{**LAMP_SCENE["lamp"][0], "spectrum": "led-5000k"}]}
        with self.assertWarnsRegex(UserWarning, "spectrum"):
            made = uwguide.Scene.from_dict(scene)
        self.assertEqual(len(made.warnings), 1)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with self.assertRaises(UserWarning):
                uwguide.Scene.from_dict(scene)


class Arguments(unittest.TestCase):
    def test_what_cannot_be_used_is_told(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        out = os.path.join(folder.name, "x.exr")
        wrong = [
            ({"layers": ["lamp.middle"]}, r"layers: unknown layer \"lamp.middle\"; known: ambient, "),
            ({"layers": "depht"}, "layers: unknown layer"),
            ({"backend": "cuda"}, 'backend must be one of auto, cpu, cpu-simd, gpu, got "cuda"'),
            ({"spp": 0}, r"spp must be a whole number in 1..=1073741824, got 0"),
            ({"spp": "many"}, "spp must be a whole number in .*, got 'many'"),
            ({"spp": -4}, "spp must be .*, got -4"),
            ({"seed": -1}, "seed must be a whole number in 0..=18446744073709551615, got -1"),
            ({"threads": 0}, "threads must be a whole number in 1..=1024, got 0"),
            ({"target_error": 0.0}, "target_error must be a finite number > 0, got 0.0"),
            ({"time_limit_s": float("inf")}, "time_limit_s must be a finite number > 0, got inf"),
            ({"max_bounces": 1.5}, "max_bounces must be a whole number"),
            ({"denoise": True, "spp": 3}, "denoise: .* must be even and at least 2, got 3"),
            ({"denoise": True, "target_error": 0.1}, "denoise: "),
            ({"backend": "gpu", "adapter": "no such adapter"}, "no such adapter"),
        ]
        for options, text in wrong:
            with self.subTest(options), self.assertRaisesRegex(ValueError, text):
                uwguide.render(LAMP_SCENE, **{"spp": 1, **options})
        told = uw_error("render", "flat_hull", "-o", out, "--layers", "lamp.middle")
        with self.assertRaises(ValueError) as raised:
            uwguide.render("flat_hull", layers=["lamp.middle"])
        self.assertEqual(f"--{raised.exception}", told)

    def test_a_number_may_be_of_numpy_or_written_short(self):
        made = uwguide.render(LAMP_SCENE, spp=np.int64(2), seed=np.uint8(1))
        self.assertEqual(made.stats["samples_per_pixel"], 2)
        self.assertEqual(uwguide.render(LAMP_SCENE, spp=2e0).stats["samples_per_pixel"], 2)


if __name__ == "__main__":
    unittest.main()
