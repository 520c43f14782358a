"""Renders are those of `uw`, belong to numpy without a copy, and leave the interpreter to others."""

import json
import multiprocessing
import pathlib
import subprocess
import sys
import tempfile
import tracemalloc
import unittest

import numpy as np
import uwguide
from programs import LAMP_SCENE, LIMIT_S, exr_layers, quiet, uw


class Pictures(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_every_layer_is_that_of_uw(self):
        for scene, backend in (("flat_hull", "cpu-simd"), ("turbid_lamp", "cpu"), ("marine_snow", "auto")):
            with self.subTest(scene=scene):
                file, facts = self.folder / f"{scene}.exr", self.folder / "facts.json"
                options = ["--width", "48", "--spp", "4", "--seed", "11", "--backend", backend, "--layers", "all"]
                uw("render", scene, "-o", file, *options, "--stats", facts, "--quiet")
                with quiet():
                    read = uwguide.Scene.from_file(scene, width=48)
                ours = uwguide.render(read, spp=4, seed=11, backend=backend, layers="all")
                theirs = exr_layers(file)
                self.assertEqual(set(ours), set(theirs))
                self.assertEqual(next(iter(ours)), "image")
                for name, array in ours.items():
                    self.assertEqual(array.dtype, np.float32, name)
                    np.testing.assert_array_equal(array, theirs[name], err_msg=name)
                told = json.loads(facts.read_text())
                for fact in ("backend", "paths", "path_vertices", "relative_error", "samples_per_pixel", "needs"):
                    self.assertEqual(ours.stats[fact], told[fact], fact)

    def test_a_denoised_picture_is_that_of_uw(self):
        file = self.folder / "clean.exr"
        uw("render", "flat_hull", "-o", file, "--width", "64", "--spp", "8", "--denoise", "--quiet")
        ours = uwguide.render(uwguide.Scene.from_file("flat_hull", width=64), spp=8, denoise=True)
        np.testing.assert_array_equal(ours["image"], exr_layers(file)["image"])
        self.assertIn("relative_bias", ours.stats["denoised"])

    def test_seed_and_threads(self):
        one, same = (uwguide.render(LAMP_SCENE, spp=4, seed=3, threads=n)["image"] for n in (1, 2))
        np.testing.assert_array_equal(one, same)
        other = uwguide.render(LAMP_SCENE, spp=4, seed=4)["image"]
        self.assertTrue((one != other).any())

    def test_samples_are_the_scene_s_for_none_and_end_at_an_error(self):
        scene = {**LAMP_SCENE, "render": {"samples_per_pixel": 6}}
        self.assertEqual(uwguide.render(scene, spp=None).stats["samples_per_pixel"], 6)
        done = uwguide.render(scene, spp=None, target_error=0.5)
        self.assertLessEqual(done.stats["relative_error"], 0.5)

    def test_shapes(self):
        made = uwguide.render(LAMP_SCENE, spp=2, layers=["depth", "normal", "lamp.left"])
        shapes = {name: array.shape for name, array in made.items()}
        colour = (27, 48, 3)
        self.assertEqual(shapes, {"image": colour, "depth": (27, 48), "normal": colour, "lamp.left": colour})
        self.assertAlmostEqual(float(made["depth"][13, 24]), 1.5, places=5)

    def test_arrays_are_the_renderer_s_memory(self):
        scene = uwguide.Scene.from_dict({**LAMP_SCENE, "water": {"a": [0.1] * 3, "b": [0.0] * 3}}, width=480)
        uwguide.render(scene, spp=1)
        tracemalloc.start()
        try:
            made = uwguide.render(scene, spp=1, layers=["ambient"])
            # numpy tells tracemalloc of every buffer that it allocates.
            _, most_bytes = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
        self.assertGreater(made["image"].nbytes, 1_500_000)
        self.assertLess(most_bytes, made["image"].nbytes // 10)
        for array in made.values():
            self.assertFalse(array.flags.owndata)
            self.assertTrue(array.flags.writeable)
            self.assertTrue(array.flags.c_contiguous)
        array = made.pop("image")
        del made
        array += 1.0
        self.assertTrue((array >= 1.0).all())

    def test_a_forked_process_renders_too(self):
        if "fork" not in multiprocessing.get_all_start_methods():
            self.skipTest("this system does not fork")
        here = uwguide.render(LAMP_SCENE, spp=2)["image"]
        with multiprocessing.get_context("fork").Pool(1) as pool:
            there = pool.apply_async(_image).get(timeout=LIMIT_S)
        np.testing.assert_array_equal(here, there)


def _image():
    return uwguide.render(LAMP_SCENE, spp=2)["image"]


# A render that never ends by itself. Another thread of Python works while it runs and then sends Ctrl-C, which can only happen
# where the interpreter's lock is free; then a render goes on as if nothing had been.
INTERRUPTED = """
import os, signal, sys, threading
import uwguide

# A shell starts what runs in its background without it.
signal.signal(signal.SIGINT, signal.default_int_handler)

work = []

def other():
    while len(work) < 100_000:
        work.append(len(work))
    os.kill(os.getpid(), signal.SIGINT)

scene = uwguide.Scene.from_file("turbid_lamp")
threading.Timer(1.0, other).start()
try:
    {call}
except KeyboardInterrupt:
    assert len(work) == 100_000
    assert uwguide.render(scene, spp=1)["image"].shape == (135, 240, 3)
    print("interrupted")
"""


class Interruption(unittest.TestCase):
    def interrupted(self, call):
        program = INTERRUPTED.format(call=call)
        command = [sys.executable, "-c", program]
        done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)
        self.assertEqual(done.stdout, "interrupted\n", done.stderr)

    def test_another_thread_runs_meanwhile_and_ctrl_c_ends_it(self):
        self.interrupted("uwguide.render(scene, spp=1 << 30)")

    def test_so_in_double_precision_and_denoised(self):
        self.interrupted("uwguide.render(scene, spp=1 << 30, backend='cpu')")
        self.interrupted("uwguide.render(scene, spp=1 << 30, denoise=True)")

    def test_so_for_irradiances(self):
        self.interrupted("uwguide.irradiance('flat_hull', [1.0, 2.0], samples=1 << 30)")

    def test_another_signal_s_exception_comes_through(self):
        program = """
import os, signal, threading
import uwguide

def late(*_):
    raise TimeoutError("late")

signal.signal(signal.SIGALRM, late)
signal.alarm(2)
try:
    uwguide.render("turbid_lamp", spp=1 << 30)
except TimeoutError as error:
    print(error)
"""
        command = [sys.executable, "-c", program]
        done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)
        self.assertEqual(done.stdout, "late\n", done.stderr)


if __name__ == "__main__":
    unittest.main()
