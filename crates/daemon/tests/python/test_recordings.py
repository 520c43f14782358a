"""Recordings of `uwguide` read by the package `mcap` of PyPI: python3 -m unittest (in this folder).

Needs `mcap` and `jsonschema`. The program is taken from the folder UWGUIDE_PROGRAMS, else from target/release of the repository.
"""

import json
import os
import pathlib
import subprocess
import tempfile
import time
import unittest

import jsonschema
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader, make_reader

REPOSITORY = pathlib.Path(__file__).resolve().parents[4]
PROGRAM = pathlib.Path(os.environ.get("UWGUIDE_PROGRAMS", REPOSITORY / "target" / "release")) / "uwguide"
LIMIT_S = 60

STATE = {"depth_m": 3.0, "distance_m": 1.2, "light_pct": 30.0, "mean": [40.0, 80.0, 70.0], "std": [4.0, 7.0, 6.0]}
LINES = [
    b'{"op": "info"}',
    json.dumps({"op": "suggest", "id": "\u00e4", **STATE}).encode(),
    b'  {"op":"state",  "distances_m":[1.31, 1.24, null, 1.30], "depth_m":3}',
    b'{"op": "suggest", "depth_m": -3}',
    b"garbage",
    b"\xff\xfe",
    json.dumps({"op": "suggest", **STATE, "distance_m": 9.0}).encode(),
]


def record(folder, lines):
    """Asks a daemon that records; the file and the replies."""
    file = pathlib.Path(folder) / "dive.mcap"
    command = [PROGRAM, "--profile", "1C", "--stdio", "--record", file]
    asked = b"".join(line + b"\n" for line in lines)
    done = subprocess.run(command, input=asked, capture_output=True, timeout=LIMIT_S, check=True)
    return file, done.stdout.splitlines()


class Recordings(unittest.TestCase):
    """One recording, read in several ways."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.asked_s = time.time()
        cls.file, cls.replies = record(cls.folder.name, LINES)
        cls.answered_s = time.time()

    def messages(self):
        """Topic, data, time and number of all messages."""
        with self.file.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True)
            return [(channel.topic, m.data, m.log_time, m.sequence) for _, channel, m in reader.iter_messages()]

    def of(self, topic):
        return [data for name, data, _, _ in self.messages() if name == topic]

    def test_the_summary_counts_what_was_recorded(self):
        with self.file.open("rb") as stream:
            summary = make_reader(stream, validate_crcs=True).get_summary()
        counts = summary.statistics.channel_message_counts
        counts = {channel.topic: counts.get(channel.id, 0) for channel in summary.channels.values()}
        self.assertEqual(
            counts,
            {
                "/uwguide/loaded": 1,
                "/uwguide/request": 5,
                "/uwguide/unreadable": 2,
                "/uwguide/reply": 7,
                "/uwguide/entry": 7,
            },
        )

    def test_requests_and_replies_are_the_lines_of_the_protocol(self):
        readable = [line for line in LINES if line.strip().startswith(b"{")]
        self.assertEqual(self.of("/uwguide/request"), readable)
        self.assertEqual(self.of("/uwguide/reply"), self.replies)
        unreadable = [json.loads(data) for data in self.of("/uwguide/unreadable")]
        self.assertEqual(unreadable, [{"line": "garbage"}, {"line_base64": "//4="}])

    def test_what_was_advised_and_why(self):
        advice = json.loads(self.of("/uwguide/reply")[1])
        self.assertEqual((advice["valid"], advice["action"], advice["id"]), (True, "move", "\u00e4"))
        self.assertTrue(advice["why"].startswith("go "))
        refused = json.loads(self.of("/uwguide/reply")[-1])
        self.assertEqual((refused["valid"], refused["reason"]), (False, "outside_calibration"))
        loaded = json.loads(self.of("/uwguide/loaded")[0])
        self.assertEqual(loaded["settings"]["checks"]["misfit"], "refuse")
        self.assertEqual(loaded["profile"]["format"], "uw-profile/1")

    def test_times_are_those_of_the_clock_and_an_entry_has_one_number(self):
        messages = self.messages()
        for _, _, log_time, _ in messages:
            self.assertTrue(self.asked_s <= 1e-9 * log_time <= self.answered_s, log_time)
        numbers = {}
        for topic, _, _, number in messages:
            numbers.setdefault(number, []).append(topic)
        self.assertEqual(sorted(numbers), list(range(8)))
        for number in range(1, 8):
            asked = "/uwguide/unreadable" if number in (5, 6) else "/uwguide/request"
            self.assertEqual(numbers[number], [asked, "/uwguide/reply", "/uwguide/entry"])

    def test_every_message_fits_its_schema(self):
        checked = 0
        with self.file.open("rb") as stream:
            for schema, channel, message in make_reader(stream).iter_messages():
                self.assertEqual((schema.encoding, channel.message_encoding), ("jsonschema", "json"))
                rules = json.loads(schema.data)
                self.assertEqual(rules["title"], schema.name)
                jsonschema.Draft202012Validator.check_schema(rules)
                jsonschema.validate(json.loads(message.data), rules, jsonschema.Draft202012Validator)
                checked += 1
        self.assertEqual(checked, 22)

    def test_a_file_that_is_cut_is_read_up_to_its_last_chunk(self):
        whole = self.file.read_bytes()
        cut = pathlib.Path(self.folder.name) / "cut.mcap"
        # Behind the last message there are indices and the summary.
        cut.write_bytes(whole[: whole.rindex(b"elapsed_us") + 400])
        read = []
        with cut.open("rb") as stream, self.assertRaises(EndOfFile):
            for item in NonSeekingReader(stream).iter_messages(log_time_order=False):
                read.append(item)
        self.assertEqual(len(read), 22)

    def test_it_is_answered_again(self):
        command = [PROGRAM, "replay", self.file, "--model", "default"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=True)
        self.assertEqual(done.stdout, "7 replies the same, 0 different, 0 not compared\n")


if __name__ == "__main__":
    unittest.main()
