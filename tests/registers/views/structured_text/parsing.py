"""Syntax trees of Structured Text from blark, which are kept in build/: blark needs seconds for a block."""

import hashlib
import pickle
import re
from functools import cache
from importlib.metadata import version
from pathlib import Path

from blark.parse import parse_source_code

CACHE = Path(__file__).parents[4] / "build/structured-text"
_DECLARATION = re.compile(r"\n(?=TYPE|FUNCTION_BLOCK|PROGRAM)")


@cache
def declarations(text):
    """Return the syntax tree of each type, function block and program in a text without global variables."""
    parts = _DECLARATION.split("\n" + re.sub(r"\(\*.*?\*\)", "", text, flags=re.DOTALL))
    return [item for part in parts if part.strip() for item in tree_of(part).items]


def tree_of(text):
    """Return the syntax tree of a text. Raises the exception of blark if the text cannot be parsed."""
    name = hashlib.sha256(f"{version('blark')}\n{text}".encode()).hexdigest()
    file = CACHE / name
    if file.is_file():
        return pickle.loads(file.read_bytes())
    parsed = parse_source_code(text)
    if parsed.exception is not None:
        raise parsed.exception
    tree = parsed.transform()
    CACHE.mkdir(parents=True, exist_ok=True)
    part = file.with_suffix(f".{id(tree)}")
    part.write_bytes(pickle.dumps(tree))
    part.replace(file)  # another process can parse the same text
    return tree
