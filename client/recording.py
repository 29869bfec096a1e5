"""Recording as numpy arrays, and as a table of pandas or polars."""

from __future__ import annotations

import math
import os
import sys
import warnings
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneuforce.client.value_checks import is_number
from pneuforce.errors import ConfigurationError, NotInstalled
from pneuforce.instrument.recording.board_time import EXPORT_TYPES, BoardTime
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.recording.table_export import relative_to_begin

#: Unit by the last part of the name of a column.
_UNITS = {"n": "N", "kpa": "kPa", "mm": "mm", "s": "s", "pa": "Pa", "mv": "mV", "us": "µs"}


class Recording(Mapping[str, NDArray[Any]]):
    """Samples of a recording as numpy arrays, by the name of their column.

    The names end in their unit; docs/recordings.md lists the columns. `t_s` is the time since the begin of
    the recording on the host clock; it can begin some milliseconds below 0, and several samples can have the
    same `t_s`. Use `board_s`, the time on
    the board clock, for intervals. A value that is not available is NaN. `from_s` and `to_s` select a part of
    the recording. A recording is a `collections.abc.Mapping`, with `keys`, `values`, `items` and `get`. The
    arrays are read-only: copy an array to change it.

    Raises ConfigurationError if the file cannot be read. If the file is damaged, the samples before the
    damage are read, and a warning is shown.

    Example:
        recording = pneuforce.Recording("press.recording")
        forces_n = recording["force_n"][recording.valid]
        print(f"{recording.duration_s:.1f} s, {len(forces_n)} valid forces, highest {forces_n.max():.2f} N")
    """

    def __init__(
        self, path: str | os.PathLike[str], *, from_s: float = -math.inf, to_s: float = math.inf
    ) -> None:
        if not path or not isinstance(path, str | os.PathLike):
            raise ConfigurationError(f"{path!r} is invalid: it must be the path of a recording")
        for name, value in (("from_s", from_s), ("to_s", to_s)):
            if not is_number(value) or math.isnan(value):
                raise ConfigurationError(f"{name} = {value!r} is invalid: it must be a number")
        if not from_s < to_s:
            raise ConfigurationError(f"from_s = {from_s!r} must be less than to_s = {to_s!r}")
        self.path = Path(path)
        with open_recording(self.path) as source:
            samples = relative_to_begin(source.begin_s, source.samples(from_s, to_s))
            self._columns = _columns(list(samples))
            #: Properties of the instrument: version, serial number, configuration, calibration and more.
            self.metadata: Mapping[str, Any] = dict(source.metadata)
            #: Records of the event log during the recording.
            self.events: list[Mapping[str, Any]] = list(source.events())
            #: True if the values come from a simulated rig.
            self.simulated: bool = source.simulated
            #: Sentence about damage or an unexpected end of the recording; "" if there is none.
            self.remark: str = source.remark()
            damaged = bool(source.damage)
        if damaged:
            warnings.warn(self.remark, UserWarning, stacklevel=2)

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._columns:
            similar = get_close_matches(str(name), self._columns, 3)
            hint = f"similar: {', '.join(similar)}" if similar else f"columns: {', '.join(self._columns)}"
            raise KeyError(f"the recording has no column {name!r}; {hint}")
        return self._columns[name]

    # Two recordings are never equal, because the comparison of two arrays is an array.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        """Return the number of columns. The number of samples is the length of each column."""
        return len(self._columns)

    def __repr__(self) -> str:
        return (
            f"<{type(self).__name__} {self.path.name}: {len(self['t_s'])} samples, {self.duration_s:.1f} s>"
        )

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Return True for each sample whose force is valid."""
        valid: NDArray[np.bool_] = np.isfinite(self._columns["force_n"])
        return valid

    @property
    def duration_s(self) -> float:
        """Return the time from the first sample to the last sample [s], 0 without samples."""
        t_s = self._columns["t_s"]
        return float(t_s[-1] - t_s[0]) if len(t_s) else 0.0

    @property
    def units(self) -> dict[str, str]:
        """Return the unit of each column, "" for a column without a unit."""
        return {name: _UNITS.get(name.rpartition("_")[2], "") for name in self._columns}

    def to_pandas(self) -> Any:
        """Return a `pandas.DataFrame` with all columns. Raises ConfigurationError without pandas.

        Example:
            table = pneuforce.Recording("press.recording").to_pandas()
            print(table[["t_s", "pressure_kpa", "force_n"]].describe())
        """
        return _library("pandas").DataFrame(self._columns)

    def to_polars(self) -> Any:
        """Return a `polars.DataFrame`, in which a missing value is null.

        Raises ConfigurationError without polars.

        Example:
            table = pneuforce.Recording("press.recording").to_polars()
            print(table["force_n"].max())
        """
        return _library("polars").DataFrame(self._columns, nan_to_null=True)


def _columns(samples: list[Any]) -> dict[str, NDArray[Any]]:
    kinds = {int: np.int64, float: np.float64, bool: np.bool_}
    board = BoardTime()
    rows = [(*sample, board.at_s(sample)) for sample in samples]
    columns = zip(*rows, strict=True) if rows else ((),) * len(EXPORT_TYPES)
    arrays: dict[str, NDArray[Any]] = {
        name: np.array(column, kinds[kind])
        for (name, kind), column in zip(EXPORT_TYPES.items(), columns, strict=True)
    }
    for array in arrays.values():
        array.flags.writeable = False
    return arrays


def _library(name: str) -> ModuleType:
    try:
        return import_module(name)
    except ImportError:
        raise NotInstalled(
            f"the table needs the package {name}: {sys.executable} -m pip install {name}"
        ) from None
