"""Checks that the commands of the documentation can be given: programs, subcommands, options and files of the repository.

    python3 tools/doc_commands.py                           # every shell block and inline `uw ..` of all Markdown files but the changelog
    python3 tools/doc_commands.py --run docs/tutorial.md    # gives the commands of a page, block after block, in an empty folder

Commands are compared with `--help` of the programs in target/release (`--programs DIR`). A program that is not there is
named and its commands are left out; with `--require uw,uwguide` that is a mistake. A block ```sh norun``` is compared but never run.
"""

import argparse
import os
import re
import resource
import shlex
import subprocess
import sys
import tempfile
import time
from functools import lru_cache
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Optional, Tuple

import doc_markdown as markdown

PROGRAMS = ("uw", "uwguide", "viewer", "uweval", "uwtrain")
PACKAGES = {"uw-survey": "uw", "uw-daemon": "uwguide", "uw-viewer": "viewer", "uw-evaluation": "uweval", "uw-training": "uwtrain"}
SHELLS = ("sh", "bash", "shell", "console")
HIDDEN = {"--share-walks"}  # options that are taken and that no help shows
OPTION = re.compile(r"^\s+(?:(-\w), )?(--[\w-]+)(?:[ =]\[?(<[^>]*>|\[[^\]]*\]))?|^\s+(-\w)(?: (<[^>]*>))?(?:\s|$)")


class Help(NamedTuple):
    """What a command's --help says: subcommands, options with whether they take a value, and the words it must have."""

    subcommands: List[str]
    options: Dict[str, bool]
    required: List[str]


def read_help(text: str) -> Help:
    """Subcommands, options and required options of a help text as clap writes it."""
    subcommands, options, section = [], {}, ""
    for line in text.splitlines():
        if line and not line[0].isspace() and line.rstrip().endswith(":"):
            section = line.strip().rstrip(":").lower()
        elif section == "commands":
            found = re.match(r"^  (\S+)(?:\s|$)", line)
            if found:
                subcommands.append(found.group(1))
        else:
            found = OPTION.match(line)
            if found:
                for name in found.group(1, 2, 4):
                    if name:
                        options[name] = bool(found.group(3) or found.group(5))
    usage = re.search(r"^Usage: (.*)$", text, re.MULTILINE)
    bare = re.sub(r"\[[^\[\]]*\]|<[^<>]*\|[^<>]*>", "", usage.group(1)) if usage else ""
    return Help(subcommands, options, re.findall(r"(?<!\S)--[\w-]+", bare))


@lru_cache(maxsize=None)
def help_of(program: Path, *subcommands: str) -> Help:
    """The help of a program or of one of its subcommands."""
    done = subprocess.run([program, *subcommands, "--help"], capture_output=True, text=True, timeout=60)
    return read_help(done.stdout)


def commands(lines: List[str]) -> Iterator[Tuple[int, str]]:
    """Commands of a shell block with the number of their first line; continued lines and here-documents are joined to it,
    comments and definitions of functions left out."""
    first, joined, end = 0, "", None
    for number, line in enumerate(lines):
        if end is not None:
            end = None if line.strip() == end else end
            continue
        first, joined = (first, joined + " " + line.strip()) if joined else (number, line.strip())
        if joined.endswith("\\"):
            joined = joined[:-1]
            continue
        here = re.search(r"<<-?\s*['\"]?(\w+)['\"]?", joined)
        end = here.group(1) if here else None
        if joined and not joined.startswith("#") and not re.match(r"^\w+\(\)\s*\{", joined):
            yield first, joined
        joined = ""


def words_of(command: str) -> List[List[str]]:
    """The simple commands that a line is made of, as words; comments, redirections and variables set before them are gone."""
    lexer = shlex.shlex(command, posix=True, punctuation_chars=";|&()<>")
    lexer.whitespace_split = True
    parts, words, skip = [], [], False
    for word in lexer:
        if set(word) <= set(";|&()"):
            parts.append(words)
            words = []
        elif set(word) <= set("<>&"):
            words = words[:-1] if words and words[-1].isdigit() else words
            skip = True
        elif skip:
            skip = False
        else:
            words.append(word)
    return [strip_leading(part) for part in parts + [words] if strip_leading(part)]


def strip_leading(words: List[str]) -> List[str]:
    """Without what stands before the program: words of loops, `time`, `sudo`, variables."""
    at = 0
    while at < len(words) and (words[at] in ("do", "then", "else", "time", "sudo", "exec", "!", "$") or re.match(r"^\w+=", words[at])):
        at += 1
    return words[at:]


def program_of(words: List[str]) -> Tuple[Optional[str], List[str]]:
    """The program of this project that a command starts, by itself or through cargo, and its arguments."""
    name = words[0].rsplit("/", 1)[-1]
    if name in PROGRAMS:
        return name, words[1:]
    if name == "cargo" and "run" in words[:3] and "--example" not in words:
        own = words[: words.index("--")] if "--" in words else words
        rest = words[words.index("--") + 1:] if "--" in words else []
        for option in ("--bin", "-p"):
            if option in own:
                chosen = own[own.index(option) + 1]
                return PACKAGES.get(chosen, chosen), rest
    return None, []


def check_arguments(program: Path, arguments: List[str], whole: bool) -> Optional[str]:
    """What is wrong with the arguments of a program, or None. Where not `whole`, words may be missing or stand for others."""
    path, known = [], help_of(program)
    while arguments and known.subcommands and not arguments[0].startswith("-"):
        if arguments[0].isupper() and not whole:
            return None
        if arguments[0] not in known.subcommands:
            return f"{' '.join([program.name, *path])} has no command {arguments[0]}"
        path.append(arguments[0])
        arguments = arguments[1:]
        known = help_of(program, *path)
    name = " ".join([program.name, *path])
    given, takes_value = set(), False
    for word in arguments:
        option = re.match(r"^\[?(--[A-Za-z][\w-]*|-[A-Za-z])(?=$|[=\]\s])", word)
        if takes_value or not option:
            takes_value = False
            continue
        if option.group(1) not in known.options and option.group(1) not in HIDDEN:
            return f"{name} has no option {option.group(1)}"
        given.add(option.group(1))
        takes_value = known.options.get(option.group(1), True) and "=" not in word and not word.endswith("]")
    if whole and not given & {"--help", "--version", "-h", "-V"}:
        short = {"-o": "--output"}
        missing = [option for option in known.required if option not in given | {short.get(g, g) for g in given}]
        if missing and known.options:
            return f"{name} needs {missing[0]}"
    return None


def check_files(words: List[str], root: Path) -> Optional[str]:
    """What is wrong with a command that names scripts, examples or benches of the repository, or None."""
    if words[0] in ("python3", "python") and len(words) > 1 and re.match(r"^(tools|deploy)/", words[1]) and not (root / words[1]).is_file():
        return f"there is no {words[1]}"
    if words[0].startswith("deploy/") and not (root / words[0]).is_file():
        return f"there is no {words[0]}"
    if words[0] == "cargo":
        for option, folder in (("--example", "examples"), ("--bench", "benches")):
            if option in words[:-1] and not list(root.glob(f"**/{folder}/{words[words.index(option) + 1]}*")):
                return f"there is no {folder[:-2] if folder == 'benches' else folder[:-1]} {words[words.index(option) + 1]}"
    return None


class Checker:
    """Compares commands with the programs in a folder; remembers which were not there."""

    def __init__(self, programs: Path, root: Path):
        self.programs, self.root = programs, root
        self.absent: Dict[str, int] = {}
        self.compared = 0

    def problem(self, words: List[str], whole: bool) -> Optional[str]:
        """What is wrong with one simple command, or None."""
        program, arguments = program_of(words)
        if program in PROGRAMS:
            if not (self.programs / program).is_file():
                self.absent[program] = self.absent.get(program, 0) + 1
                return None
            self.compared += 1
            return check_arguments(self.programs / program, arguments, whole)
        return check_files(words, self.root) if whole else None

    def page(self, page: Path) -> List[str]:
        """A line for every command of a page that cannot be given."""
        text = page.read_text(encoding="utf-8")
        name = page.relative_to(self.root)
        found = []
        for line, command, whole in shown_commands(text):
            try:
                parts = words_of(command)
            except ValueError as error:
                found.append(f"{name}:{line}: {error}: {command}")
                continue
            for words in parts:
                problem = self.problem(words, whole)
                if problem:
                    found.append(f"{name}:{line}: {problem}: {command}")
        return found


def shown_commands(text: str) -> Iterator[Tuple[int, str, bool]]:
    """Line, text and whether it is meant as it stands, of every command in shell blocks, indented code and inline code."""
    for block in markdown.split(text)[0]:
        if block.info and block.info[0] in SHELLS:
            for number, command in commands(block.lines):
                yield block.line + number, command, True
    for number, line in markdown.split(text)[1]:
        if re.match(r"^ {4}(uw|uwguide|uwtrain|uweval|viewer) ", line):
            yield number, line.strip(), True
    for number, code in markdown.inline_code(text):
        if re.match(r"^(uw|uwguide|uwtrain|uweval|viewer) -?-?[a-z]", code):
            yield number, re.sub(r"[(){}|;&<>'\"#]", " ", code), False


def processor_s() -> float:
    """Processor time of all commands that have ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run(page: Path, programs: Path, folder: Path) -> int:
    """Gives the shell blocks of a page one after the other in `folder`, with a line of time for each; the first that fails ends it."""
    environment = {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}"}
    begin, before = time.monotonic(), processor_s()
    for block in markdown.split(page.read_text(encoding="utf-8"))[0]:
        if not block.info or block.info[0] not in SHELLS or "norun" in block.info:
            continue
        start, used = time.monotonic(), processor_s()
        done = subprocess.run(["bash", "-euo", "pipefail", "-c", "\n".join(block.lines)], cwd=folder, env=environment)
        print(f"{page.name}:{block.line}: {time.monotonic() - start:.1f} s, {processor_s() - used:.1f} s of processor time, exit code {done.returncode}", flush=True)
        if done.returncode:
            return 1
    print(f"{page.name}: {time.monotonic() - begin:.1f} s in all, {processor_s() - before:.1f} s of processor time, files in {folder}")
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--programs", type=Path, default=markdown.ROOT / "target" / "release")
    parser.add_argument("--require", default="", help="programs that must be there, separated by commas")
    parser.add_argument("--run", type=Path, nargs="+", metavar="PAGE", help="give the commands of these pages")
    parser.add_argument("--folder", type=Path, help="with --run: an empty folder to work in (default: a new one for each page)")
    options = parser.parse_args()
    programs = options.programs.resolve()
    if options.run:
        return max(run(page, programs, options.folder or Path(tempfile.mkdtemp())) for page in options.run)
    checker = Checker(programs, markdown.ROOT)
    pages = [page for page in markdown.all_pages() if page.name != "CHANGELOG.md"]
    problems = [problem for page in pages for problem in checker.page(page)]
    for name in filter(None, options.require.split(",")):
        if not (programs / name).is_file():
            problems.append(f"there is no program {programs / name}")
    for problem in problems:
        print(problem, file=sys.stderr)
    for name, count in checker.absent.items():
        print(f"{count} commands of {name} not compared: it is not in {programs}")
    print(f"{checker.compared} commands compared, {len(problems)} that cannot be given")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
