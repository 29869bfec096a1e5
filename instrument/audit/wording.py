"""Description of a record of the event log in one line of text."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from pneuforce.support.counted import counted
from pneuforce.support.rejected_write import register_and_unit

_Formatter = Callable[[Mapping[str, Any]], str]

#: Fields that the description leaves out, because the table of records shows them in their own columns.
_OTHER_COLUMNS = {"at", "mono_s", "who", "result", "kind"}


def describe_record(fields: Mapping[str, Any]) -> str:
    """Return what happened, in one line, without time, peer and result."""
    kind = str(fields.get("kind", ""))
    formatter = _FORMATTERS.get(kind)
    with suppress(KeyError, TypeError, ValueError, AttributeError):  # the record may be manipulated
        if formatter is not None:
            return formatter(fields)
        if "was" in fields:
            return f"{kind}: {_format_value(fields['was'])} → {_format_value(fields['is'])}"
    others = (f"{name} {_format_value(v)}" for name, v in fields.items() if name not in _OTHER_COLUMNS)
    return ": ".join(filter(None, (kind, ", ".join(others))))


def _format_write(fields: Mapping[str, Any]) -> str:
    parts = (_format_quantity(name, old, new) for name, (old, new) in fields["values"].items())
    return ", ".join(parts) + (" (vented nevertheless)" if fields.get("vented") else "")


def _format_quantity(quantity: str, old: Any, new: Any) -> str:
    name, unit = register_and_unit(quantity)
    change = _format_value(new) if old == new else f"{_format_value(old)} → {_format_value(new)}"
    return f"{name} {change} {unit}".rstrip()


def _format_request(fields: Mapping[str, Any]) -> str:
    words = ": ".join(filter(None, (fields["written"], fields["allowed"])))
    return f"request {words}"


def _count_formatter(format_times: Callable[[int], str], label: str = "") -> _Formatter:
    """Return a formatter for a record that counts events. `label` precedes the description of an event."""

    def format_count(fields: Mapping[str, Any]) -> str:
        counted = fields["of"]
        result = f": {counted['result']}" if "result" in counted else ""
        span = f"{fields['since'][:19]} to {fields['until'][:19]}".replace("T", " ")
        return f"{format_times(fields['times'])} ({span}): {label}{describe_record(counted)}{result}"

    return format_count


_FORMATTERS: Mapping[str, _Formatter] = {
    "write": _format_write,
    "request": _format_request,
    "stop": lambda fields: f"stop: {fields['why']}",
    "answer": lambda fields: f"command {fields['command']}",
    "repeated": _count_formatter(lambda times: "repeated once" if times == 1 else f"repeated {times} times"),
    "held_back": _count_formatter(
        lambda times: f"{counted(times, 'more event')} counted but not logged", "last event: "
    ),
    "lost": _count_formatter(
        lambda times: f"{counted(times, 'record')} lost because of the disk", "first lost record: "
    ),
}


def _format_value(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        return " + ".join(map(str, value)) or "none"
    return {"None": "none", "True": "yes", "False": "no"}.get(str(value), str(value))
