"""The same view in daylight at three depths, in three bands and by wavelength, with one white balance for both.

Rows are depths of 5, 10 and 20 m, left in three bands, right by wavelength. Gains and exposure of a row make the mean of the
right picture grey, so that what differs is what three bands get wrong: needs numpy.

python3 tools/spectra/depth_figure.py [--uw target/release/uw] [--spp 512] SCENE.toml OUT.png
"""

import argparse
import pathlib
import struct
import subprocess
import tempfile
import zlib

import numpy

DEPTHS_M = (5.0, 10.0, 20.0)
MEAN_GREY = 0.25


def chunks(data):
    at = 8
    while at < len(data):
        (size,) = struct.unpack(">I", data[at : at + 4])
        yield data[at + 4 : at + 8], data[at + 8 : at + 8 + size]
        at += 12 + size


def read_png16(path):
    """Height x width x 3 of a 16-bit RGB picture that is not interlaced."""
    parts = list(chunks(pathlib.Path(path).read_bytes()))
    width, height, bits, colour = struct.unpack(">IIBB", dict(parts)[b"IHDR"][:10])
    assert (bits, colour) == (16, 2), (bits, colour)
    raw = zlib.decompress(b"".join(body for kind, body in parts if kind == b"IDAT"))
    stride, step = 6 * width, 6
    above, rows = bytearray(stride), []
    for y in range(height):
        kind, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
        for i in range(stride):
            left = row[i - step] if i >= step else 0
            corner = above[i - step] if i >= step else 0
            paeth = min((abs(above[i] - corner), 0, left), (abs(left - corner), 1, above[i]),
                        (abs(left + above[i] - 2 * corner), 2, corner))[2]
            row[i] = (row[i] + (0, left, above[i], (left + above[i]) // 2, paeth)[kind]) & 255
        rows.append(bytes(row))
        above = row
    return numpy.frombuffer(b"".join(rows), ">u2").reshape(height, width, 3) / 65535.0


def write_png8(path, picture):
    height, width, _ = picture.shape
    raw = b"".join(b"\0" + row.tobytes() for row in picture)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n")
        for kind, body in ((b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)),
                           (b"IDAT", zlib.compress(raw, 9)), (b"IEND", b"")):
            file.write(struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body)))


def render(args, bands, depth_m, folder):
    """Linear picture; red is brought up before it is written in 16 bits."""
    out = f"{folder}/{bands}.png"
    red = 2.0 ** (depth_m / 2.0)
    sensor = f'{{ exposure = 2.0, white_balance = [{red}, 1.0, 1.0], encoding = "linear", bits = 16 }}'
    settings = {"surface.height_m": depth_m - 3.0, "lamp.lamp.level_pct": 0, "water.bands": bands, "sensor": sensor}
    command = [args.uw, "render", args.scene, "-o", out, "--spp", str(args.spp), "--quiet"]
    for field, value in settings.items():
        command += ["--set", f"{field}={value}"]
    subprocess.run(command, check=True)
    return read_png16(out) / (red, 1.0, 1.0)


def srgb(linear):
    linear = numpy.clip(linear, 0.0, 1.0)
    return numpy.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", help="scene whose camera is at z = -3 m and whose lamp is called lamp")
    parser.add_argument("out", help="picture to write")
    parser.add_argument("--uw", default="target/release/uw", help="the program")
    parser.add_argument("--spp", type=int, default=512, help="samples per pixel")
    args = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for depth_m in DEPTHS_M:
            mean, spectral = (render(args, bands, depth_m, folder) for bands in ("mean", "spectral"))
            grey = spectral.mean(axis=(0, 1))
            print(f"{depth_m:g} m: spectral/mean {grey / mean.mean(axis=(0, 1))}, gains {grey[1] / grey}")
            pair = [srgb(picture * MEAN_GREY / grey) for picture in (mean, spectral)]
            gap = numpy.ones((pair[0].shape[0], 4, 3))
            rows += [numpy.concatenate([pair[0], gap, pair[1]], axis=1), numpy.ones((4, 2 * pair[0].shape[1] + 4, 3))]
    write_png8(args.out, numpy.rint(255 * numpy.concatenate(rows[:-1])).astype(numpy.uint8))


if __name__ == "__main__":
    main()
