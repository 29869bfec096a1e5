"""Tables kept on disk, because one takes seconds to build. What is not as it should be is built anew."""

from __future__ import annotations

import hashlib
from contextlib import suppress
from dataclasses import astuple, fields
from pathlib import Path

import numpy as np

from sim.kept import directory, whole
from sim.membrane.family import Progress
from sim.membrane.material import Rubber
from sim.membrane.table import COLUMNS, LEAST_FREE_KPA, MOST_FREE_STRETCH, ROWS, Table, build
from sim.plant import AMBIENT_KPA, HARDEST_N, TUBES_MM3

#: To be raised with every change of what a table holds or of how it is computed.
TABLE_VERSION = 1
SHAPES = {
    "gas_kpa_mm3": (ROWS,),
    "highest_n": (ROWS,),
    "pressure_kpa": (ROWS, COLUMNS),
    "half_height_mm": (ROWS, COLUMNS),
}


def kept_table(rubber: Rubber, sides: int, progress: Progress) -> Table:
    """The table from disk, or a new one, which is left there if the disk lets us."""
    key = _key(rubber, sides)
    path = directory() / f"membrane-{key[:16]}.npz"
    table = _read(path, key)
    if table is None:
        table = build(rubber, sides, progress)
        with suppress(OSError):
            _write(path, key, table)
    return table


def _key(rubber: Rubber, sides: int) -> str:
    grid = (ROWS, COLUMNS, HARDEST_N, LEAST_FREE_KPA, MOST_FREE_STRETCH, TUBES_MM3, AMBIENT_KPA)
    return hashlib.sha256(repr((TABLE_VERSION, astuple(rubber), sides, grid)).encode()).hexdigest()


def _read(path: Path, key: str) -> Table | None:
    try:
        with path.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
            arrays = {name: file[name] for name in SHAPES}
            sound = str(file["key"]) == key and all(
                arrays[name].shape == shape
                and arrays[name].dtype == float
                and np.isfinite(arrays[name]).all()
                for name, shape in SHAPES.items()
            )
    except Exception:  # numpy, zipfile and tokenize each have their own for a spoilt file
        return None
    return Table(**arrays) if sound else None


def _write(path: Path, key: str, table: Table) -> None:
    with whole(path) as part, part.open("wb") as file:
        np.savez(file, key=key, **{field.name: getattr(table, field.name) for field in fields(table)})
