"""What the checks of the documentation read out of Markdown: fenced blocks, inline code, links, headings and their anchors."""

import re
from pathlib import Path
from typing import Iterator, List, NamedTuple, Tuple

ROOT = Path(__file__).resolve().parent.parent
LEFT_OUT = {".git", "target", "demo"}
FENCE = re.compile(r"^(\s*)(```+|~~~+)\s*(.*)$")
LINK = re.compile(r"!?\[((?:[^\[\]]|\[[^\[\]]*\])*)\]\(([^()\s]+)(?:\s+\"[^\"]*\")?\)")
CODE = re.compile(r"(?<!`)(`+)(?!`)(.+?)(?<!`)\1(?!`)", re.DOTALL)


class Block(NamedTuple):
    """A fenced block: number of its first line of text, words behind the fence, lines."""

    line: int
    info: List[str]
    lines: List[str]


def split(text: str) -> Tuple[List[Block], List[Tuple[int, str]]]:
    """Fenced blocks of a text, and the numbered lines that stand outside of them."""
    blocks: List[Block] = []
    prose: List[Tuple[int, str]] = []
    fence, block = None, None
    for number, line in enumerate(text.splitlines(), 1):
        found = FENCE.match(line)
        if fence is None and found:
            fence = found.group(2)
            block = Block(number + 1, found.group(3).replace(",", " ").split(), [])
        elif fence is not None and found and found.group(2).startswith(fence) and not found.group(3):
            blocks.append(block)
            fence = None
        elif fence is not None:
            block.lines.append(line)
        else:
            prose.append((number, line))
    if fence is not None:
        blocks.append(block)
    return blocks, prose


def slug(heading: str) -> str:
    """The anchor of a heading: lower case, spaces as hyphens, other punctuation gone (as GitHub and mdBook do)."""
    shown = LINK.sub(r"\1", heading)
    kept = [c for c in shown.strip().lower() if c.isalnum() or c in " -_"]
    return "".join(kept).replace(" ", "-")


def anchors(text: str) -> List[str]:
    """Anchors of all headings in their order; repeated ones have -1, -2, .. behind them."""
    found: List[str] = []
    seen = {}
    for _, line in split(text)[1]:
        heading = re.match(r"^#{1,6}\s+(.*?)\s*#*$", line)
        if heading:
            name = slug(heading.group(1))
            count = seen.get(name, 0)
            seen[name] = count + 1
            found.append(f"{name}-{count}" if count else name)
    return found


def paragraphs(text: str) -> Iterator[Tuple[int, str]]:
    """First line and text of every run of lines outside of fenced blocks without an empty one between them."""
    first, lines = 0, []
    for number, line in split(text)[1] + [(-1, "")]:
        if lines and (not line.strip() or number != first + len(lines)):
            yield first, "\n".join(lines)
            lines = []
        if line.strip():
            first = number if not lines else first
            lines.append(line)


def links(text: str) -> Iterator[Tuple[int, str, str]]:
    """Line, shown text and target of every link and picture outside of code."""
    for first, paragraph in paragraphs(text):
        for found in LINK.finditer(CODE.sub(blank, paragraph)):
            start, end = found.span(1)
            yield first + paragraph.count("\n", 0, found.start()), paragraph[start:end], found.group(2)


def blank(code: "re.Match[str]") -> str:
    """As many characters that are no link, with the same ends of lines."""
    return re.sub(r"[^\n]", "`", code.group(0))


def inline_code(text: str) -> Iterator[Tuple[int, str]]:
    """Line and content of every piece of code inside a paragraph, on one line."""
    for first, paragraph in paragraphs(text):
        for found in CODE.finditer(paragraph):
            yield first + paragraph.count("\n", 0, found.start()), " ".join(found.group(2).split())


def all_pages(root: Path = ROOT) -> List[Path]:
    """All Markdown files of the repository but those of build folders and of a demonstration."""
    pages = (page for page in root.rglob("*.md") if not LEFT_OUT & set(page.relative_to(root).parts))
    return sorted(page for page in pages if page.is_file())
