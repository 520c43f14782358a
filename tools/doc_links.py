"""Checks links of the documentation: files, anchors, pictures, and that the book has every page.

    python3 tools/doc_links.py            # all Markdown files of the repository; exit 1 and a line for each that leads nowhere

Links to other machines are not followed.
"""

import sys
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


def main() -> int:
    pages = markdown.tracked_pages()
    problems = [problem for page in pages for problem in problems_of_page(page, markdown.ROOT)]
    problems += problems_of_book(markdown.ROOT / "docs" / "SUMMARY.md")
    for problem in problems:
        print(problem, file=sys.stderr)
    print(f"{len(pages)} pages, {len(problems)} links that lead nowhere")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
