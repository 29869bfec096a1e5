"""Check of the valid part of an invalid configuration, so that all problems are reported at once."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from pneuforce.errors import ConfigurationFileError
from pneuforce.instrument.config import Configuration
from pneuforce.instrument.service.checks.file_checks import check_files
from pneuforce.support.toml_sections import InvalidTables


def problems_of_valid_part(error: ConfigurationFileError, path: Path) -> list[str]:
    """Return the problems of the files that the valid keys of an invalid configuration file name.

    `error` states the wrong values. The result is empty if the file contains no tables at all.
    """
    if not isinstance(error.__cause__, InvalidTables):
        return []
    configuration, removed = _valid_part(copy.deepcopy(dict(error.__cause__.tables)))
    problems = check_files(configuration, path).problems
    return [f"{path}: {problem}" for problem in problems if not problem.startswith(tuple(removed))]


def _valid_part(tables: dict[str, Any]) -> tuple[Configuration, list[str]]:
    """Return the configuration without the wrong keys, and the beginnings of their names."""
    removed: list[str] = []
    while True:
        try:
            return Configuration.model_validate(tables), removed
        except ValidationError as error:
            removed += [_remove(tables, *details["loc"]) for details in error.errors()]


def _remove(tables: dict[str, Any], table: int | str, *keys: int | str) -> str:
    """Remove a key, or a table if the table does not contain the key. Return the beginning of its name."""
    name, section = str(table), tables.get(str(table))
    if keys and isinstance(section, dict) and keys[0] in section:
        del section[str(keys[0])]
        return f"{name}.{keys[0]}:"
    tables.pop(name, None)
    return f"{name}."
