"""Samples as a table: lines of CSV, or a Parquet file. Times count from the recording's beginning."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any

from instrument.errors import ConfigurationError
from instrument.tape.measured import Measured
from instrument.tape.schema import KINDS, SAMPLE

ROWS_AT_ONCE = 50_000
PREFIX = "pneuforce."  #: of what a Parquet file says about the recording


def since(begin_s: float, samples: Iterable[Measured]) -> Iterator[Measured]:
    """The same samples, their times since the beginning of the recording [s], to the microsecond."""
    for sample in samples:
        yield sample._replace(t_s=round(sample.t_s - begin_s, 6))


def csv_lines(samples: Iterable[Measured]) -> Iterator[str]:
    """Lines of CSV, numbers as exact as they are; an empty cell where a quantity is not available."""
    yield ",".join(SAMPLE) + "\n"
    for sample in samples:
        yield ",".join(map(_cell, sample)) + "\n"


def _cell(value: float) -> str:
    if value != value:
        return ""
    return str(int(value)) if isinstance(value, bool) else repr(value)


def check_parquet() -> None:
    """Raises ConfigurationError where the library that writes Parquet is not there."""
    try:
        import pyarrow  # noqa: F401
    except ImportError:
        raise ConfigurationError(f"Parquet needs pyarrow: {sys.executable} -m pip install pyarrow") from None


def write_parquet(path: Path, samples: Iterable[Measured], about: Mapping[str, Any]) -> None:
    """Write samples as Parquet, null where a quantity is not available. Raises OSError."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = {int: pa.uint32(), float: pa.float64(), bool: pa.bool_()}
    said = {f"{PREFIX}{key}": json.dumps(value) for key, value in about.items()}
    schema = pa.schema([(name, columns[kind]) for name, kind in KINDS.items()], metadata=said)
    remaining = iter(samples)
    with pq.ParquetWriter(path, schema, compression="zstd") as writer:
        while rows := list(islice(remaining, ROWS_AT_ONCE)):
            arrays = [
                pa.array(column, field.type, from_pandas=True)
                for column, field in zip(zip(*rows, strict=True), schema, strict=True)
            ]
            writer.write_table(pa.Table.from_arrays(arrays, schema=schema))
