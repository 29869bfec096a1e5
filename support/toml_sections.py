"""Reading, validation (by pydantic models) and writing of TOML files."""

from __future__ import annotations

import tomllib
from codecs import BOM_UTF8
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from pneuforce.errors import ConfigurationError
from pneuforce.support.toml_errors import encoding_problem, syntax_problem
from pneuforce.support.validation_errors import format_errors, format_key


class Section(BaseModel):
    """Table of a TOML file. Unknown keys, wrong types and NaN are rejected; no value is converted."""

    removed_keys: ClassVar[
        Mapping[str, str]
    ] = {}  #: keys of earlier versions, with what replaces each of them
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class InvalidTables(ConfigurationError):
    """Tables with wrong values. `tables` are all tables, also with the correct values."""

    tables: Mapping[str, Any] = MappingProxyType({})


AnySection = TypeVar("AnySection", bound=Section)


def decode_text(content: bytes, name: str) -> str:
    """Return the text in the content of the file `name`.

    Raises ConfigurationError if the content is not UTF-8, or begins with a byte order mark (BOM).
    """
    if content.startswith(BOM_UTF8):
        raise ConfigurationError(
            f"{name}: line 1 begins with a byte order mark (BOM): save the file as UTF-8 (without BOM)"
        )
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise ConfigurationError(f"{name}: {encoding_problem(content, error)}") from None


def parse_tables(text: str, name: str) -> dict[str, Any]:
    """Return the tables of a TOML document.

    Raises ConfigurationError if `text` is not valid TOML. `name` is the file name in the error message.
    """
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(f"{name}: {syntax_problem(text, error)}") from None
    except ValueError:  # Python rejects integers of more than 4300 digits
        raise ConfigurationError(f"{name}: not TOML: a number with thousands of digits") from None
    except RecursionError:
        raise ConfigurationError(f"{name}: not TOML: brackets are nested too deeply") from None


def validate_tables(section: type[AnySection], tables: dict[str, Any], name: str) -> AnySection:
    """Return the tables of the file `name` as a section.

    Raises InvalidTables with one line for each wrong key: file, key, value and allowed values.
    """
    try:
        return section.model_validate(tables)
    except ValidationError as error:
        lines = [f"{name}: {sentence}" for sentence in format_errors(error, section)]
        invalid = InvalidTables("\n".join(lines))
        invalid.tables = tables
        raise invalid from None


def format_value(value: object) -> str:
    """Return a value in TOML syntax."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + "".join(_ESCAPES.get(character, character) for character in value) + '"'
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(format_value, value))}]"
    if isinstance(value, dict):
        pairs = ", ".join(f"{format_key(key)} = {format_value(each)}" for key, each in value.items())
        return f"{{ {pairs} }}" if pairs else "{}"
    return str(value)


_ESCAPES = {chr(code): f"\\u{code:04x}" for code in (*range(32), 127)} | {'"': '\\"', "\\": "\\\\"}


def format_section(section: Section, name: str = "") -> str:
    """Return a section and its inner sections as TOML, without the keys whose value is None.

    A comment above an inner section gives the first line of its docstring. `name` is the dotted name of the
    section.
    """
    lines: list[str] = []
    inner: list[str] = []
    for key, value in section:
        path = f"{name}.{key}" if name else key
        if isinstance(value, Section):
            inner += ["", f"# {summary(type(value))}", f"[{path}]", format_section(value, path)]
        elif isinstance(value, list) and value and isinstance(value[0], Section):
            inner += [line for item in value for line in ("", f"[[{path}]]", format_section(item, path))]
        elif value is not None:
            lines.append(f"{key} = {format_value(value)}")
    return "\n".join(lines + inner)


def summary(section: type[Section]) -> str:
    """Return the first line of a section's docstring."""
    return (section.__doc__ or "").splitlines()[0]
