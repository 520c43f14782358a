"""The flight along a hull of `clients/python`, two stops of it: python3 -m unittest (in this folder).

The programs are taken from the folder UWGUIDE_PROGRAMS, else from target/release of the repository.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

REPOSITORY = pathlib.Path(__file__).resolve().parents[4]
PROGRAMS = pathlib.Path(os.environ.get("UWGUIDE_PROGRAMS", REPOSITORY / "target" / "release"))
FLIGHT = REPOSITORY / "clients" / "python" / "fly_hull.py"
LIMIT_S = 900


class Flight(unittest.TestCase):
    def test_advice_is_followed_and_holds(self):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "flight"
            words = [sys.executable, FLIGHT, out, "--stops", "2", "--distance-m", "1.7", "--programs", PROGRAMS]
            done = subprocess.run(words, timeout=LIMIT_S, capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("advice by physics", done.stdout)
            first, second = json.loads((out / "flight.json").read_text())
            # From 1.7 m in Jerlov 3C water it is worth going nearer.
            advice = first["advice"]
            self.assertEqual((advice["valid"], advice["action"]), (True, "move"), advice)
            self.assertAlmostEqual(second["distance_m"], max(1.1, advice["distance_m"]), 9)
            self.assertLess(second["distance_m"], 1.5)
            self.assertEqual(second["level_pct"], advice["light_pct"])
            # What was expected there is seen there, on another part of the hull.
            for expected, seen in zip(advice["predicted_contrast"], second["advice"]["std"]):
                self.assertLess(abs(expected / seen - 1), 0.4)
            for name in ("before.png", second["picture"], "flight.md"):
                self.assertTrue((out / name).stat().st_size > 0, name)


if __name__ == "__main__":
    unittest.main()
