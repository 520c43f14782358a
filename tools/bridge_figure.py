"""Draws the three panels of docs/pictures/bridge.svg, which docs/transport.md explains.

    python3 tools/bridge_figure.py docs/pictures/bridge.svg

Left: a scattering vertex joined straight to a lamp. Middle: a random walk of four scatterings, scaled and turned so that it ends on the lamp.
Right: one path of backscatter and the ways in which it can be made.
"""

import cmath
import math
import random
import sys

WIDTH, HEIGHT, PANEL = 960, 270, 320
CAMERA, LAMP, TARGET = complex(34, 150), complex(60, 60), complex(286, 130)
WATER, WALK, BRIDGE, LIGHT = "#eaf4f8", "#555555", "#0b6fa4", "#e0a100"


def line(points, colour, width=2.0, dashes=""):
    """A polyline through complex points."""
    shown = " ".join(f"{p.real:.1f},{p.imag:.1f}" for p in points)
    dash = f' stroke-dasharray="{dashes}"' if dashes else ""
    return f'<polyline points="{shown}" fill="none" stroke="{colour}" stroke-width="{width}"{dash} stroke-linejoin="round"/>'


def dots(points, colour):
    """A dot on every vertex."""
    return "".join(f'<circle cx="{p.real:.1f}" cy="{p.imag:.1f}" r="3.4" fill="{colour}"/>' for p in points)


def words(at, text, colour="#222222", anchor="middle", size=13):
    """A line of text."""
    return f'<text x="{at.real:.1f}" y="{at.imag:.1f}" fill="{colour}" font-size="{size}" text-anchor="{anchor}">{text}</text>'


def stage(title, target=True):
    """Water, camera, lamp and target of a panel."""
    parts = [f'<rect x="4" y="4" width="{PANEL - 8}" height="{HEIGHT - 8}" rx="8" fill="{WATER}"/>', words(complex(PANEL / 2, 26), title, size=14)]
    parts.append(f'<rect x="{CAMERA.real - 18:.0f}" y="{CAMERA.imag - 10:.0f}" width="18" height="20" rx="3" fill="#333333"/>')
    parts.append(f'<circle cx="{LAMP.real:.0f}" cy="{LAMP.imag:.0f}" r="8" fill="{LIGHT}"/>')
    parts += [words(CAMERA + 32j, "camera"), words(LAMP + 25j, "lamp")]
    if target:
        parts.append(f'<rect x="{TARGET.real:.0f}" y="60" width="12" height="170" fill="#a55a3c"/>')
    return parts


def walk(count, seed):
    """Vertices of a random walk of `count` scatterings by small angles, from 0 with its first step along +1."""
    chance = random.Random(seed)
    points, at, direction = [0j], 0j, 1 + 0j
    for _ in range(count + 1):
        at += direction * -math.log(1.0 - chance.random())
        points.append(at)
        direction *= cmath.exp(1j * chance.gauss(0.0, 0.55))
    return points


def straight_joint():
    """Why sampling a lamp directly fails."""
    vertex = complex(196, 142)
    parts = stage("Joined straight to the lamp")
    parts += [line([CAMERA, vertex], WALK), line([vertex, LAMP], "#b03030", dashes="5 4"), dots([vertex], WALK)]
    parts += [line([vertex, vertex + 44], "#999999", 1.2, "2 3"), words(vertex + 34 - 22j, "angle given", "#b03030")]
    parts.append(words(complex(PANEL / 2, 252), "the angle was not drawn: infinite variance", size=11))
    return parts


def bridge():
    """A walk and what becomes of it."""
    parts = stage("A bridge of four scatterings")
    drawn = walk(4, 6)
    start = TARGET
    scale = 38.0
    loose = [start - scale * p * cmath.exp(-0.45j) for p in drawn]
    onto = (LAMP - start) / (loose[-1] - start)
    joined = [start + onto * (p - start) for p in loose]
    parts += [line(loose, "#999999", 1.5, "4 4"), dots(loose[1:-1], "#999999"), line([CAMERA, start], WALK)]
    parts += [line(joined, BRIDGE, 2.4), dots(joined[1:-1], BRIDGE)]
    parts += [words(loose[-1] + 34 - 6j, "drawn", "#777777"), words(sum(joined) / len(joined) + 24j, "scaled and turned", BRIDGE)]
    parts.append(words(complex(PANEL / 2, 252), "its angles stay: all phase values cancel", size=11))
    return parts


def backscatter():
    """One path, made by techniques 1 to 3."""
    parts = stage("Backscatter: one path, three ways")
    path = [CAMERA, complex(120, 146), complex(188, 132), complex(222, 100), LAMP]
    for shift, split in ((0, 1), (34, 2), (68, 3)):
        moved = [p + 1j * (shift if 0 < n < 4 else 0) * 0.55 for n, p in enumerate(path)]
        parts += [line(moved[: split + 1], WALK), line(moved[split:], BRIDGE, 2.0, "6 4"), dots(moved[1 : split + 1], WALK), dots(moved[split + 1 : 4], BRIDGE)]
        parts.append(words(moved[3] + 14 + 4j, f"m = {split}", anchor="start", size=12))
    parts.append(words(complex(PANEL / 2, 252), "grey: walk from the camera, dashed: bridge", size=11))
    return parts


def main() -> int:
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    panels = "".join(
        f'<g transform="translate({n * PANEL}, 0)">{"".join(parts)}</g>' for n, parts in enumerate((straight_joint(), bridge(), backscatter()))
    )
    text = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" '
        f'font-family="sans-serif"><rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>{panels}</svg>\n'
    )
    with open(sys.argv[1], "w", encoding="utf-8") as out:
        out.write(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
