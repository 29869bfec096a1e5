"""Copies of the code in which a test plants errors."""

import shutil
from pathlib import Path

from tests.source_tree import PARTS, ROOT


def copy_code(folder: Path) -> None:
    """Copy the product and its tests into a folder, with the links in `pneuforce/`. Both run there."""
    ignored = shutil.ignore_patterns("__pycache__")
    for name in (*PARTS, "pneuforce", "tests"):
        shutil.copytree(ROOT / name, folder / name, symlinks=True, ignore=ignored)
    shutil.copy(ROOT / "pyproject.toml", folder)


def replace_once(file: Path, old: str, new: str) -> None:
    """Replace a text in a file. Raises ValueError if the text does not occur exactly once."""
    text = file.read_text(encoding="utf-8")
    if text.count(old) != 1:
        raise ValueError(f"{file.name} contains {text.count(old)} times: {old}")
    file.write_text(text.replace(old, new), encoding="utf-8")
