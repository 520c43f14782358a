"""Links and anchors of the documentation: what is found, and what is told to lead nowhere."""

import tempfile
import unittest
from pathlib import Path

import doc_book
import doc_links
import doc_markdown as markdown

PAGE = """# The daemon `uwguide`

See [units](units.md#counts-and-light), [here](#the-daemon-uwguide) and
[a text that
is wrapped](other.md). Code such as `a[i](x)` is no link.

```sh
echo "[neither](is-this)"
```

## Twice
## Twice
"""


class Markdown(unittest.TestCase):
    def test_links_stand_outside_of_code_and_may_be_wrapped(self):
        found = [(line, target) for line, _, target in markdown.links(PAGE)]
        self.assertEqual(found, [(3, "units.md#counts-and-light"), (3, "#the-daemon-uwguide"), (4, "other.md")])

    def test_anchors_are_those_of_github_and_mdbook(self):
        self.assertEqual(markdown.anchors(PAGE), ["the-daemon-uwguide", "twice", "twice-1"])
        self.assertEqual(markdown.slug("3. Command line `uw`"), "3-command-line-uw")
        self.assertEqual(markdown.slug("What a camera's processing takes off"), "what-a-cameras-processing-takes-off")
        self.assertEqual(markdown.slug("[Shown](link.md) text_kept"), "shown-text_kept")

    def test_an_unfinished_fence_is_a_block(self):
        self.assertEqual(markdown.split("~~~sh\na\nb")[0], [markdown.Block(2, ["sh"], ["a", "b"])])


class Links(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name).resolve()
        (self.root / "docs").mkdir()

    def write(self, name, text):
        path = self.root / name
        path.write_text(text, encoding="utf-8")
        return path

    def test_what_leads_nowhere_is_told_with_its_line(self):
        self.write("docs/units.md", "# Units\n## Counts and light\n")
        page = self.write("docs/page.md", PAGE)
        self.assertEqual(doc_links.problems_of_page(page, self.root), ["docs/page.md:4: there is no other.md"])
        self.write("docs/units.md", "# Units\n")
        self.write("docs/other.md", "")
        told = doc_links.problems_of_page(page, self.root)
        self.assertEqual(told, ["docs/page.md:3: docs/units.md has no heading with the anchor #counts-and-light"])

    def test_a_link_out_of_the_repository_is_told(self):
        page = self.write("docs/page.md", "[up](../..) and [web](https://example.org/none)")
        self.assertEqual(doc_links.problems_of_page(page, self.root), ["docs/page.md:1: ../.. leads out of the repository"])

    def test_the_book_has_every_page_once(self):
        self.write("docs/one.md", "")
        self.write("docs/two.md", "")
        summary = self.write("docs/SUMMARY.md", "- [One](one.md)\n- [One](one.md)\n")
        self.assertEqual(
            doc_links.problems_of_book(summary), ["SUMMARY.md: lists one.md twice", "SUMMARY.md: does not list two.md"]
        )

    def test_the_made_book_is_followed_from_page_to_page(self):
        (self.root / "howto").mkdir()
        self.write("howto/index.html", '<a href="../page.html#here">x</a><a href="#none">y</a><img src="gone.png"><a href="https://x.org">z</a>')
        self.write("page.html", '<h2 id="here">Here</h2><a href="howto/README.html">w</a>')
        self.assertEqual(
            doc_links.problems_of_html(self.root),
            ["howto/index.html: there is no anchor #none", "howto/index.html: there is no gone.png", "page.html: there is no howto/README.html"],
        )

    def test_the_books_of_this_repository_hold_together(self):
        for page in markdown.all_pages():
            self.assertEqual(doc_links.problems_of_page(page, markdown.ROOT), [])
        self.assertEqual(doc_links.problems_of_book(markdown.ROOT / "docs" / "SUMMARY.md"), [])


class Book(unittest.TestCase):
    def test_only_links_out_of_the_book_become_text(self):
        text = "[a](units.md) [`x/y.md`](../../x/y.md) [models](../../assets/README.md#sizes) ![p](../pictures/p.png)\n```\n[b](../../c)\n```"
        self.assertEqual(
            doc_book.without_links_out("howto/page.md", text),
            "[a](units.md) `x/y.md` models (`assets/README.md`) ![p](../pictures/p.png)\n```\n[b](../../c)\n```",
        )

    def test_chapters_below_chapters_are_changed_too(self):
        inner = {"Chapter": {"content": "[r](../README.md)", "path": "a.md", "source_path": "a.md", "sub_items": []}}
        outer = {"Chapter": {"content": "", "path": None, "source_path": None, "sub_items": [inner]}}
        doc_book.walk([outer, "Separator", {"PartTitle": "Numbers"}])
        self.assertEqual(inner["Chapter"]["content"], "r (`README.md`)")


if __name__ == "__main__":
    unittest.main()
