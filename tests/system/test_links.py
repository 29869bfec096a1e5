"""Where the documents point to is there: files and headings; the index names each document once."""

import re
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

TOP = Path(__file__).parents[2]
INDEX = TOP / "docs/README.md"
DOCUMENTS = [TOP / "README.md", TOP / "CHANGELOG.md", *sorted((TOP / "docs").rglob("*.md"))]
FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^()\s]+)\)")


@cache
def prose_of(document):
    """A document without what stands in fences: a link or a heading there is none."""
    return FENCE.sub("", document.read_text(encoding="utf-8"))


@cache
def anchors_of(document):
    """What GitHub calls the headings: lower case, hyphens for spaces; a repeated one gets a number."""
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
    """Why a link leads nowhere; nothing where it does not."""
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
def test_every_link_leads_somewhere(document):
    assert [why for link in links_of(document) if (why := broken(document, link))] == []


def test_a_link_that_leads_nowhere_is_seen(tmp_path):
    page = TOP / "docs/rules.md"
    assert broken(page, "no-such.md").endswith("no such file")
    assert broken(page, "rules.md#no-such").endswith("no such heading")
    assert broken(page, "../../etc").endswith("outside of the repository")
    assert broken(page, "#after-a-trip") == broken(page, "../README.md#a-real-rig") == ""


def test_the_index_names_each_document_once():
    named = Counter((INDEX.parent / link).resolve() for link in links_of(INDEX))
    documents = {path for path in DOCUMENTS if path.is_relative_to(TOP / "docs")} - {INDEX}
    assert {path: named[path] for path in documents} == dict.fromkeys(documents, 1)
