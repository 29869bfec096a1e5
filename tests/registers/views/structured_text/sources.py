"""Source text of the Structured Text library and of the program in the PLC guide, and its declarations."""

import re
from pathlib import Path

from pneuforce.registers.views import structured_text

SOURCE = structured_text.render()
CONSTANTS, LIBRARY = SOURCE.split("END_VAR\n", 1)
GUIDE = (Path(__file__).parents[4] / "docs/plc.md").read_text(encoding="utf-8")
PROGRAM, EXTENDED_PROGRAM = re.findall(r"```iecst\n(.*?)```", GUIDE, re.DOTALL)
TEXT = LIBRARY + PROGRAM
_VARIABLE = re.compile(r"^    (\w+) : (\w+)(?: := [^;]*)?;", re.MULTILINE)


def blocks_of(text):
    """Return the names of the function blocks and programs in a text."""
    return re.findall(r"^(?:FUNCTION_BLOCK|PROGRAM) (\w+)$", text, re.MULTILINE)


BLOCKS = blocks_of(TEXT)


def members(kind, name, text=TEXT):
    """Return the name and type of each variable of a block or structure."""
    found = re.search(rf"^{kind} {name}\b(.*?)^END_{kind}", text, re.MULTILINE | re.DOTALL)
    return _VARIABLE.findall(found[1])


def members_of(block, text=TEXT):
    """Return the name and type of each variable of a function block or of a program."""
    return members("PROGRAM" if f"PROGRAM {block}\n" in text else "FUNCTION_BLOCK", block, text)


def nested_members_of(block, text):
    """Return name, C expression and type of each variable of a block and of its inner blocks."""
    for name, type_ in members_of(block, text):
        yield name, name.upper(), type_
        if type_ in blocks_of(text):
            for inner, path, inner_type in nested_members_of(type_, text):
                yield f"{name}.{inner}", f"{name.upper()}.{path}", inner_type
