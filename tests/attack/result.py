"""Result of one attack: how much was sent, and what went wrong."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

MAX_SHOWN = 5


@dataclass(slots=True)
class AttackResult:
    """Counts of an attack. An attack has found nothing if `findings` is empty."""

    name: str
    sent: int = 0  #: number of requests, frames, samples or files
    notes: Counter[str] = field(default_factory=Counter)  #: what happened, with its number
    figures: list[str] = field(default_factory=list)  #: measured values
    findings: list[str] = field(default_factory=list)  #: defects

    def check(self, expected: bool, finding: str) -> None:
        """Add a finding if `expected` is false."""
        if not expected:
            self.findings.append(finding)

    def line(self) -> str:
        """Return the result as one line."""
        counted = [f"{number} {what}" for what, number in sorted(self.notes.items())]
        notes = ", ".join([*counted, *self.figures])
        found = f"{len(self.findings)} findings" if self.findings else "nothing found"
        shown = "".join(f"\n  {finding}" for finding in self.findings[:MAX_SHOWN])
        return f"{self.name}: {self.sent} sent ({notes}): {found}{shown}"
