"""Pictures for `uwguide --ros2` at a steady rate: how many are answered, how soon, and what memory it takes.

    python3 soak_ros2.py SECONDS [RATE_HZ [raw|bayer]]

JPEG, or pixels: `raw` in colour, `bayer` behind a filter. Needs what `test_ros2.py` needs.
"""

import io
import pathlib
import struct
import sys
import tempfile
import threading
import time

from PIL import Image

from test_ros2 import Float64, Messages, Peer, Program, RawImage, picture, pixels


def memory_mib(process):
    """What a process has in memory now, and at most had."""
    with open(f"/proc/{process.pid}/status", encoding="ascii") as status:
        numbers = dict(line.split(":") for line in status)
    return [int(numbers[name].split()[0]) / 1024 for name in ("VmRSS", "VmHWM")]


def jpeg():
    """A picture as cameras send it."""
    file = io.BytesIO()
    Image.open(io.BytesIO(picture())).save(file, "JPEG", quality=90)
    return file.getvalue()


def behind_filter():
    """A picture as a sensor has it."""
    rows = pixels()
    samples = rows[..., 1].copy()
    samples[::2, ::2], samples[1::2, 1::2] = rows[::2, ::2, 0], rows[1::2, 1::2, 2]
    return samples


def encoded_once(image):
    """Encoded once but for its stamp: Python takes longer for that than the program for an answer."""
    encoded = bytearray(image.serialize())

    def serialize(**_):
        # Behind the four bytes that name the encoding.
        struct.pack_into("<iI", encoded, 4, image.sec, image.nanosec)
        return bytes(encoded)

    image.serialize = serialize
    return image


def main():
    seconds, rate_hz = float(sys.argv[1]), float(sys.argv[2]) if len(sys.argv) > 2 else 30.0
    messages = Messages()
    image, settings, named = messages.image(jpeg()), "", {}
    if sys.argv[3:]:
        of = {"raw": (pixels(), "rgb8"), "bayer": (behind_filter(), "bayer_rggb8")}
        image, settings = messages.raw(*of[sys.argv[3]]), 'image_type = "sensor_msgs/msg/Image"'
        named = {"image": ("rt/camera/image_raw", RawImage)}
    encoded_once(image)
    sent, took = {}, []
    with tempfile.TemporaryDirectory() as folder, Program(folder, settings=settings) as program:
        peer = Peer(program.domain_id, **named)
        depth = peer.depth(Float64)
        peer.wait(peer.range, peer.light, peer.image, depth)
        stop = threading.Event()

        def listen():
            while not stop.is_set():
                for made in peer.suggestions.take(N=10):
                    if (made.sec, made.nanosec) in sent:
                        took.append((time.time_ns() - made.sec * 10**9 - made.nanosec) / 1e6)
                time.sleep(0.001)

        listener = threading.Thread(target=listen)
        listener.start()
        begun = time.monotonic()
        number, resident = 0, []
        while number < seconds * rate_hz:
            time.sleep(max(0.0, begun + number / rate_hz - time.monotonic()))
            if number % 3 == 0:
                peer.range.write(messages.range(0.75))
                depth.write(messages.number(3.0))
                peer.light.write(messages.number(20.0))
            image.sec, image.nanosec = divmod(time.time_ns(), 10**9)
            sent[image.sec, image.nanosec] = True
            peer.image.write(image)
            if number % int(10 * rate_hz) == 0:
                resident.append(memory_mib(program.process))
            number += 1
        lasted_s = time.monotonic() - begun
        time.sleep(2)
        stop.set()
        listener.join()
        used_s = sum(float(n) for n in open(f"/proc/{program.process.pid}/stat", encoding="ascii").read().split()[13:15]) / 100
        resident.append(memory_mib(program.process))
        warnings = [line for line in (pathlib.Path(folder) / "log").read_text().splitlines() if "WARN" in line.upper()]
    took.sort()
    at = [took[int(share * (len(took) - 1))] for share in (0.5, 0.99, 1.0)] if took else []
    print(f"{len(image.data) / 1024:.0f} KiB a picture, {number} sent at {rate_hz:g} Hz, {len(took)} answered")
    print("latency, ms: median {:.1f}, 99 % {:.1f}, largest {:.1f}".format(*at))
    now = [pair[0] for pair in resident]
    print(f"memory, MiB: {now[0]:.0f} at first, {now[len(now) // 2]:.0f} half-way, {now[-1]:.0f} at the end; most {resident[-1][1]:.0f}")
    print(f"warnings: {len(warnings)}", *warnings[:5], sep="\n  ")
    print(f"{number / lasted_s:.1f} Hz in fact; processor: {used_s / lasted_s:.2f} of one")


if __name__ == "__main__":
    main()
