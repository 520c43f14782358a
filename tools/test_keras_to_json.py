"""The converter against a model that Keras wrote: python3 -m unittest (in this folder; needs h5py)."""

import json
import math
import pathlib
import tempfile
import unittest

import keras_to_json

SAVED = pathlib.Path(__file__).parent / "testdata"
DATA = pathlib.Path(__file__).parent.parent / "crates/guidance/tests/data"


def flat(layer):
    return [value for row in layer["kernel"] for value in row] + layer["bias"]


def predict(model, values):
    """What a model file predicts for one row of inputs."""
    curves = {"tanh": math.tanh, "linear": lambda x: x}
    values = [
        (x - m) / s for x, m, s in zip(values, *(model["normalisation"][k] for k in ("mean", "std")), strict=True)
    ]
    for layer in model["layers"]:
        slope = layer.get("negative_slope")
        act = curves.get(layer["activation"], lambda x, slope=slope: x if x > 0 else slope * x)
        values = [
            act(b + sum(x * row[k] for x, row in zip(values, layer["kernel"], strict=True)))
            for k, b in enumerate(layer["bias"])
        ]
    return values


class Conversion(unittest.TestCase):
    def setUp(self):
        self.wanted = json.loads((DATA / "mlp_a.json").read_text())
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def convert(self, names, model=DATA / "mlp_a.keras"):
        path = pathlib.Path(self.folder.name) / "names.json"
        path.write_text(json.dumps(names))
        return keras_to_json.convert(model, path)

    def test_a_model_of_keras_has_the_same_numbers(self):
        got = self.convert({"inputs": self.wanted["inputs"]})
        self.assertEqual(got["inputs"], self.wanted["inputs"])
        self.assertEqual(got["outputs"], self.wanted["outputs"])
        for key in ("mean", "std"):
            for a, b in zip(got["normalisation"][key], self.wanted["normalisation"][key], strict=True):
                self.assertAlmostEqual(a / b, 1.0, delta=1e-6)
        for a, b in zip(got["layers"], self.wanted["layers"], strict=True):
            self.assertEqual((a["activation"], a["units"]), (b["activation"], b["units"]))
            for x, y in zip(flat(a), flat(b), strict=True):
                self.assertAlmostEqual(x, y, delta=1e-6)

    def test_models_of_old_and_new_keras_predict_what_keras_does(self):
        for version in ("keras_3_4", "keras_3_15"):
            told = json.loads((SAVED / f"{version}_io.json").read_text())
            names = {"inputs": [{"name": f"x{k}", "unit": "1"} for k in range(4)]}
            model = self.convert(names, model=SAVED / f"{version}.keras")
            for given, wanted in zip(told["inputs"], told["outputs"], strict=True):
                for x, y in zip(predict(model, given), wanted, strict=True):
                    self.assertAlmostEqual(x, y, delta=2e-5, msg=version)

    def test_wrong_names_are_told(self):
        for names, wrong in [
            ({"inputs": self.wanted["inputs"][:3]}, "must name 20 inputs, got 3"),
            ({"inputs": [dict(i, mean=0, std=1) for i in self.wanted["inputs"]]}, "must have no mean"),
        ]:
            with self.assertRaisesRegex(keras_to_json.Unusable, wrong):
                self.convert(names)

    def test_ranges_and_camera_are_kept(self):
        ranged = [dict(i, min=0.0, max=float(k)) for k, i in enumerate(self.wanted["inputs"])]
        camera = {"width_px": 1280, "height_px": 720}
        got = self.convert({"inputs": ranged, "camera": camera})
        self.assertEqual(got["inputs"], ranged)
        self.assertEqual(got["camera"], camera)
        self.assertNotIn("training", got)
        with self.assertRaisesRegex(keras_to_json.Unusable, "both min and max"):
            self.convert({"inputs": [dict(i, min=0.0) for i in self.wanted["inputs"]]})

    def test_a_file_of_another_kind_is_told(self):
        with self.assertRaisesRegex(keras_to_json.Unusable, "not a Keras 3 model"):
            self.convert({"inputs": self.wanted["inputs"]}, model=DATA / "mlp_a.json")

    def test_layers_that_cannot_be_converted_are_told(self):
        layer = {"class_name": "Conv1D", "config": {"name": "conv"}}
        with self.assertRaisesRegex(keras_to_json.Unusable, r"layer conv \(Conv1D\)"):
            keras_to_json.convert_layers([layer], {})


if __name__ == "__main__":
    unittest.main()
