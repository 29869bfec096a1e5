"""Sentences for the validation errors of pydantic: location, value, reason and allowed values."""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import date
from types import NoneType
from typing import Annotated, Any, get_args, get_origin

from pydantic import BaseModel, ValidationError

from pneuforce.support.printable import printable
from pneuforce.support.user_part import without_user

#: Longest text of a value in an error message, in characters.
MAX_VALUE_CHARACTERS = 80

_BARE_KEY = re.compile(rf"[A-Za-z0-9_-]{{1,{MAX_VALUE_CHARACTERS}}}")

#: Location of an error as pydantic reports it: keys, list indices and tags of discriminated unions.
Location = tuple[int | str, ...]

#: Function that formats the location of an error. Its second argument is the rejected value.
LocationFormatter = Callable[[Location, object], str]


def dotted_key(location: Location, value: object) -> str:  # noqa: ARG001
    """Return a location as TOML writes a key, for example `modbus.port`."""
    return ".".join(map(format_key, location))


def format_key(part: int | str) -> str:
    """Return one part of a location. A key that TOML would have to quote is quoted and cut."""
    return str(part) if _BARE_KEY.fullmatch(str(part)) else format_input(str(part))


def format_errors(
    error: ValidationError, table_type: Any, format_location: LocationFormatter = dotted_key
) -> list[str]:
    """Return one sentence for each wrong value.

    `table_type` is the validated type: a model class, or a discriminated union of model classes.
    """
    return [printable(_sentence(table_type, details, format_location)) for details in error.errors()]


def _sentence(table_type: Any, error: Any, format_location: LocationFormatter) -> str:
    location, value = error["loc"], error["input"]
    place = format_location(location, value) or "the table"
    if error["type"] == "union_tag_invalid":
        return _unknown_tag(place if location else "", error)
    if error["type"] == "extra_forbidden":
        table = model_at(table_type, location[:-1])
        if removed := getattr(table, "removed_keys", {}).get(location[-1]):
            return f"{place}: {removed}"
        return f"{place}: unknown key; known here: {', '.join(table.model_fields) if table else 'none'}"
    if error["type"] == "missing":
        return f"{place}: is missing"
    if error["type"] == "model_type":
        return f"{place} = {format_input(value)}: must be a table{_header(location)}"
    if error["type"] == "union_tag_not_found":
        return f"{place}: a table with the key {_discriminator(error)} is expected"
    if error["type"] == "value_error" and _is_default(table_type, location, value):
        return f"{place} is not set: {error['msg'].removeprefix('Value error, ')}"
    shown = "" if error["type"] == "value_error" and isinstance(value, dict) else f" = {format_input(value)}"
    allowed = _allowed_values_at(table_type, location)
    message = error["msg"].removeprefix("Value error, ")
    return f"{place}{shown}: {message[:1].lower()}{message[1:]}" + (
        f"; allowed: {allowed}" if allowed else ""
    )


def _is_default(table_type: Any, location: Location, value: object) -> bool:
    """Return True if a value is the default of its key: the file probably does not contain the key."""
    table = model_at(table_type, location[:-1]) if location else None
    field = table.model_fields.get(str(location[-1])) if table else None
    return field is not None and field.get_default(call_default_factory=True) == value


def _header(location: Location) -> str:
    """Return a comma and the TOML header of a table, for example `, [modbus]`.

    Return an empty string for the complete file and for an entry of a list.
    """
    keys = [part for part in location if isinstance(part, str)]
    return f", [{'.'.join(map(format_key, keys))}]" if keys and len(keys) == len(location) else ""


def _unknown_tag(place: str, error: Any) -> str:
    """Return the sentence for a table whose discriminating key has an unknown value."""
    key = _discriminator(error)
    tag = f"{key} = {format_input(error['input'][key])}"
    return f"{place}, {tag}: unknown value; allowed: {error['ctx']['expected_tags']}".lstrip(", ")


def _discriminator(error: Any) -> str:
    return str(error["ctx"]["discriminator"]).strip("'")


def format_input(value: object) -> str:
    """Return the text of a rejected value without user and password, cut after `MAX_VALUE_CHARACTERS`."""
    try:
        text = value.isoformat() if isinstance(value, date) else without_user(repr(value))
    except ValueError:  # repr() fails for integers of more than 4300 digits
        return "a number with thousands of digits"
    except RecursionError:
        return "…"
    return text if len(text) <= MAX_VALUE_CHARACTERS else f"{text[:MAX_VALUE_CHARACTERS]}…"


def model_at(table_type: Any, location: Location) -> type[BaseModel] | None:
    """Return the model class at a location, or None if the value there is not a table."""
    kind: Any = table_type
    for part in location:
        kind = _type_within(kind, part)
    kind = _unwrapped(kind)
    return kind if _is_model(kind) else None


def _type_within(kind: Any, part: int | str) -> Any:
    """Return the type of one part of a location inside the type `kind`, or None if the part is unknown.

    A part is a key, the index of a list entry, or the tag of a member of a union.
    """
    kind = _unwrapped(kind)
    if _is_model(kind):
        field = kind.model_fields.get(str(part))
        return field and field.annotation
    members = [member for member in get_args(kind) if member is not Ellipsis]
    if isinstance(part, int):
        return members[0] if members else None
    return next((member for member in members if _has_tag(member, part)), None)


def _unwrapped(kind: Any) -> Any:
    """Return a type without its metadata and without `| None`."""
    if get_origin(kind) is Annotated:
        return _unwrapped(get_args(kind)[0])
    members = get_args(kind)
    present = [member for member in members if member is not NoneType]
    return _unwrapped(present[0]) if len(present) == 1 < len(members) else kind


def _is_model(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _has_tag(kind: Any, tag: str) -> bool:
    """Return True if a member of a discriminated union has this tag."""
    return _is_model(kind) and any(tag in get_args(field.annotation) for field in kind.model_fields.values())


def _allowed_values_at(table_type: Any, location: Location) -> str:
    """Return the allowed values of the key at a location.

    Return an empty string if the key is unknown or if its values are not limited.
    """
    while location and isinstance(location[-1], int):
        location = location[:-1]  # the key of a list has the limits of the entries
    table = model_at(table_type, location[:-1]) if location else None
    key = str(location[-1]) if location else ""
    if table is None or key not in table.model_fields:
        return ""
    return allowed_values(table.model_json_schema()["properties"][key])


def allowed_values(schema: dict[str, Any]) -> str:
    """Return the allowed values of a key from its JSON schema.

    Return an empty string if the schema does not limit the values. If the schema has the entry
    `allowed_values` (from pydantic's `json_schema_extra`), return the text of this entry.
    """
    if "allowed_values" in schema:
        return str(schema["allowed_values"])
    if "const" in schema:
        return str(schema["const"]).lower() if isinstance(schema["const"], bool) else str(schema["const"])
    if "enum" in schema:
        return ", ".join(map(str, schema["enum"]))
    if "minimum" in schema:
        return f"{_number(schema['minimum'])} to {_number(schema['maximum'])}"
    if "anyOf" in schema or "items" in schema:
        inner = [*schema.get("anyOf", ()), *([schema["items"]] if "items" in schema else ())]
        return next(filter(None, map(allowed_values, inner)), "")
    return {"boolean": "true, false", "string": "text"}.get(schema.get("type", ""), "")


def _number(value: float) -> str:
    return str(value) if isinstance(value, int) else f"{value:.12g}"
