"""Export of rows as CSV or Parquet. Times count from the beginning of the recording."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any

from pneuforce.errors import NotInstalled
from pneuforce.instrument.stream.sample_record import SampleRecord

#: One row of a table. A text contains neither a comma nor a line break.
Row = tuple[Any, ...]
ROWS_PER_BATCH = 50_000
METADATA_PREFIX = "pneuforce."  #: prefix of the metadata keys in a Parquet file


def relative_to_begin(begin_s: float, samples: Iterable[SampleRecord]) -> Iterator[SampleRecord]:
    """Yield the samples with times since `begin_s` [s], rounded to the microsecond."""
    for sample in samples:
        yield sample._replace(t_s=round(sample.t_s - begin_s, 6))


def csv_lines(rows: Iterable[Row], columns: Iterable[str]) -> Iterator[str]:
    """Yield lines of CSV. Numbers have full precision. A quantity that is not available is an empty cell."""
    yield ",".join(columns) + "\n"
    for row in rows:
        yield ",".join(map(_cell, row)) + "\n"


def _cell(value: float | str) -> str:
    if value != value:
        return ""
    if isinstance(value, str):
        return value
    return str(int(value)) if isinstance(value, bool) else repr(value)


def check_parquet() -> None:
    """Raise NotInstalled if the library that writes Parquet is not installed."""
    try:
        import pyarrow  # noqa: F401
    except ImportError:
        raise NotInstalled(
            f"the Parquet format needs the package pyarrow: {sys.executable} -m pip install pyarrow"
        ) from None


def write_parquet(
    path: Path, rows: Iterable[Row], types: Mapping[str, type], metadata: Mapping[str, Any]
) -> None:
    """Write rows as Parquet. A quantity that is not available is null. Raises OSError.

    `types` contains the Python type of each column.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    column_types = {int: pa.uint32(), float: pa.float64(), bool: pa.bool_(), str: pa.string()}
    schema = pa.schema(
        [(name, column_types[kind]) for name, kind in types.items()],
        metadata={f"{METADATA_PREFIX}{key}": json.dumps(value) for key, value in metadata.items()},
    )
    remaining = iter(rows)
    with pq.ParquetWriter(path, schema, compression="zstd") as writer:
        while batch := list(islice(remaining, ROWS_PER_BATCH)):
            arrays = [
                pa.array(column, field.type, from_pandas=True)
                for column, field in zip(zip(*batch, strict=True), schema, strict=True)
            ]
            writer.write_table(pa.Table.from_arrays(arrays, schema=schema))
