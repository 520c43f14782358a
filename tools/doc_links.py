"""Checks links of the documentation: files, anchors, pictures, and that the book has every page.

    python3 tools/doc_links.py                       # all Markdown files of the repository; exit 1 and a line for each that leads nowhere
    python3 tools/doc_links.py --book target/book    # the pages that mdBook made of them

Links to other machines are not followed.
"""

import argparse
import re
import sys
from html import unescape
from pathlib import Path
from typing import List
from urllib.parse import unquote

import doc_markdown as markdown

ELSEWHERE = ("http://", "https://", "mailto:")


def problems_of_page(page: Path, root: Path) -> List[str]:
    """A line for every link of `page` that leads nowhere."""
    text = page.read_text(encoding="utf-8")
    name = page.relative_to(root)
    found = []
    for line, _, target in markdown.links(text):
        if target.startswith(ELSEWHERE):
            continue
        path, _, anchor = target.partition("#")
        goal = (page.parent / unquote(path)).resolve() if path else page
        if not goal.exists():
            found.append(f"{name}:{line}: there is no {target}")
        elif root not in goal.parents and goal != root:
            found.append(f"{name}:{line}: {target} leads out of the repository")
        elif anchor and (goal.suffix != ".md" or anchor not in markdown.anchors(goal.read_text(encoding="utf-8"))):
            found.append(f"{name}:{line}: {goal.relative_to(root)} has no heading with the anchor #{anchor}")
    return found


def problems_of_book(summary: Path) -> List[str]:
    """A line for every page beside or below `summary` that it does not list, or lists twice."""
    folder = summary.parent
    listed = [(folder / target).resolve() for _, _, target in markdown.links(summary.read_text(encoding="utf-8"))]
    found = [f"{summary.name}: lists {page.name} twice" for page in sorted(set(listed)) if listed.count(page) > 1]
    for page in sorted(folder.rglob("*.md")):
        if page != summary and page.resolve() not in listed:
            found.append(f"{summary.name}: does not list {page.relative_to(folder)}")
    return found


def problems_of_html(book: Path) -> List[str]:
    """A line for every link, picture or script of the made book that is not in it; the page for wrong addresses is left out."""
    texts = {page.resolve(): page.read_text(encoding="utf-8") for page in sorted(book.rglob("*.html")) if page.name != "404.html"}
    names = {page: set(re.findall(r'\bid="([^"]*)"', text)) for page, text in texts.items()}
    found = []
    for page, text in texts.items():
        for target in map(unescape, re.findall(r'\b(?:href|src)="([^"]*)"', text)):
            path, _, anchor = target.partition("#")
            goal = (page.parent / unquote(path)).resolve() if path else page
            if target.startswith((*ELSEWHERE, "data:")):
                continue
            if not goal.exists():
                found.append(f"{page.relative_to(book.resolve())}: there is no {target}")
            elif anchor and goal in names and unquote(anchor) not in names[goal]:
                found.append(f"{page.relative_to(book.resolve())}: there is no anchor {target}")
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--book", type=Path, help="folder that `mdbook build` has written")
    book = parser.parse_args().book
    if book is None:
        pages = markdown.all_pages()
        problems = [problem for page in pages for problem in problems_of_page(page, markdown.ROOT)]
        problems += problems_of_book(markdown.ROOT / "docs" / "SUMMARY.md")
    else:
        pages = list(book.rglob("*.html"))
        problems = problems_of_html(book)
        if not pages:
            problems.append(f"{book}: there are no pages")
    for problem in problems:
        print(problem, file=sys.stderr)
    print(f"{len(pages)} pages, {len(problems)} links that lead nowhere")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
