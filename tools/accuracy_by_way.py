"""How far predictions of contrast are off, by where they are for.

    python3 tools/accuracy_by_way.py ROWS.csv..

ROWS.csv are the rows that `physics_accuracy` writes (crates/survey/examples/physics_accuracy.rs), such as those of ten targets in one water. For each water
and memory: mean absolute error over 15 counts, and the share within 90 % intervals, over all predictions that are told.
"""

import collections
import csv
import sys

# Up to so many times nearer than the picture.
WAYS = [("farther", 0.999), ("same", 1.001), ("1.8 nearer", 1.8), ("3.2 nearer", 3.2), ("6 nearer", float("inf"))]
NINETY = 1.645


def way(row):
    """The name of the way from a picture to a prediction."""
    times = float(row["distance_m"]) / float(row["to_distance_m"])
    return next(name for name, most in WAYS if times < most)


def told(rows):
    """Mean error, share within intervals and number of rows."""
    off = [abs(float(row["predicted"]) - float(row["truth"])) for row in rows]
    within = [miss <= NINETY * float(row["error"]) for miss, row in zip(off, rows)]
    return f"{sum(off) / len(off) / 15:.4f} {sum(within) / len(within):.3f} of {len(off)}"


def main():
    """Reads the tables and prints a line per water, memory and way."""
    rows = collections.defaultdict(lambda: collections.defaultdict(list))
    for path in sys.argv[1:]:
        with open(path, newline="", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                of = rows[row["water"], row["memory"]]
                name = way(row)
                names = [name, "all", row["texture"]] + ["nearer"] * name.endswith("nearer")
                for each in names:
                    of[each].append(row)
    for (water, memory), of in rows.items():
        for name, some in of.items():
            print(f"{water}, memory of {memory}, {name}: {told(some)}")


if __name__ == "__main__":
    main()
