"""Limit for repeated lines of a log: an equal line is logged again only after growing pauses."""

from __future__ import annotations

from dataclasses import dataclass, field

FIRST_PAUSE_S, LONGEST_PAUSE_S, GROWTH = 10.0, 3600.0, 2.0
MAX_LINES = 50  #: number of latest lines that are remembered


@dataclass(slots=True)
class RepeatedLines:
    """Latest lines, each with the time of its next logging and the pause after that."""

    _lines: dict[str, tuple[float, float]] = field(default_factory=dict)

    def is_due(self, line: str, now_s: float) -> bool:
        """Return True if a line shall be logged now: the first time, and then after growing pauses [s]."""
        due_s, pause_s = self._lines.pop(line, (now_s, FIRST_PAUSE_S))
        is_due = now_s >= due_s
        if is_due:
            due_s, pause_s = now_s + pause_s, min(pause_s * GROWTH, LONGEST_PAUSE_S)
        self._lines[line] = due_s, pause_s
        if len(self._lines) > MAX_LINES:
            del self._lines[next(iter(self._lines))]
        return is_due

    def clear(self) -> None:
        """Forget all lines."""
        self._lines.clear()
