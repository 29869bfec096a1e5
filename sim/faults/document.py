"""The catalogue as a table for people: `python -m sim.faults.document` writes it into docs/simulator.md."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from sim.faults.catalogue import CATALOGUE
from sim.faults.kind import FaultKind

DOCUMENT = Path("docs/simulator.md")
MARKS = "<!-- the catalogue: made from sim/faults, do not edit -->\n", "<!-- end of the catalogue -->\n"
WORDS = {"drift": "drift, and no contact", "losses": "lost frames are counted", "": "nothing"}


class Row(NamedTuple):
    """One fault, in words."""

    name: str
    what: str
    arguments: str
    where: str
    answer: str


def rows() -> list[Row]:
    """All faults."""
    return [
        Row(kind.name, kind.what, _arguments(kind), kind.where, f"{answer_of(kind)}. {kind.rule}")
        for kind in CATALOGUE.values()
    ]


def answer_of(kind: FaultKind) -> str:
    """Who sees the fault, and as what."""
    if kind.board is not None:
        return f"Board: {kind.board.name.lower().replace('_', ' ')} ({kind.board.value})"
    return f"Status: {kind.shows}" if kind.shows not in WORDS else WORDS[kind.shows].capitalize()


def markdown() -> str:
    """The table as it stands in the document."""
    lines = [
        "| name | what happens | arguments: usual (span) | shows when | answer |",
        "| --- | --- | --- | --- | --- |",
    ]
    lines += [f"| `{row.name}` | {' | '.join(row[1:])} |" for row in rows()]
    return "\n".join(lines) + "\n"


def renewed(text: str) -> str:
    """The document with the table between its marks made anew."""
    before, _, rest = text.partition(MARKS[0])
    _, _, after = rest.partition(MARKS[1])
    return before + MARKS[0] + "\n" + markdown() + "\n" + MARKS[1] + after


def _arguments(kind: FaultKind) -> str:
    return ", ".join(f"{a.name} = {a.usual:g} {a.unit} ({a.low:g} to {a.high:g})" for a in kind.arguments)


if __name__ == "__main__":
    DOCUMENT.write_text(renewed(DOCUMENT.read_text(encoding="utf-8")), encoding="utf-8")
    print(DOCUMENT)
