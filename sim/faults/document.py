"""The catalogue as a table for people: `python -m sim.faults.document` writes it into docs/simulator.md."""

from __future__ import annotations

from pathlib import Path

from sim.faults.catalogue import CATALOGUE
from sim.faults.kind import FaultKind

DOCUMENT = Path("docs/simulator.md")
MARKS = "<!-- the catalogue: made from sim/faults, do not edit -->\n", "<!-- end of the catalogue -->\n"
WORDS = {"drift": "drift, and no contact", "losses": "lost frames are counted", "": "nothing"}


def answer_of(kind: FaultKind) -> str:
    """Who sees the fault, and as what."""
    if kind.board is not None:
        return f"Board: {kind.board.name.lower().replace('_', ' ')} ({kind.board.value})"
    return f"Status: {kind.shows}" if kind.shows not in WORDS else WORDS[kind.shows].capitalize()


def arguments_in_words(kind: FaultKind) -> str:
    """The arguments, each with its usual value and its span."""
    return ", ".join(f"{a.name} = {a.usual:g} {a.unit} ({a.low:g} to {a.high:g})" for a in kind.arguments)


def markdown() -> str:
    """The table as it stands in the document."""
    lines = [
        "| name | what happens | arguments: usual (span) | shows when | answer |",
        "| --- | --- | --- | --- | --- |",
    ]
    for kind in CATALOGUE.values():
        answer = f"{answer_of(kind)}. {kind.rule}"
        cells = (f"`{kind.name}`", kind.what, arguments_in_words(kind), kind.where, answer)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def renewed(text: str) -> str:
    """The document with the table between its marks made anew."""
    before, _, rest = text.partition(MARKS[0])
    _, _, after = rest.partition(MARKS[1])
    return before + MARKS[0] + "\n" + markdown() + "\n" + MARKS[1] + after


if __name__ == "__main__":
    DOCUMENT.write_text(renewed(DOCUMENT.read_text(encoding="utf-8")), encoding="utf-8")
    print(DOCUMENT)
