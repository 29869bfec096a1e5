"""Declarations of the Structured Text library as data, for the formats that other PLC systems import."""

from __future__ import annotations

import re
from typing import NamedTuple

_BLOCK = re.compile(r"\(\* ([^*]*?) \*\)\nFUNCTION_BLOCK (\w+)\n(.*?)END_FUNCTION_BLOCK\n", re.DOTALL)
_SECTION = re.compile(r"(VAR(?:_INPUT|_OUTPUT)?(?: CONSTANT)?)\n(.*?)END_VAR\n", re.DOTALL)
_VARIABLE = re.compile(r" {4}(\w+) : (\w+)(?: := ([^;]+))?;(?: +\(\* (.*) \*\))?")
_ARRAY = re.compile(r"TYPE (\w+) : ARRAY\[(\d+)\.\.(\d+)\] OF (\w+); END_TYPE")
_STRUCTURE = re.compile(r"\(\* ([^*]*?) \*\)\nTYPE (\w+) :\nSTRUCT\n(.*?)END_STRUCT;\nEND_TYPE\n", re.DOTALL)
_CONSTANTS = re.compile(r"VAR_GLOBAL CONSTANT\n(.*?)END_VAR\n", re.DOTALL)


class Variable(NamedTuple):
    """Variable, member of a structure, or constant. `initial` and `doc` can be empty."""

    name: str
    type: str
    initial: str
    doc: str


class Array(NamedTuple):
    """Named array type."""

    name: str
    first: int
    last: int
    element: str


class Structure(NamedTuple):
    """Named structure."""

    name: str
    doc: str
    members: list[Variable]


class Block(NamedTuple):
    """Function block: its sections with variables by their keywords, and its statements."""

    name: str
    doc: str
    sections: dict[str, list[Variable]]
    body: str


class Library(NamedTuple):
    """All declarations of the library."""

    constants: list[Variable]
    arrays: list[Array]
    structures: list[Structure]
    blocks: list[Block]


def parse_library(text: str) -> Library:
    """Return the declarations of the library. `structured_text.render` returns the text."""
    [constants] = _CONSTANTS.findall(text)
    return Library(
        _variables(constants),
        [Array(name, int(first), int(last), element) for name, first, last, element in _ARRAY.findall(text)],
        [
            Structure(name, _one_line(doc), _variables(members))
            for doc, name, members in _STRUCTURE.findall(text)
        ],
        [_block(*found) for found in _BLOCK.findall(text)],
    )


def _block(doc: str, name: str, rest: str) -> Block:
    sections: dict[str, list[Variable]] = {}
    end = 0
    for section in _SECTION.finditer(rest):
        sections[section[1]] = _variables(section[2])
        end = section.end()
    return Block(name, _one_line(doc), sections, rest[end:])


def _variables(text: str) -> list[Variable]:
    return [Variable(*found) for found in _VARIABLE.findall(text)]


def _one_line(text: str) -> str:
    return " ".join(text.split())
