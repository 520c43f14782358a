"""Writes assets/water/jerlov_depth_profiles.csv: the Jerlov type of each 10 m of depth, by the type at the surface.

The numbers are those of the package `jerlov` (PyPI, Apache-2.0), whose table was made from the data set of Williamson and
Hollins 2023 (CC BY 4.0) and compared there with all 120 cells of their printed Table 2. Layers for which they declare no type
(fewer than ten campaigns) are left out; nothing else is changed.

    pip install --target DIR --no-deps jerlov==0.22.0
    python3 tools/spectra/jerlov_depth_profiles.py DIR/jerlov/data/williamson2023_depth.csv > assets/water/jerlov_depth_profiles.csv
"""

import csv
import sys

HEADER = """\
# Jerlov water type of each 10 m layer below a surface of a given type, as it is typically found. Depths in m.
# Williamson & Hollins 2023, Depth profiles of Jerlov water types, Limnology and Oceanography Letters 8, 781-788, doi 10.1002/lol2.10338, Table 2;
# numbers of the data set doi 10.6084/m9.figshare.21710252, CC BY 4.0, by way of the package jerlov 0.22.0 (PyPI, T. Ishibashi, Apache-2.0).
# A layer has the type whose K_d was nearest to the measured K_d in most campaigns; campaigns: how many of them (none at the surface, which
# defines the profile). second_highest: the authors took the second highest count, as it agrees better with the layers around.
# Changed: layers without a declared type (fewer than ten campaigns) are left out."""


def main():
    """Copies the declared layers."""
    print(HEADER)
    print("surface_water_type,depth_min_m,depth_max_m,water_type,campaigns,status")
    with open(sys.argv[1], encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            if row["water_type"]:
                names = ["surface_water_type", "depth_min_m", "depth_max_m", "water_type", "n_campaigns", "status"]
                print(",".join(row[name] for name in names))


if __name__ == "__main__":
    main()
