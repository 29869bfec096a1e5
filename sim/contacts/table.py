"""Tables of a scenario file: checked strictly, and told in sentences when they are wrong."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError

MOST_VALUES = 1000
MOST_SHOWN = 60  #: letters of a value


class Table(BaseModel):
    """Unknown keys, wrong types and NaN are refused, nothing is converted silently."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


def is_number(value: object) -> bool:
    """Whether it is a number: not true, not NaN, and none too large for a float."""
    return type(value) in (int, float) and abs(value) <= sys.float_info.max  # type: ignore[arg-type]


def shown(value: object) -> str:
    """A value as it was written; a long one only begins."""
    try:
        text = repr(value)
    except RecursionError:
        return "…"
    return text if len(text) <= MOST_SHOWN else text[:MOST_SHOWN] + "…"


def spread(value: Any) -> tuple[Any, ...]:
    """One value, a list of them, or {from, to, step} as a tuple. Raises ValueError on another table."""
    if isinstance(value, list):
        return tuple(value)
    return _steps(value) if isinstance(value, dict) else (value,)


def _steps(table: dict[str, Any]) -> tuple[float, ...]:
    wanted = {"from", "to", "step"} == table.keys()
    if not wanted or not all(map(is_number, table.values())):
        raise ValueError("a number, a list of numbers or {from = …, to = …, step = …} is expected")
    low, high, step = (float(table[key]) for key in ("from", "to", "step"))
    count = (high - low) / step if step else -1.0
    if not (0 <= count < MOST_VALUES and abs(count - round(count)) < 1e-6):
        raise ValueError(f"from {low:g} to {high:g} in steps of {step:g}: no whole number of steps")
    return tuple(round(low + n * step, 9) for n in range(round(count) + 1))


Spread = BeforeValidator(spread)


def sentences(error: ValidationError, tables: Mapping[str, type[Table]]) -> list[str]:
    """What is wrong, one sentence each: place, key, value and what is allowed.

    `tables` are those that may occur, by the names that lead to them; the whole file's is "".
    """
    return [_sentence(e["loc"], e, tables) for e in error.errors()]


def _sentence(location: tuple[int | str, ...], error: Any, tables: Mapping[str, type[Table]]) -> str:
    if location and isinstance(location[-1], int) and not isinstance(error["input"], dict):
        location = location[:-1]  # an entry of a list of numbers
    place = _place(location) or "the table"
    names = [part for part in location if isinstance(part, str)]
    if error["type"] == "extra_forbidden":
        return f"{place}: unknown key; known here: {', '.join(_within(names, tables).model_fields)}"
    if error["type"] == "missing":
        return f"{place}: is missing"
    if error["type"].startswith("union_tag"):
        return _untagged(place, error)
    message = error["msg"].removeprefix("Value error, ")
    value = "" if isinstance(error["input"], dict) else f" = {shown(error['input'])}"
    span = _span(names, tables)
    return f"{place}{value}: {message[:1].lower()}{message[1:]}" + (f"; allowed: {span}" if span else "")


def _untagged(place: str, error: Any) -> str:
    """A table that does not say of which kind it is."""
    key = error["ctx"]["discriminator"].strip("'")
    known = error["ctx"].get("expected_tags")
    if known is None:
        return f"{place}: a table with the key {key} is expected"
    return f"{place}, {key} = {shown(error['input'][key])}: allowed: {known}"


def _place(location: tuple[int | str, ...]) -> str:
    """The location in words: phase 2, contact 1, press, force_n."""
    words: list[str] = []
    for part in location:
        if isinstance(part, int):
            words[-1] += f" {part + 1}"
        else:
            words.append(part)
    return ", ".join(words)


def _span(names: list[str], tables: Mapping[str, type[Table]]) -> str:
    """What a key allows, looked up in the innermost table that is named."""
    within = _within(names, tables)
    if not names or names[-1] not in within.model_fields:
        return ""
    return span_of(within.model_json_schema()["properties"][names[-1]])


def _within(names: list[str], tables: Mapping[str, type[Table]]) -> type[Table]:
    return tables[next((name for name in reversed(names[:-1]) if name in tables), "")]


def span_of(schema: Mapping[str, Any]) -> str:
    """The span that a key's JSON schema declares, "" where it has none."""
    parts = [*schema.get("anyOf", ()), *([schema["items"]] if "items" in schema else ())]
    if "enum" in schema:
        return ", ".join(repr(value) for value in schema["enum"])
    if "maximum" in schema:
        return f"{schema['minimum']:g} to {schema['maximum']:g}"
    return next(filter(None, map(span_of, parts)), "")
