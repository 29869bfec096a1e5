"""Copies of the code in which a test plants errors."""

import shutil
from pathlib import Path

from tests.source_tree import PARTS, ROOT


def copy_code(folder: Path, *parts: str) -> None:
    """Copy parts of the code into a folder. Links stand for the rest of the product and the tests."""
    ignored = shutil.ignore_patterns("__pycache__")
    for name in ("pneuforce", *parts):
        shutil.copytree(ROOT / name, folder / name, symlinks=True, ignore=ignored)
    for name in {*PARTS, "tests"}.difference(parts):
        (folder / name).symlink_to(ROOT / name)
    shutil.copy(ROOT / "pyproject.toml", folder)


def replace_once(file: Path, old: str, new: str) -> None:
    """Replace a text in a file. Raises ValueError if the text does not occur exactly once."""
    text = file.read_text(encoding="utf-8")
    if text.count(old) != 1:
        raise ValueError(f"{file.name} contains {text.count(old)} times: {old}")
    file.write_text(text.replace(old, new), encoding="utf-8")
