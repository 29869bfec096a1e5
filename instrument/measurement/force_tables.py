"""Tables of the method `membrane`: from memory, from the cache on disk, or computed in about ten seconds."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable
from contextlib import suppress
from dataclasses import astuple
from pathlib import Path
from typing import TYPE_CHECKING

from pneuforce.instrument.model import Balloon, Circuit
from pneuforce.support.cache_dir import cache_directory, cached_file

if TYPE_CHECKING:
    from pneuforce.instrument.model.membrane.table import ForceTable

log = logging.getLogger(__name__)

#: Increment this number after each change of the content or the computation of a table.
TABLE_VERSION = 2
#: Number of tables that a process keeps in its memory.
TABLES_IN_MEMORY = 8

ProgressCallback = Callable[[int, int], None]

_in_memory: dict[str, ForceTable] = {}


def force_table(
    balloon: Balloon, circuit: Circuit, sides: int, progress: ProgressCallback = lambda _done, _all: None
) -> ForceTable:
    """Return the table of a balloon in its circuit.

    A missing table is computed, and written to the cache if possible. `progress(done, total)` is called
    during the computation.
    """
    key = _key(balloon, circuit, sides)
    if key not in _in_memory:
        if len(_in_memory) >= TABLES_IN_MEMORY:
            _in_memory.clear()
        path = cache_directory() / f"force-{key[:16]}.npz"
        _in_memory[key] = _read(path, key) or _computed(balloon, circuit, sides, progress, path, key)
    return _in_memory[key]


def _key(balloon: Balloon, circuit: Circuit, sides: int) -> str:
    """Return a text that identifies the table: the hash of all numbers that the table depends on."""
    radius = (
        balloon.rest_radius_mm,
        balloon.radius_linear_mm_per_kpa,
        balloon.radius_quadratic_mm_per_kpa2,
        balloon.skin,
    )
    return hashlib.sha256(repr((TABLE_VERSION, radius, astuple(circuit), sides)).encode()).hexdigest()


def _computed(
    balloon: Balloon, circuit: Circuit, sides: int, progress: ProgressCallback, path: Path, key: str
) -> ForceTable:
    from pneuforce.instrument.model.membrane.table import compute_table

    log.info("computing the force table of the balloon, about ten seconds")
    table = compute_table(balloon, circuit, sides, progress)
    with suppress(OSError):
        _write(path, key, table)
    return table


def _read(path: Path, key: str) -> ForceTable | None:
    """Return the table of a file, None if the file is missing, damaged or another table."""
    import numpy as np

    from pneuforce.instrument.model.membrane.table import SHAPE, ForceTable

    try:
        with path.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
            values, ambient_kpa = file["values"], float(file["ambient_kpa"])
            valid = str(file["key"]) == key and values.shape == SHAPE and values.dtype == float
    except Exception:  # numpy, zipfile and tokenize each raise their own exceptions for a damaged file
        return None
    return ForceTable(values, ambient_kpa) if valid else None


def _write(path: Path, key: str, table: ForceTable) -> None:
    import numpy as np

    with cached_file(path) as temporary, temporary.open("wb") as file:
        np.savez(file, key=key, values=table.values, ambient_kpa=table.ambient_kpa)
