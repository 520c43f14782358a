"""Commands of the documentation: how blocks become commands, and what is told of one that cannot be given."""

import stat
import tempfile
import unittest
from pathlib import Path

import doc_commands

HELP = """Physically right underwater images

Usage: uw [OPTIONS] <COMMAND>

Commands:
  render  Render a scene
  help    Print this message

Options:
      --json  Errors as JSON
  -h, --help  Print help
"""

RENDER = """Render a scene

Usage: uw render [OPTIONS] --output <OUTPUT> <SCENE>

Arguments:
  <SCENE>  Scene file

Options:
  -o, --output <OUTPUT>
          Picture to write
      --backend <BACKEND>
          What runs the kernels

          [possible values: auto, cpu]
      --set <KEY=VALUE>  A value
      --quiet            No summary
  -h, --help             Print help
"""


class Shell(unittest.TestCase):
    def test_lines_that_go_on_and_here_documents_are_one_command(self):
        lines = ["# comment", 'f() { uw "$@"; }', "uw render \\", "  s.toml -o a.png", "cat > f <<'END'", "uw nonsense", "END", "uw --help"]
        self.assertEqual(
            list(doc_commands.commands(lines)),
            [(2, "uw render  s.toml -o a.png"), (4, "cat > f <<'END'"), (7, "uw --help")],
        )

    def test_a_line_is_parted_into_simple_commands(self):
        self.assertEqual(
            doc_commands.words_of("cd x && UW=1 time uw stats a.png 2> log | head # end"),
            [["cd", "x"], ["uw", "stats", "a.png"], ["head"]],
        )
        self.assertEqual(
            doc_commands.words_of("for d in 1 2; do uw render s --set 'lamp.0=[1, 2]'; done")[1:],
            [["uw", "render", "s", "--set", "lamp.0=[1, 2]"], ["done"]],
        )

    def test_programs_are_found_behind_paths_and_cargo(self):
        for text, expected in (
            ("target/release/uw render s", ("uw", ["render", "s"])),
            ("cargo run --release --bin viewer -- --light", ("viewer", ["--light"])),
            ("cargo run --release -p uw-evaluation -- phase", ("uweval", ["phase"])),
            ("cargo run --release -p uw-survey --example sun_angles", (None, [])),
            ("cargo test --release", (None, [])),
        ):
            self.assertEqual(doc_commands.program_of(text.split()), expected, text)

    def test_commands_of_a_page_stand_in_blocks_indented_and_inline(self):
        page = "Try `uw render SCENE --quiet`.\n\n    uw stats a.png\n\n```sh norun\nuw demo\n```\n```toml\nuw = 1\n```\n"
        self.assertEqual(
            list(doc_commands.shown_commands(page)),
            [(6, "uw demo", True), (3, "uw stats a.png", True), (1, "uw render SCENE --quiet", False)],
        )


class Arguments(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        program = self.folder / "uw"
        program.write_text(f"#!/bin/sh\nif [ \"$1\" = render ]; then cat <<'E'\n{RENDER}E\nelse cat <<'E'\n{HELP}E\nfi\n")
        program.chmod(program.stat().st_mode | stat.S_IXUSR)
        doc_commands.help_of.cache_clear()

    def told(self, command, whole=True):
        checker = doc_commands.Checker(self.folder, self.folder)
        return checker.problem(doc_commands.words_of(command)[0], whole)

    def test_help_tells_options_and_what_is_needed(self):
        known = doc_commands.read_help(RENDER)
        self.assertEqual(
            known.options,
            {"-o": True, "--output": True, "--backend": True, "--set": True, "--quiet": False, "-h": False, "--help": False},
        )
        self.assertEqual(known.required, ["--output"])
        self.assertEqual(doc_commands.read_help(HELP).subcommands, ["render", "help"])

    def test_what_can_be_given_passes(self):
        for command in ("uw render s.toml -o a.png --set lamp=-1", "uw --help", "uw render --help", "uw render s --output=a.png --quiet"):
            self.assertIsNone(self.told(command), command)

    def test_what_cannot_be_given_is_told(self):
        self.assertEqual(self.told("uw rendr s"), "uw has no command rendr")
        self.assertEqual(self.told("uw render s -o a --sppp 4"), "uw render has no option --sppp")
        self.assertEqual(self.told("uw render s"), "uw render needs --output")
        self.assertIsNone(self.told("uw render SCENE --quiet", whole=False))
        self.assertEqual(self.told("uw render [--sp N]", whole=False), "uw render has no option --sp")

    def test_a_value_that_looks_like_an_option_is_none(self):
        self.assertIsNone(self.told("uw render s -o a --set --sppp"))

    def test_a_program_that_is_not_there_is_counted(self):
        checker = doc_commands.Checker(self.folder, self.folder)
        self.assertIsNone(checker.problem(["uwtrain", "--nonsense"], True))
        self.assertEqual((checker.absent, checker.compared), ({"uwtrain": 1}, 0))

    def test_scripts_and_examples_have_to_be_there(self):
        self.assertEqual(self.told("python3 tools/none.py"), "there is no tools/none.py")
        self.assertEqual(self.told("cargo run -p x --example none"), "there is no example none")


class Run(unittest.TestCase):
    def test_blocks_are_given_in_order_until_one_fails(self):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            page = folder / "page.md"
            page.write_text("```sh\necho 1 > a\n```\n```sh norun\necho 3 > never\n```\n```sh\ncat a > c; false\n```\n```sh\necho 2 > b\n```\n")
            self.assertEqual(doc_commands.run(page, folder, folder), 1)
            self.assertEqual((folder / "a").read_text(), "1\n")
            self.assertTrue((folder / "c").exists())
            self.assertFalse((folder / "never").exists() or (folder / "b").exists())


if __name__ == "__main__":
    unittest.main()
