#!/usr/bin/env python3
"""Compares the labels of two datasets of `uw dataset` with the standard errors that they state.

    python3 tools/compare_labels.py ONE OTHER

Both are output folders, finished or not, of the same grid with the same exposure, made with other seeds or other
accuracy. Every label of a dataset is the contrast of one of its images; compared are the images that both hold.
"""
import argparse
import math
import pathlib
import sys

# Columns of images/WATER/GROUP.csv: depth, lamp level and exposure, then red, green and blue of each of these.
CONTRAST, CONTRAST_ERROR = 6, 12


def images(folder):
    """Contrasts and their standard errors in counts, and the exposure, by water, group, depth and lamp level."""
    found = {}
    for path in sorted(pathlib.Path(folder).glob("images/*/*.csv")):
        for line in path.read_text().splitlines():
            row = [float(value) for value in line.split(",")]
            found[path.parent.name, path.stem, row[0], row[1]] = (
                row[CONTRAST:CONTRAST + 3], row[CONTRAST_ERROR:CONTRAST_ERROR + 3], row[2])
    return found


def compare(one, other):
    """What can be said about the differences `other` - `one` of two results of `images`."""
    differences = []
    for key in sorted(one.keys() & other.keys()):
        (contrast, error, exposure), (contrast_too, error_too, exposure_too) = one[key], other[key]
        if exposure != exposure_too:
            raise ValueError(f"{key}: exposures {exposure} and {exposure_too} differ, so labels do too")
        for k in range(3):
            stated = math.hypot(error[k], error_too[k])
            differences.append((contrast_too[k] - contrast[k], stated, 0.1 + 0.01 * contrast[k], (*key, "RGB"[k])))
    if not differences:
        raise ValueError("the folders have no image in common")
    n = len(differences)
    # A label without any stated error may not differ at all.
    ratios = [abs(difference) / stated if stated > 0 else math.inf if difference else 0.0
              for difference, stated, _, _ in differences]
    worst = max(differences, key=lambda d: abs(d[0]) / d[2])
    return {
        "labels": n,
        "beyond_errors": {times: sum(r > times for r in ratios) / n for times in (1, 2, 3, 4)},
        "rms_in_errors": math.sqrt(sum(r * r for r in ratios) / n),
        "rms_counts": math.sqrt(sum(d[0] ** 2 for d in differences) / n),
        "mean_counts": sum(d[0] for d in differences) / n,
        "largest_counts": max(abs(d[0]) for d in differences),
        "beyond_allowance": sum(abs(d[0]) > d[2] for d in differences) / n,
        "largest_in_allowance": abs(worst[0]) / worst[2],
        "worst": worst[3],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("one")
    parser.add_argument("other")
    a = parser.parse_args()
    try:
        result = compare(images(a.one), images(a.other))
    except (OSError, ValueError, IndexError) as problem:
        sys.exit(f"compare_labels.py: {problem}")
    print(f"{result['labels']} labels (images times channels)")
    for times, share in result["beyond_errors"].items():
        print(f"  {100 * share:6.2f} % differ by more than {times} of their combined standard errors")
    print(f"  difference: rms {result['rms_in_errors']:.3f} combined standard errors, {result['rms_counts']:.4f} counts;"
          f" mean {result['mean_counts']:+.5f}, largest {result['largest_counts']:.3f} counts")
    print(f"  {100 * result['beyond_allowance']:6.2f} % differ by more than 0.1 counts + 1 %;"
          f" the largest by {result['largest_in_allowance']:.2f} times that, {result['worst']}")


if __name__ == "__main__":
    main()
