"""SCL source for TIA Portal: the Structured Text library in the notation of Siemens.

SCL differs from IEC 61131-3: names of blocks and types are quoted, local names begin with `#`, a body begins
with BEGIN, a data type is a structure and never an alias of an array, shifts have named parameters, and
constants of bit strings are hexadecimal. `docs/tutorials/tia-portal.md` lists these differences.
"""

from __future__ import annotations

import re

from pneuforce.registers.map import MAP_VERSION
from pneuforce.registers.map_hash import MAP_HASH
from pneuforce.registers.views import structured_text

_HEAD = f"""\
(* pneuforce: library for PLC programs in SCL, TIA Portal.
   Map version {MAP_VERSION}, hash {MAP_HASH:08X}h (registers 768 and 770).
   Generated from the register map: pneuforce map --format scl. Instructions: docs/tutorials/tia-portal.md.
   The source has not been compiled in TIA Portal. *)
"""
_PART = re.compile(r"^(TYPE|FUNCTION_BLOCK) (\w+).*?^END_\1", re.MULTILINE | re.DOTALL)
_ALIAS = re.compile(r"^TYPE (\w+) : (ARRAY.*); END_TYPE$", re.MULTILINE)
_SHIFT = re.compile(r"\b(SH[LR])\((\w+\(\w+\)|\w+), (\d+)\)")
_DECIMAL_BITS = re.compile(r"\b(D?WORD)#(\d)\b(?!#)")
_DECLARED = re.compile(r"^    (\w+) : ", re.MULTILINE)
#: A comment, a typed literal, a member after a dot, a name, or a bracket.
_TOKEN = re.compile(r"\(\*.*?\*\)|\b\w+#[\w#]+|\.\w+|\b[A-Za-z_]\w*\b(?: :=)?|[()]", re.DOTALL)


def render() -> str:
    """Return the data types and function blocks, each declared before it is used."""
    text = structured_text.render()
    aliases = dict(_ALIAS.findall(text))
    text = _ALIAS.sub("", text)
    parts = [_type_or_block(part, aliases) for part in _PART.finditer(text)]
    return "\n".join((_HEAD, *parts))


def _type_or_block(part: re.Match[str], aliases: dict[str, str]) -> str:
    kind, name = part[1], part[2]
    text = _in_notation_of_siemens(part[0].split("\n", 1)[1], aliases)
    if kind == "FUNCTION_BLOCK":
        declarations, end, body = text.rpartition("END_VAR\n")
        names = frozenset(_DECLARED.findall(declarations))
        text = f"{declarations}{end}BEGIN\n{_with_marked_names(body, names)}"
    return f'{kind} "{name}"\nVERSION : 0.1\n{text}\n'


def _in_notation_of_siemens(text: str, aliases: dict[str, str]) -> str:
    for name, array in aliases.items():
        text = text.replace(f": {name};", f": {array};")
    text = re.sub(r": (PF_\w+);", r': "\1";', text)
    text = text.replace(": TON;", ": TON_TIME;")
    text = _DECIMAL_BITS.sub(r"\1#16#\2", text)
    return _SHIFT.sub(r"\1(IN := \2, N := \3)", text)


def _with_marked_names(body: str, names: frozenset[str]) -> str:
    """Return the body with `#` before each local name. A name before := in brackets is a parameter."""
    depth = 0

    def mark(token: re.Match[str]) -> str:
        nonlocal depth
        depth += {"(": 1, ")": -1}.get(token[0], 0)
        name, assigned = token[0].removesuffix(" :="), token[0].endswith(" :=")
        return f"#{token[0]}" if name in names and not (assigned and depth) else token[0]

    return _TOKEN.sub(mark, body)
