"""The comparison of labels on made-up datasets: python3 -m unittest (in this folder)."""

import pathlib
import random
import tempfile
import unittest

import compare_labels


def line(depth_m, light_pct, exposure, contrast, error):
    mean, mean_error = [100.0] * 3, [0.1] * 3
    values = [depth_m, light_pct, exposure, *mean, *contrast, *mean_error, *error, 1024, 1024]
    return ",".join(str(value) for value in values) + "\n"


class Comparison(unittest.TestCase):
    def dataset(self, seed, scale, exposure=8.0):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        numbers = random.Random(seed)
        for group in range(40):
            path = pathlib.Path(folder.name) / "images/II_B0.01" / f"hull_red_tilt0_d{group}.csv"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text("".join(
                line(depth, 33.0, exposure, [numbers.gauss(5.0, scale * 0.03) for _ in range(3)], [0.03] * 3)
                for depth in range(1, 11)))
        return folder.name

    def compare(self, one, other):
        return compare_labels.compare(compare_labels.images(one), compare_labels.images(other))

    def test_errors_that_are_stated_rightly_are_found_right(self):
        result = self.compare(self.dataset(1, 1.0), self.dataset(2, 1.0))
        self.assertEqual(result["labels"], 1200)
        self.assertAlmostEqual(result["rms_in_errors"], 1.0, delta=0.06)
        self.assertAlmostEqual(result["beyond_errors"][1], 0.317, delta=0.05)
        self.assertAlmostEqual(result["beyond_errors"][2], 0.0455, delta=0.02)
        self.assertLess(abs(result["mean_counts"]), 0.005)
        self.assertLess(result["beyond_allowance"], 0.003)
        self.assertAlmostEqual(result["largest_in_allowance"], result["largest_counts"] / 0.15, delta=0.05)

    def test_errors_that_are_stated_too_small_are_found(self):
        result = self.compare(self.dataset(1, 2.0), self.dataset(2, 2.0))
        self.assertAlmostEqual(result["rms_in_errors"], 2.0, delta=0.12)

    def test_what_cannot_be_compared_is_refused(self):
        with self.assertRaisesRegex(ValueError, "exposures 8.0 and 9.0 differ"):
            self.compare(self.dataset(1, 1.0), self.dataset(2, 1.0, exposure=9.0))
        with self.assertRaisesRegex(ValueError, "no image in common"):
            compare_labels.compare({}, {})


if __name__ == "__main__":
    unittest.main()
