"""Advice is that of the daemon to the same questions."""

import base64
import json
import pathlib
import re
import subprocess
import tempfile
import threading
import unittest

import numpy as np
import uwguide
from programs import PROGRAMS, a_picture, uw

HERE = {"depth_m": 3.0, "distance_m": 1.0, "light_pct": 20.0}
SEEN = {"mean": [41.0, 88.0, 79.0], "std": [4.0, 6.3, 6.1]}
# What differs from one answer to the next.
OF_THE_MOMENT = ("id", "ok", "elapsed_us")


class Daemon:
    """The program `uwguide` on a port of its own."""

    def __init__(self, *arguments):
        command = [PROGRAMS / "uwguide", *map(str, arguments), "--listen", "127.0.0.1:0"]
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        for line in self.process.stderr:
            found = re.search(r"listening on 127\.0\.0\.1:(\d+)", line)
            if found:
                self.port = int(found[1])
                break
        # What else it says must not fill the pipe.
        self.rest = threading.Thread(target=self.process.stderr.read)
        self.rest.start()

    def __enter__(self):
        return uwguide.Client("127.0.0.1", self.port)

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()
        self.rest.join()
        self.process.stderr.close()


def timeless(reply):
    return {name: value for name, value in reply.items() if name not in OF_THE_MOMENT}


class Advice(unittest.TestCase):
    def same(self, guide, client, op, **fields):
        ours = guide.request(op, **fields)
        self.assertEqual(timeless(ours), timeless(client.request(op, **fields)))
        return ours

    def test_by_a_network_as_the_daemon(self):
        guide = uwguide.Guide(profile="1C")
        with Daemon("--profile", "1C") as client, client:
            advice = guide.suggest(**HERE, **SEEN)
            self.assertEqual(timeless(advice), timeless(client.suggest(**HERE, **SEEN)))
            self.assertEqual((advice["valid"], advice["action"]), (True, "move"))
            self.assertIsInstance(advice["predicted_contrast"], list)
            tracking = {"preset": "tracking"}
            self.same(guide, client, "suggest", **HERE, **SEEN, objective=tracking)
            self.same(guide, client, "predict", **HERE, **SEEN, candidates=[[1.0, 20.0], [2.0, 60.0]])
            self.same(guide, client, "suggest", **{**HERE, "light_pct": 90.0}, **SEEN)
            aiming = uwguide.Guide(profile="1C", objective=tracking)
            theirs = client.suggest(**HERE, **SEEN, objective=tracking)
            self.assertEqual(timeless(aiming.suggest(**HERE, **SEEN)), timeless(theirs))
            self.assertEqual(guide.info()["profile"], client.info()["profile"])
            self.state(guide, client)
            self.refusals(guide, client)

    def state(self, guide, client):
        for of in (guide, client):
            of.state(depth_m=2.5, light_pct=40.0)
        ours, theirs = (of.suggest(distance_m=1.4, **SEEN) for of in (guide, client))
        for name in ("distance_m", "light_pct", "score", "valid", "reason"):
            self.assertEqual(ours[name], theirs[name], name)

    def refusals(self, guide, client):
        wrong = [
            {"depth_m": 40.0},
            {"depth_m": "deep"},
            {"light_pct": 120.0},
            {"mean": [1.0, 2.0]},
            {"objective": {"preset": "best"}},
            {"dephts_m": 3.0},
        ]
        for field in wrong:
            with self.subTest(field), self.assertRaises(uwguide.Refused) as refused:
                client.suggest(**{**HERE, **SEEN, **field})
            with self.subTest(field), self.assertRaises(ValueError) as raised:
                guide.suggest(**{**HERE, **SEEN, **field})
            self.assertEqual(str(raised.exception), str(refused.exception))

    def test_of_pictures_as_the_daemon(self):
        # As large as those of the default model.
        picture = a_picture(720, 1280)
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            file, config = folder / "picture.png", folder / "config.toml"
            uwguide.save(file, picture)
            config.write_text(f'format = "uwguide-config/1"\n[images]\ndirectory = "{folder}"\n')
            with Daemon("--profile", "1C", "--config", config) as client, client:
                theirs = timeless(client.suggest_image("picture.png", **HERE))
            guide = uwguide.Guide("default", uwguide.Profile.from_file("1C"))
            self.assertEqual(timeless(guide.suggest(file, **HERE)), theirs)
            self.assertEqual(timeless(guide.suggest(picture, **HERE)), theirs)
            self.assertEqual((theirs["width"], theirs["height"]), (1280, 720))
            np.testing.assert_allclose(theirs["std"], uwguide.contrast(picture), atol=0.006)

    def test_by_physics_as_the_daemon(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            vehicle, water, picture = folder / "small.toml", folder / "water.json", folder / "picture.png"
            vehicle.write_text('format = "uw-vehicle/1"\nwidth = 120\nheight = 72\n')
            tables = ["--views", "3", "--kilo-paths", "8", "--depths-m", "3", "--vehicle", vehicle]
            uw("water-tables", "--jerlov", "1C", "-o", water, *tables)
            profile = folder / "profile.json"
            plain = json.loads(uwguide.Profile.from_file("1C").to_json())
            for section in ("camera", "sensor", "lamps"):
                plain.pop(section, None)
            profile.write_text(json.dumps(plain))
            uwguide.save(picture, a_picture())
            sent = {"base64_png": base64.b64encode(picture.read_bytes()).decode()}
            guides = (
                uwguide.Guide(water=water, profile=profile),
                uwguide.Guide(water=uwguide.Water.from_file(water), profile=plain),
            )
            with Daemon("--water", water, "--profile", profile) as client, client:
                theirs = timeless(client.request("suggest_image", image=sent, **HERE))
                self.assertEqual(theirs["predictor"], "physics")
                for guide in guides:
                    self.assertEqual(timeless(guide.suggest(picture, **HERE)), theirs)
            self.of_a_lens(folder, (vehicle, water, profile), theirs)

    def test_in_the_dark_without_a_profile(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            vehicle, water, picture, config = (folder / name for name in ("small.toml", "water.json", "picture.png", "config.toml"))
            vehicle.write_text('format = "uw-vehicle/1"\nwidth = 120\nheight = 72\n')
            uw("water-tables", "--jerlov", "1C", "-o", water, "--views", "3", "--kilo-paths", "8", "--dark", "--vehicle", vehicle)
            uwguide.save(picture, a_picture())
            config.write_text(f'format = "uwguide-config/1"\n[images]\ndirectory = "{folder}"\n[objective]\npreset = "tracking"\n')
            here = {**HERE, "depth_m": 400.0, "light_pct": 100.0}
            with Daemon("--water", water, "--no-profile", "--config", config) as client, client:
                theirs = timeless(client.suggest_image("picture.png", **here))
            self.assertNotEqual(theirs["reason"], "no_profile")
            self.assertIsNotNone(theirs["predicted_here"])
            guide = uwguide.Guide(water=water, objective={"preset": "tracking"})
            self.assertEqual(timeless(guide.suggest(picture, **here)), theirs)
            self.assertEqual(uwguide.Guide(water=water).suggest(picture, **here)["reason"], "no_profile")

    def of_a_lens(self, folder, files, ideal):
        """Pictures of a camera with more pixels and a frame before it, as the daemon reads them and as those of the ideal camera."""
        vehicle, water, profile = files
        camera, mask, lens, stored = folder / "camera.toml", folder / "mask.toml", folder / "lens.json", folder / "stored.png"
        camera.write_text(
            'format = "uw-scene/1"\n[camera]\nposition_m = [0, 0, 0]\nforward = [1, 0, 0]\nhfov_deg = 60\nwidth = 240\nheight = 144\n'
        )
        mask.write_text('format = "uw-mask/1"\nwidth = 240\nheight = 144\n[[polygon]]\npoints = [[0, 120], [24, 120], [24, 144], [0, 144]]\n')
        uw("undistortion", camera, "--vehicle", vehicle, "-o", lens)
        larger = a_picture().repeat(2, axis=0).repeat(2, axis=1)
        larger[120:, :24] = 250
        uwguide.save(stored, larger)
        config = folder / "config.toml"
        config.write_text(f'format = "uwguide-config/1"\n[images]\ndirectory = "{folder}"\nundistortion = "{lens}"\nmask = "{mask}"\n')
        with Daemon("--water", water, "--profile", profile, "--config", config) as client, client:
            theirs = client.suggest_image("stored.png", **HERE)
        guide = uwguide.Guide(water=water, profile=profile, camera=camera, mask=mask)
        own = guide.suggest(stored, **HERE)
        self.assertEqual((own["width"], own["height"]), (120, 72))
        np.testing.assert_allclose(own["std"], theirs["std"], atol=0.02)
        # Whether pixels next to the mask touch it hangs on the last digits of the fields of view.
        np.testing.assert_allclose(own["mean"], theirs["mean"], atol=0.2)
        np.testing.assert_allclose(own["mean"], ideal["mean"], atol=1)
        with self.assertRaisesRegex(ValueError, "must have the mask's 240 x 144 pixels"):
            guide.suggest(a_picture(), **HERE)
        with self.assertRaisesRegex(ValueError, "none.toml"):
            uwguide.Guide(water=water, profile=profile, camera="none.toml")

    def test_numbers_may_be_of_numpy(self):
        guide = uwguide.Guide(profile="1C")
        state = {name: np.float32(value) for name, value in HERE.items()}
        seen = {name: np.array(value) for name, value in SEEN.items()}
        plain = guide.suggest(**HERE, **SEEN)
        self.assertEqual(timeless(guide.suggest(**state, **seen)), timeless(plain))

    def test_what_cannot_be_used_is_told(self):
        guide = uwguide.Guide(profile="1C")
        with self.assertRaises(ValueError):
            guide.suggest(**{**HERE, "depth_m": float("nan")}, **SEEN)
        with self.assertRaisesRegex(ValueError, "cannot be sent"):
            guide.suggest(**{**HERE, "depth_m": object()}, **SEEN)
        with self.assertRaisesRegex(ValueError, "no.png: cannot be read"):
            guide.suggest("no.png", **HERE)
        with self.assertRaisesRegex(ValueError, "image must be uint8, got float64"):
            guide.suggest(np.zeros((20, 20, 3)), **HERE)
        for arguments, text in (
            ({"model": "no_model"}, '"no_model" is neither a file nor one of the shipped models: '),
            ({"model": "no.json"}, "no.json: cannot be read"),
            ({"profile": "no_profile"}, "is neither a file nor one of the shipped profiles: "),
            ({"profile": {"format": "uw-profile/1"}}, "profile: "),
            ({"profile": 3}, "profile must be a Profile, a path, a name or a dictionary, got 3"),
            ({"model": "default", "water": "w.json"}, "model and water must not be given both"),
            ({"water": "no.json"}, "no.json: cannot be read"),
            ({"model": "shipped:profiles/1C.json"}, "this is a calibration profile"),
        ):
            with self.subTest(text), self.assertRaisesRegex(ValueError, text):
                uwguide.Guide(**arguments)
        self.assertEqual(uwguide.Guide().suggest(**HERE, **SEEN)["reason"], "no_profile")


if __name__ == "__main__":
    unittest.main()
