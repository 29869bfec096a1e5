"""Base class of the tables in a scenario file, parser of number lists, and text of error locations."""

from __future__ import annotations

import sys
from typing import Any

from pydantic import BeforeValidator

from pneuforce.support.toml_sections import Section
from pneuforce.support.validation_errors import Location

MAX_VALUES = 1000


class ScenarioTable(Section):
    """Table of a scenario file. Unknown keys, wrong types and NaN are rejected. No type is converted."""


def is_number(value: object) -> bool:
    """Return True for an int or float that is not NaN and fits a float. Booleans are not numbers."""
    return type(value) in (int, float) and abs(value) <= sys.float_info.max  # type: ignore[arg-type]


def to_tuple(value: Any) -> tuple[Any, ...]:
    """Return a value, a list or the range {from, to, step} as a tuple.

    Raises ValueError if a table is not a valid range.
    """
    if isinstance(value, list):
        return tuple(value)
    return _range(value) if isinstance(value, dict) else (value,)


def _range(table: dict[str, Any]) -> tuple[float, ...]:
    complete = {"from", "to", "step"} == table.keys()
    if not complete or not all(map(is_number, table.values())):
        raise ValueError("a number, a list of numbers or {from = …, to = …, step = …} is expected")
    low, high, step = (float(table[key]) for key in ("from", "to", "step"))
    count = (high - low) / step if step else -1.0
    if not (0 <= count < MAX_VALUES and abs(count - round(count)) < 1e-6):
        raise ValueError(
            f"from {low:g} to {high:g} in steps of {step:g}: the number of steps must be a whole number "
            f"from 0 to {MAX_VALUES - 1}"
        )
    return tuple(round(low + n * step, 9) for n in range(round(count) + 1))


#: Validator for keys that take a number, a list of numbers or a range.
NumberList = BeforeValidator(to_tuple)


def format_location(location: Location, value: object) -> str:
    """Return the place of a key in words, for example "phase 2, contact 1, press, force_n".

    The index in a list of numbers is omitted.
    """
    if location and isinstance(location[-1], int) and not isinstance(value, dict):
        location = location[:-1]
    words: list[str] = []
    for part in location:
        if isinstance(part, int) and words:
            words[-1] += f" {part + 1}"
        else:
            words.append(str(part))
    return ", ".join(words)
