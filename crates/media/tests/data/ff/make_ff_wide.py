#!/usr/bin/env python3
"""Writes ff_wide.csv: the Fournier-Forand function as published, with 80 digits (needs mpmath).

Parameters and angles beyond those of ff_table.csv: indices from 1.001 to 3, backscatter fractions from 1e-4
to 0.499, and x = sin^2(theta/2) down to 1e-30 and close to delta = 1.
"""
from mpmath import mp, mpf, log, pi

mp.dps = 80
INDICES = ["1.001", "1.01", "1.02", "1.15", "1.2", "1.33", "1.5", "2.2", "3.0"]
FRACTIONS = ["1e-4", "0.001", "0.0183", "0.2", "0.49", "0.499"]
PLACES = ["1e-30", "1e-20", "1e-12", "1e-8", "1e-5", "1e-4", "1e-3", "0.01", "0.1", "0.3", "0.5", "0.51", "0.75", "0.9", "0.99", "1"]
NEAR_ONE = ["-0.3", "-0.01", "-1e-4", "-1e-9", "1e-13", "1e-7", "1e-3", "0.05", "0.5"]


def row(n, backscatter, x):
    # The constants as the doubles that the code receives.
    n, backscatter, x = mpf(float(n)), mpf(float(backscatter)), mpf(float(x))
    d180 = 4 / (3 * (n - 1) ** 2)
    nu = -log(1 + 2 * backscatter * (d180 / 2 - 1)) / log(d180 / 2)
    d = d180 * x
    cos = 1 - 2 * x
    tail = (1 - d180**nu) / ((d180 - 1) * d180**nu)
    p = (nu * (1 - d) - (1 - d**nu) + (d * (1 - d**nu) - nu * (1 - d)) / x) / (4 * pi * (1 - d) ** 2 * d**nu)
    p += tail / (16 * pi) * (3 * cos**2 - 1)
    cdf = ((1 - d ** (nu + 1)) - (1 - d**nu) * x) / ((1 - d) * d**nu) + tail / 8 * cos * 4 * x * (1 - x)
    return p, cdf, 1 - cdf


def main():
    with open("ff_wide.csv", "w") as out:
        out.write("n,B,x,p_per_sr,cdf,ccdf\n")
        for n in INDICES:
            d180 = 4 / (3 * (float(n) - 1) ** 2)
            near = [repr((1 + float(e)) / d180) for e in NEAR_ONE if (1 + float(e)) / d180 < 1]
            for backscatter in FRACTIONS:
                for x in PLACES + near:
                    p, cdf, ccdf = (mp.nstr(v, 17) for v in row(n, backscatter, x))
                    out.write(f"{n},{backscatter},{x},{p},{cdf},{ccdf}\n")


if __name__ == "__main__":
    main()
