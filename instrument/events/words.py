"""A record of the event log in plain words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any


def in_words(facts: Mapping[str, Any]) -> str:
    """What happened, in one line, without when, who and the verdict."""
    kind = str(facts.get("kind", ""))
    tell = _WORDS.get(kind)
    with suppress(KeyError, TypeError, ValueError, AttributeError):  # a record that was altered
        if tell is not None:
            return tell(facts)
        if "was" in facts:
            return f"{kind}: {_value(facts['was'])} → {_value(facts['is'])}"
    told = {name: fact for name, fact in facts.items() if name not in _TOLD_ELSEWHERE}
    return ": ".join(filter(None, (kind, ", ".join(f"{name} {_value(fact)}" for name, fact in told.items()))))


def _write_in_words(facts: Mapping[str, Any]) -> str:
    parts = (
        f"{name} {_value(new)}" if old == new else f"{name} {_value(old)} → {_value(new)}"
        for name, (old, new) in facts["values"].items()
    )
    return ", ".join(parts) + (" (vented all the same)" if facts.get("vented") else "")


def _times_in_words(how: Callable[[int], str]) -> Callable[[Mapping[str, Any]], str]:
    def words(facts: Mapping[str, Any]) -> str:
        of = facts["of"]
        verdict = f": {of['verdict']}" if "verdict" in of else ""
        span = f"{facts['since'][:19]} to {facts['until'][:19]}".replace("T", " ")
        return f"{how(facts['times'])} ({span}): {in_words(of)}{verdict}"

    return words


_TOLD_ELSEWHERE = {"at", "mono_s", "who", "verdict", "kind"}
#: How the kinds of record are told that have words of their own.
_WORDS: Mapping[str, Callable[[Mapping[str, Any]], str]] = {
    "write": _write_in_words,
    "request": lambda facts: f"request {facts['request']}",
    "stop": lambda facts: f"stop: {facts['why']}",
    "answer": lambda facts: f"command {facts['command']}",
    "repeated": _times_in_words(lambda times: "repeated once" if times == 1 else f"repeated {times} times"),
    "held_back": _times_in_words(lambda times: f"{times} more, too many to keep each; the last"),
    "lost": _times_in_words(lambda times: f"{times} records lost, the disk did not take them; the first"),
}


def _value(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        return " + ".join(map(str, value)) or "none"
    return {"None": "none", "True": "yes", "False": "no"}.get(str(value), str(value))
