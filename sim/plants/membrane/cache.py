"""Cache of membrane tables on disk, because computing a table takes seconds. Invalid files are replaced."""

from __future__ import annotations

import hashlib
from contextlib import suppress
from dataclasses import astuple, fields
from pathlib import Path

import numpy as np

from pneuforce.sim.plants.membrane.material import Rubber
from pneuforce.sim.plants.membrane.paths import Contact, Sides
from pneuforce.sim.plants.membrane.table import (
    COLUMNS,
    MAX_FREE_STRETCH,
    MIN_FREE_KPA,
    ROWS,
    MembraneTable,
    ProgressCallback,
    compute_table,
)
from pneuforce.sim.plants.plant import AMBIENT_KPA, MAX_PUSH_N, TUBES_MM3
from pneuforce.support.cache_dir import cache_directory, cached_file

#: Increment this number after each change of the content or the computation of a table.
TABLE_VERSION = 2
SHAPES = {
    "gas_kpa_mm3": (ROWS,),
    "highest_n": (ROWS,),
    "pressure_kpa": (ROWS, COLUMNS),
    "half_height_mm": (ROWS, COLUMNS),
}


def cached_table(rubber: Rubber, sides: Sides, contact: Contact, progress: ProgressCallback) -> MembraneTable:
    """Return the table from the cache. A missing table is computed, and written to the cache if possible."""
    key = _key(rubber, sides, contact)
    path = cache_directory() / f"membrane-{key[:16]}.npz"
    table = _read(path, key)
    if table is None:
        table = compute_table(rubber, sides, contact, progress)
        with suppress(OSError):
            _write(path, key, table)
    return table


def _key(rubber: Rubber, sides: Sides, contact: Contact) -> str:
    grid = (ROWS, COLUMNS, MAX_PUSH_N, MIN_FREE_KPA, MAX_FREE_STRETCH, TUBES_MM3, AMBIENT_KPA)
    balloon = (type(rubber).__name__, astuple(rubber), sides, contact)
    return hashlib.sha256(repr((TABLE_VERSION, balloon, grid)).encode()).hexdigest()


def _read(path: Path, key: str) -> MembraneTable | None:
    try:
        with path.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
            arrays = {name: file[name] for name in SHAPES}
            valid = str(file["key"]) == key and all(
                arrays[name].shape == shape
                and arrays[name].dtype == float
                and np.isfinite(arrays[name]).all()
                for name, shape in SHAPES.items()
            )
    except Exception:  # numpy, zipfile and tokenize each raise their own exceptions for a damaged file
        return None
    return MembraneTable(**arrays) if valid else None


def _write(path: Path, key: str, table: MembraneTable) -> None:
    with cached_file(path) as temporary, temporary.open("wb") as file:
        np.savez(file, key=key, **{field.name: getattr(table, field.name) for field in fields(table)})
