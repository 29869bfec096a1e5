"""Files of tables (TOML): held against what they may contain, and refused with file, key and span."""

from __future__ import annotations

import tomllib
from pathlib import Path
from types import NoneType
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from instrument.errors import ConfigurationError
from instrument.whole_file import content_of

MOST_SHOWN = 80


class Section(BaseModel):
    """A table of the file: unknown keys, wrong types and NaN are refused, nothing is converted silently."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


Whole = TypeVar("Whole", bound=Section)


def tables_of(path: Path, remedy: str) -> dict[str, Any]:
    """What a TOML file holds. Raises ConfigurationError; `remedy` tells how to get such a file."""
    return tables_in(text_of(path, remedy), str(path))


def text_of(path: Path, remedy: str) -> str:
    """The text of a file. Raises ConfigurationError; `remedy` tells how to get such a file."""
    try:
        return content_of(path, remedy).decode("utf-8")
    except UnicodeDecodeError as error:
        raise ConfigurationError(f"{path}: cannot be read: {error}") from None


def tables_in(text: str, name: str) -> dict[str, Any]:
    """What a TOML text holds. Raises ConfigurationError."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(f"{name}: not TOML: {error}") from None
    except ValueError:
        raise ConfigurationError(f"{name}: not TOML: a number of thousands of digits") from None
    except RecursionError:
        raise ConfigurationError(f"{name}: not TOML: brackets within brackets, too deep") from None


def checked(whole: type[Whole], tables: dict[str, Any], name: str) -> Whole:
    """The tables of a file called `name`. Raises ConfigurationError with one line for each wrong key."""
    try:
        return whole.model_validate(tables)
    except ValidationError as error:
        lines = [f"{name}: {_sentence(whole, e['loc'], e)}" for e in error.errors()]
        raise ConfigurationError("\n".join(lines)) from None


def _sentence(whole: type[Section], location: tuple[int | str, ...], error: Any) -> str:
    key = ".".join(str(part) for part in location)
    if error["type"] == "extra_forbidden":
        known = section_at(whole, location[:-1])
        return f"{key}: unknown key; known here: {', '.join(known.model_fields) if known else 'none'}"
    if error["type"] == "missing":
        return f"{key}: missing"
    if error["type"] == "model_type":
        return f"{key} = {_shown(error['input'])}: must be a table, [{key}]"
    span = _span_at(whole, location)
    message = error["msg"].removeprefix("Value error, ")
    message = message[0].lower() + message[1:]
    return f"{key} = {_shown(error['input'])}: {message}" + (f"; allowed: {span}" if span else "")


def _shown(value: Any) -> str:
    """A value as it was given, not all of it where it is long."""
    try:
        shown = repr(value)
    except ValueError:
        return "a number of thousands of digits"
    return shown if len(shown) <= MOST_SHOWN else f"{shown[:MOST_SHOWN]}…"


def section_at(whole: type[Section], location: tuple[int | str, ...]) -> type[Section] | None:
    """The section at a place of the file, None where there is none."""
    section = whole
    for part in location:
        field = section.model_fields.get(str(part))
        inner = field and _section_in(field.annotation)
        if inner is None:
            return None
        section = inner
    return section


def _section_in(annotation: Any) -> type[Section] | None:
    """The section of an annotation, which may be optional."""
    [kind, *_] = [kind for kind in get_args(annotation) if kind is not NoneType] or [annotation]
    return kind if isinstance(kind, type) and issubclass(kind, Section) else None


def _span_at(whole: type[Section], location: tuple[int | str, ...]) -> str:
    section = section_at(whole, location[:-1])
    key = str(location[-1]) if location else ""
    if (
        section is None
        or key not in section.model_fields
        or _section_in(section.model_fields[key].annotation)
    ):
        return ""
    return span_of(section.model_json_schema()["properties"][key])


def span_of(schema: dict[str, Any]) -> str:
    """The allowed values of a key, from its JSON schema."""
    schema = schema.get("anyOf", [schema])[0]  # of an optional key
    if "const" in schema:
        return toml_of(schema["const"])
    if "enum" in schema:
        return ", ".join(str(value) for value in schema["enum"])
    if "minimum" in schema:
        return f"{schema['minimum']} to {schema['maximum']}"
    return {"boolean": "true, false", "string": "text", "array": "list of addresses and networks"}.get(
        schema["type"], str(schema["type"])
    )


def toml_of(value: object) -> str:
    """A value as TOML writes it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + "".join(_ESCAPED.get(letter, letter) for letter in value) + '"'
    if isinstance(value, list | tuple):
        return f"[{', '.join(toml_of(item) for item in value)}]"
    return str(value)


_ESCAPED = {chr(code): f"\\u{code:04x}" for code in (*range(32), 127)} | {'"': '\\"', "\\": "\\\\"}


def toml_text(section: Section, name: str = "") -> str:
    """A section and those within it as TOML, each with its docstring as a comment; None is left out."""
    lines: list[str] = []
    inner: list[str] = []
    for key, value in section:
        path = f"{name}.{key}" if name else key
        if isinstance(value, Section):
            inner += ["", f"# {summary(type(value))}", f"[{path}]", toml_text(value, path)]
        elif isinstance(value, list) and value and isinstance(value[0], Section):
            inner += [line for item in value for line in ("", f"[[{path}]]", toml_text(item, path))]
        elif value is not None:
            lines.append(f"{key} = {toml_of(value)}")
    return "\n".join(lines + inner)


def summary(section: type[Section]) -> str:
    """The first line of a section's docstring."""
    return (section.__doc__ or "").splitlines()[0]
