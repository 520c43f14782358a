"""How much the labels of two data sets differ, as Markdown tables per water and distance.

    target/release/uw dataset mean.toml -o mean
    target/release/uw dataset spectral.toml -o spectral
    python3 tools/dataset_bands.py mean spectral
    python3 tools/dataset_bands.py mean spectral --channel r

The configurations differ in `bands` alone (docs/dataset.md has one). A cell is the mean over textures and channels of the
size of the change of contrast, in percent of the first set's label, and in brackets its mean with sign; one table per lamp
level.
"""

import argparse
import collections
import pathlib

WATERS = "I IA IB II III 1C 3C 5C 7C 9C".split()


def labels(folder, channels):
    """Contrast of the channels by water, texture, distance (m) and lamp level (%)."""
    found = {}
    for path in sorted(pathlib.Path(folder, "images").glob("*/*.csv")):
        texture, distance = path.stem.split("_tilt0_d")
        for line in path.read_text().splitlines():
            numbers = [float(cell) for cell in line.split(",")[:9]]
            key = (path.parent.name.split("_")[0], texture, float(distance), numbers[1])
            found[key] = [numbers[6 + "rgb".index(channel)] for channel in channels]
    return found


def mean(values):
    return sum(values) / len(values)


def cell(changes):
    return f"{mean([abs(x) for x in changes]):.1f} ({mean(changes):+.1f})"


def table(first, second, light_pct):
    changes = collections.defaultdict(list)
    for key, before in first.items():
        if key[3] == light_pct:
            after = second[key]
            changes[key[0], key[2]] += [100 * (b / a - 1) for a, b in zip(before, after)]
    distances = sorted({distance for _, distance in changes})
    print(f"\nLamps at {light_pct:.0f} %:\n\n| water | " + " | ".join(f"{d:g} m" for d in distances) + " |")
    print("|---" * (len(distances) + 1) + "|")
    for water in WATERS:
        if (water, distances[0]) in changes:
            print(f"| {water} | " + " | ".join(cell(changes[water, d]) for d in distances) + " |")
    print("| all | " + " | ".join(cell(sum((changes[w, d] for w in WATERS), [])) for d in distances) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("first")
    parser.add_argument("second")
    parser.add_argument("--channel", choices=["r", "g", "b"], help="one channel instead of all three")
    args = parser.parse_args()
    channels = args.channel or "rgb"
    first, second = labels(args.first, channels), labels(args.second, channels)
    for light_pct in sorted({key[3] for key in first}):
        table(first, second, light_pct)


if __name__ == "__main__":
    main()
