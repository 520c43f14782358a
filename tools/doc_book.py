"""Preprocessor of mdBook (book.toml): links to files outside of docs/ become text, because a book has only its own pages.

mdBook starts it, gives context and book as JSON on standard input, and reads the book from standard output.
"""

import json
import sys
from pathlib import PurePosixPath
from typing import Any, Dict

import doc_markdown as markdown


def leads_out(page: str, target: str) -> bool:
    """Whether `target`, as a link of `page` (a path inside the book), is a file outside of the book."""
    path = target.partition("#")[0]
    if not path or "://" in target or target.startswith("mailto:"):
        return False
    depth = len(PurePosixPath(page).parts) - 1
    for part in PurePosixPath(path).parts:
        depth += -1 if part == ".." else 0 if part == "." else 1
        if depth < 0:
            return True
    return False


def without_links_out(page: str, text: str) -> str:
    """The text of a page in which links that lead out are what they show, with the file's path where that is not shown."""
    def replaced(link: "markdown.re.Match[str]") -> str:
        shown, target = link.group(1), link.group(2)
        if link.group(0).startswith("!") or not leads_out(page, target):
            return link.group(0)
        path = "/".join(part for part in PurePosixPath(target.partition("#")[0]).parts if part != "..")
        bare = shown.replace("`", "").rstrip("/")
        return f"`{path}`" if bare and path.endswith(bare) else f"{shown} (`{path}`)"

    code = markdown.split(text)[0]
    inside = {block.line + n for block in code for n in range(-1, len(block.lines) + 1)}
    lines = text.split("\n")
    return "\n".join(line if n in inside else markdown.LINK.sub(replaced, line) for n, line in enumerate(lines, 1))


def walk(items: Any) -> None:
    """Changes the chapters of a book and those below them in place."""
    for item in items:
        chapter: Dict[str, Any] = item.get("Chapter") if isinstance(item, dict) else None
        if chapter:
            if chapter.get("path"):
                chapter["content"] = without_links_out(chapter["source_path"], chapter["content"])
            walk(chapter["sub_items"])


def main() -> int:
    if len(sys.argv) > 1 and sys.argv[1] == "supports":
        return 0
    _, book = json.load(sys.stdin)
    walk(book["items"] if "items" in book else book["sections"])
    json.dump(book, sys.stdout)
    return 0


if __name__ == "__main__":
    sys.exit(main())
