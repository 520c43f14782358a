"""Contrast, exposure and irradiance are those of `uw`."""

import csv
import pathlib
import tempfile
import unittest

import numpy as np
import uwguide
from programs import LAMP_SCENE, a_picture, exr_layers, uw, uw_error, uw_stats


class Measures(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_contrast_is_that_of_uw(self):
        for dtype, ending in ((np.uint8, "png"), (np.uint16, "png"), (np.uint8, "tif")):
            with self.subTest(dtype=dtype, ending=ending):
                picture, file = a_picture(dtype=dtype), self.folder / f"picture.{ending}"
                uwguide.save(file, picture)
                told = uw_stats(file)
                for image in (picture, file, str(file)):
                    self.assertEqual(uwguide.contrast(image).tolist(), told["contrast"])
                    ours = uwguide.stats(image)
                    for name in ("mean", "contrast_corrected", "noise_floor", "noise", "black", "saturated", "width"):
                        self.assertEqual(ours[name], told[name], name)
                sensor = uw_stats(file, "--noise-a", "1e-4", "--noise-b", "1e-6", "--encoding", "linear")
                ours = uwguide.stats(picture, noise_a=1e-4, noise_b=1e-6, encoding="linear")
                self.assertEqual(ours["contrast_corrected"], sensor["contrast_corrected"])
                self.assertEqual(ours["noise_source"], "sensor")

    def test_a_vehicle_is_heeded_as_by_uw(self):
        picture, file, vehicle = a_picture(), self.folder / "picture.png", self.folder / "v.toml"
        uwguide.save(file, picture)
        vehicle.write_text('format = "uw-vehicle/1"\nencoding = "linear"\nvignetting = [-0.4, 0.0, 0.0]\n')
        told = uw_stats(file, "--vehicle", str(vehicle))
        for image in (picture, file):
            ours = uwguide.stats(image, vehicle=vehicle)
            for name in ("contrast", "mean", "contrast_corrected", "noise_floor", "noise_source"):
                self.assertEqual(ours[name], told[name], name)
        self.assertGreater(ours["mean"][0], uwguide.stats(picture)["mean"][0])
        with self.assertRaisesRegex(ValueError, "neither a file"):
            uwguide.stats(picture, vehicle="yacht")

    def test_contrast_by_its_definition(self):
        picture = a_picture(75, 128)
        patches = picture[:72, :120].reshape(6, 12, 10, 12, 3)
        expected = patches.std(axis=(1, 3)).mean(axis=(0, 1))
        np.testing.assert_allclose(uwguide.contrast(picture), expected, rtol=1e-12)
        np.testing.assert_allclose(uwguide.contrast(picture.astype(np.float64) + 0.0), expected, rtol=1e-12)

    def test_grey_alpha_and_views_count_as_what_they_show(self):
        picture = a_picture()
        expected = uwguide.contrast(picture)
        alpha = np.dstack([picture, np.zeros(picture.shape[:2], np.uint8)])
        np.testing.assert_array_equal(uwguide.contrast(alpha), expected)
        np.testing.assert_array_equal(uwguide.contrast(picture[..., ::-1]), expected[::-1])
        np.testing.assert_array_equal(uwguide.contrast(np.asfortranarray(picture)), expected)
        for grey in (picture[..., 0], picture[..., :1]):
            np.testing.assert_array_equal(uwguide.contrast(grey), [expected[0]] * 3)

    def test_what_is_no_picture_is_told(self):
        wrong = [
            (np.zeros((5, 5, 3), np.uint8), "image must be at least 10 x 6 pixels for the patch grid, got 5 x 5"),
            (np.zeros((20, 20, 5), np.uint8), r"image must be an array of shape .*, got uint8 of shape \(20, 20, 5\)"),
            (np.zeros(20), r"got float64 of shape \(20,\)"),
            (np.zeros((0, 0, 3), np.uint8), "at least 10 x 6 pixels"),
            (np.zeros((20, 20, 3), np.int64), "image must be uint8 or uint16, got int64"),
            (np.full((20, 20, 3), np.nan), "8-bit counts, finite and within"),
            (np.full((20, 20, 3), 256.0), "8-bit counts, finite and within"),
            (None, "image must be an array"),
        ]
        for image, text in wrong:
            with self.subTest(text), self.assertRaisesRegex(ValueError, text):
                uwguide.contrast(image)
        with self.assertWarnsRegex(UserWarning, "uwguide.expose makes counts of radiance"):
            uwguide.contrast(np.full((20, 20, 3), 0.5))
        for file in (self.folder / "no.png", pathlib.Path(__file__), self.folder):
            with self.subTest(file), self.assertRaises(ValueError) as raised:
                uwguide.contrast(file)
            self.assertEqual(str(raised.exception), uw_error("stats", file))
        for numbers in ({"noise_a": 1.0}, {"noise_a": -1.0, "noise_b": 0.0}):
            with self.assertRaisesRegex(ValueError, "noise_a and noise_b"):
                uwguide.stats(a_picture(), **numbers)

    def test_exposure_and_files_are_those_of_uw(self):
        exr, png = self.folder / "hull.exr", self.folder / "hull.png"
        scene = uwguide.Scene.from_file("flat_hull", width=64)
        radiance = uwguide.render(scene, spp=2)["image"]
        uwguide.save(exr, radiance)
        np.testing.assert_array_equal(exr_layers(exr)["image"], radiance)
        uw("sensor", exr, "flat_hull", "-o", png, "--seed", "5")
        counts = uwguide.expose(radiance, scene, seed=5)
        self.assertEqual((counts.dtype, counts.shape), (np.uint8, radiance.shape))
        uwguide.save(self.folder / "ours.png", counts)
        self.assertEqual((self.folder / "ours.png").read_bytes(), png.read_bytes())
        np.testing.assert_array_equal(uwguide.expose(radiance.astype(np.float64), "flat_hull", seed=5), counts)
        fine = uwguide.expose(radiance, {**LAMP_SCENE, "sensor": {"bits": 16}})
        self.assertEqual(fine.dtype, np.uint16)
        self.assertEqual(uwguide.expose(radiance).dtype, np.uint8)

    def test_files_that_cannot_be_written_are_told(self):
        picture = a_picture()
        wrong = [
            ("x.jpg", picture, "the extension must be one of .exr, .png, .tif, .tiff"),
            ("x.exr", picture, "an .exr file holds radiance"),
            ("x.png", np.zeros((4, 4, 3), np.float32), "image must be uint8 or uint16"),
            ("x.png", picture.astype(np.int32), "image must be uint8, uint16 or float32, got int32"),
            ("no/x.png", picture, "cannot be"),
        ]
        for name, image, text in wrong:
            with self.subTest(text), self.assertRaisesRegex(ValueError, text):
                uwguide.save(self.folder / name, image)
        self.assertEqual(list(self.folder.iterdir()), [])
        for image in (np.zeros((4, 4)), np.zeros((4, 4, 4)), "x.exr", np.zeros((4, 4, 3), np.uint8)):
            with self.assertRaisesRegex(ValueError, "image must be an array of floats of shape"):
                uwguide.expose(image)

    def test_irradiance_is_that_of_uw(self):
        table = self.folder / "table.csv"
        options = ["--depths-m", "0,1.5", "--samples", "512", "--seed", "2", "--backend", "cpu-simd"]
        uw("irradiance", "flat_hull", "-o", table, *options, "--quiet")
        ours = uwguide.irradiance("flat_hull", [0.0, 1.5], samples=512, seed=2, backend="cpu-simd")
        self.assertEqual(ours["depth_m"].tolist(), [0.0, 1.5])
        with table.open() as rows:
            for row in csv.DictReader(rows):
                at = [0.0, 1.5].index(float(row["depth_m"])), "rgb".index(row["channel"])
                quantity = row["quantity"]
                for name, array in (("value", quantity), ("standard_error", f"{quantity}_standard_error")):
                    self.assertEqual(ours[array].shape, (2, 3))
                    np.testing.assert_allclose(ours[array][at], float(row[name]), rtol=1e-8)
        self.assertEqual(uwguide.irradiance("flat_hull", 2.0, samples=64)["E_d"].shape, (1, 3))

    def test_irradiances_that_cannot_be_measured_are_told(self):
        for depths_m, text in (([-1.0], "depths must be finite and >= 0 m, got -1"), ([], "between 1 and .* depths, got 0")):
            with self.assertRaisesRegex(ValueError, text):
                uwguide.irradiance("flat_hull", depths_m)
        with self.assertRaisesRegex(ValueError, "no water surface"):
            uwguide.irradiance(LAMP_SCENE, 1.0)
        with self.assertRaisesRegex(ValueError, "samples must be a whole number in 2..=1073741824, got 1"):
            uwguide.irradiance("flat_hull", 1.0, samples=1)


if __name__ == "__main__":
    unittest.main()
