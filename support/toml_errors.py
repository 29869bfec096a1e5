"""Sentences for the syntax errors of TOML files."""

from __future__ import annotations

import re
import tomllib

_POSITION = re.compile(r"at line (\d+)")
_KEY = re.compile(r"""\s*([\w."' -]{1,80}?)\s*=""", re.ASCII)
_TABLE = re.compile(r"Cannot declare \((.{1,80}?),?\) twice")


def encoding_problem(content: bytes, error: UnicodeDecodeError) -> str:
    """Return the line that is not UTF-8, and the remedy."""
    line = content.count(b"\n", 0, error.start) + 1
    return f"line {line} is not UTF-8: save the file as UTF-8 (without BOM)"


def syntax_problem(text: str, error: tomllib.TOMLDecodeError) -> str:
    """Return what is wrong in a text. A key or a table that is given twice is named."""
    message = str(error)
    found = _POSITION.search(message)
    lines = text.splitlines()
    number = int(found[1]) if found else len(lines)
    if message.startswith("Cannot overwrite a value"):
        key = next(filter(None, map(_KEY.match, reversed(lines[:number]))), None)
        named = f"the key {key[1]}" if key else "a key"
        return f"line {number}: {named} has a value already: delete one of the lines"
    if table := _TABLE.match(message):
        name = re.sub(r"', '", ".", table[1]).strip("'")
        return f"line {number}: the table [{name}] is there already: move all its keys below one header"
    return f"not TOML: {message}"
