"""Fault table in docs/simulator.md. `python -m pneuforce.sim.faults.document` updates this table."""

from __future__ import annotations

from pathlib import Path

from pneuforce.sim.faults.catalogue import CATALOGUE
from pneuforce.sim.faults.kind import FaultKind

DOCUMENT = Path("docs/simulator.md")
MARKS = "<!-- the catalogue: made from sim/faults, do not edit -->\n", "<!-- end of the catalogue -->\n"
EFFECT_TEXTS = {"drift": "Drift, no contact", "losses": "Lost frames are counted", "": "Nothing"}


def format_response(kind: FaultKind) -> str:
    """Return the expected response as text: fault of the board, status bit, or effect."""
    if kind.board_fault is not None:
        return f"Board: {kind.board_fault.name.lower().replace('_', ' ')} ({kind.board_fault.value})"
    return EFFECT_TEXTS.get(kind.effect, f"Status: {kind.effect}")


def format_arguments(kind: FaultKind) -> str:
    """Return the arguments as text, each with its default and its range."""
    return ", ".join(
        f"{a.name} = {a.default:g} {a.unit} ({a.minimum:g} to {a.maximum:g})" for a in kind.arguments
    )


def markdown() -> str:
    """Return the catalogue as a Markdown table."""
    lines = [
        "| name | what happens | arguments: default (range) | phase | response |",
        "| --- | --- | --- | --- | --- |",
    ]
    for kind in CATALOGUE.values():
        response = f"{format_response(kind)}. {kind.expected}"
        cells = (f"`{kind.name}`", kind.description, format_arguments(kind), kind.phase, response)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def updated(text: str) -> str:
    """Return the text of the document with a new table between the two `MARKS`."""
    before, _, rest = text.partition(MARKS[0])
    _, _, after = rest.partition(MARKS[1])
    return before + MARKS[0] + "\n" + markdown() + "\n" + MARKS[1] + after


if __name__ == "__main__":
    DOCUMENT.write_text(updated(DOCUMENT.read_text(encoding="utf-8")), encoding="utf-8")
    print(DOCUMENT)
