"""Paths of the files that a configuration names."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from pneuforce.support.toml_sections import Section


def resolve_path(configuration_file: Path, name: str) -> Path | None:
    """Return the path of a file that a configuration names, None for an empty name.

    Relative names are relative to the folder of the configuration file. A configuration that is read
    from a pipe (/dev/stdin) has no folder, so the current folder is used.
    """
    folder = Path() if configuration_file.is_relative_to("/dev") else configuration_file.parent
    return folder / name if name else None


def absolute_paths(configuration_file: Path, section: Section, keys: Iterable[str]) -> dict[str, str]:
    """Return the absolute path of the file that each key of a section names, "" for an empty name."""
    paths = {key: resolve_path(configuration_file, getattr(section, key)) for key in keys}
    return {key: str(path.absolute()) if path else "" for key, path in paths.items()}
