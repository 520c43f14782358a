"""The package as a stranger finds it: alone, elsewhere, documented."""

import ast
import inspect
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import uwguide
from programs import LIMIT_S, REPOSITORY, uw_error
from uwguide import _native


def python(program, folder, *arguments, **environment):
    """Runs a program in a folder with nothing but what it is given in its environment."""
    plain = {name: os.environ[name] for name in ("PATH", "LD_LIBRARY_PATH") if name in os.environ}
    command = [sys.executable, "-I", "-c", program, *arguments]
    return subprocess.run(
        command, cwd=folder, env={**plain, **environment}, capture_output=True, text=True, timeout=LIMIT_S, check=False
    )


class Alone(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_the_picture_of_the_documentation_needs_nothing_else(self):
        page = (REPOSITORY / "docs" / "python.md").read_text()
        program = page.split("```python\n")[1].split("```")[0]
        self.assertLessEqual(len(program.splitlines()), 10)
        done = python(program, self.folder, HOME=str(self.folder))
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual([file.name for file in self.folder.iterdir()], ["hull.png"])
        stats = uwguide.stats(self.folder / "hull.png")
        self.assertEqual((stats["width"], stats["height"]), (320, 180))
        self.assertGreater(min(stats["contrast"]), 1.0)

    def test_shipped_files_that_cannot_be_had_are_told_as_by_uw(self):
        program = "import sys, uwguide\ntry:\n    uwguide.render(sys.argv[1])\nexcept ValueError as error:\n    print(error)"
        (self.folder / "scenes").mkdir()
        for assets in ("/no/such/folder", str(self.folder)):
            for scene in ("flat_hull", "shipped:scenes/flat_hull.toml"):
                with self.subTest(assets=assets, scene=scene):
                    done = python(program, self.folder, scene, UWGUIDE_ASSETS=assets)
                    out = self.folder / "x.exr"
                    told = uw_error("render", scene, "-o", out, environment={"UWGUIDE_ASSETS": assets})
                    self.assertEqual(done.stdout.strip(), told, done.stderr)
        self.assertIn(str(self.folder), told)

    def test_it_is_where_it_was_installed(self):
        self.assertFalse(pathlib.Path(uwguide.__file__).resolve().is_relative_to(REPOSITORY / "crates"))
        folder = pathlib.Path(uwguide.__file__).parent
        self.assertTrue((folder / "py.typed").exists())
        self.assertTrue((folder / "_native.pyi").exists())

    def test_the_client_is_that_of_clients(self):
        source = (REPOSITORY / "clients" / "python" / "uwguide.py").read_text()
        self.assertEqual(inspect.getsource(inspect.getmodule(uwguide.Client)), source)


class Documented(unittest.TestCase):
    def test_everything_public_says_what_it_is(self):
        for name in uwguide.__all__:
            item = getattr(uwguide, name)
            self.assertTrue(inspect.getdoc(item), name)
            for member, value in vars(item).items() if inspect.isclass(item) else ():
                if not member.startswith("_") and callable(value) or isinstance(value, (property, classmethod)):
                    self.assertTrue(inspect.getdoc(getattr(item, member)), f"{name}.{member}")

    def test_stubs_tell_what_is_compiled(self):
        stub = ast.parse((pathlib.Path(uwguide.__file__).parent / "_native.pyi").read_text())
        told = {node.name: node for node in stub.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
        made = {name for name in vars(_native) if not name.startswith("_")}
        self.assertEqual(set(told), made)
        for name, node in told.items():
            item = getattr(_native, name)
            if isinstance(node, ast.ClassDef):
                members = {member.name for member in node.body if isinstance(member, ast.FunctionDef)}
                have = {member for member in vars(item) if not member.startswith("__")}
                self.assertEqual({member for member in members if not member.startswith("__")}, have, name)
                for member in node.body:
                    if isinstance(member, ast.FunctionDef) and not _is_property(member):
                        made = item if member.name == "__new__" else getattr(item, member.name)
                        self.same(member, made, f"{name}.{member.name}")
            else:
                self.same(node, item, name)

    def same(self, node, item, name):
        told = [argument.arg for argument in node.args.args + node.args.kwonlyargs]
        made = list(inspect.signature(item).parameters)
        self.assertEqual([name for name in told if name not in ("cls", "self")], [n for n in made if n != "self"], name)


def _is_property(node):
    return any(isinstance(decorator, ast.Name) and decorator.id == "property" for decorator in node.decorator_list)


class Versions(unittest.TestCase):
    def test_it_is_the_stable_interface_of_python(self):
        self.assertTrue(_native.__file__.endswith(".abi3.so"), _native.__file__)

    def test_numpy_s_numbers_go_both_ways(self):
        self.assertIsInstance(uwguide.contrast(np.zeros((20, 20), np.uint8)), np.ndarray)


if __name__ == "__main__":
    unittest.main()
