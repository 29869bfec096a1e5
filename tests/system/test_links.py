"""Tests of the documents: every link leads to a file or heading, the index lists each document once."""

import re
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

TOP = Path(__file__).parents[2]
INDEX = TOP / "docs/README.md"
PAGES = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md")
DOCUMENTS = [*(TOP / name for name in PAGES), *sorted((TOP / "docs").rglob("*.md"))]
FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^()\s]+)\)")


@cache
def prose_of(document):
    """Return a document without its code blocks, which contain no links and no headings."""
    return FENCE.sub("", document.read_text(encoding="utf-8"))


@cache
def anchors_of(document):
    """Return the anchors of the headings as GitHub makes them: lower case, hyphens, a number if repeated."""
    seen = Counter()
    anchors = set()
    for heading in re.findall(r"^#+ +(.+?) *$", prose_of(document), re.MULTILINE):
        words = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading)
        anchor = re.sub(r"[^\w\- ]", "", words.lower()).replace(" ", "-")
        anchors.add(f"{anchor}-{seen[anchor]}" if seen[anchor] else anchor)
        seen[anchor] += 1
    return anchors


def links_of(document):
    return [link for link in LINK.findall(prose_of(document)) if not re.match(r"[a-z]+:", link)]


def broken(document, link):
    """Return the reason why a link is broken, or "" if the link works."""
    path, _, anchor = link.partition("#")
    target = (document.parent / path).resolve() if path else document
    if not target.is_relative_to(TOP):
        return f"{link}: outside of the repository"
    if not target.exists():
        return f"{link}: no such file"
    if anchor and anchor not in anchors_of(target):
        return f"{link}: no such heading"
    return ""


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(TOP)))
def test_every_link_works(document):
    assert [why for link in links_of(document) if (why := broken(document, link))] == []


def test_a_broken_link_is_found(tmp_path):
    page = TOP / "docs/rules.md"
    assert broken(page, "no-such.md").endswith("no such file")
    assert broken(page, "rules.md#no-such").endswith("no such heading")
    assert broken(page, "../../etc").endswith("outside of the repository")
    assert broken(page, "#after-a-trip") == broken(page, "../README.md#limits-and-honesty") == ""


def test_the_index_names_each_document_once():
    named = Counter((INDEX.parent / link).resolve() for link in links_of(INDEX))
    documents = {path for path in DOCUMENTS if path.is_relative_to(TOP / "docs")} - {INDEX}
    assert {path: named[path] for path in documents} == dict.fromkeys(documents, 1)
