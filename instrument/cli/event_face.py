"""The event log of a running instrument, from its start to its end."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

from instrument.config import Configuration
from instrument.core import Instrument
from instrument.events.witness import Nowhere, Witness
from instrument.events.writer import Writer
from registers.map import MAP_HASH


@contextmanager
def witnessed(instrument: Instrument, configuration: Configuration, file: Path | None) -> Iterator[Witness]:
    """What the buses are to talk to, so that each write is put down in `file`; None: nowhere.

    Raises ConfigurationError where the file is no event log, or another instrument's.
    """
    writer = Writer(file) if file else None
    witness = Witness(instrument, writer or Nowhere())
    identity = {"map_hash": f"{MAP_HASH:08x}", "configuration_hash": f"{configuration.hash:08x}"}
    witness.begin(
        {"version": version("pneuforce"), **identity, "serial_number": configuration.identity.serial_number},
        time.monotonic(),
    )
    why = "asked to stop"
    try:
        yield witness
    except BaseException as error:
        why = str(error) or type(error).__name__
        raise
    finally:
        try:
            witness.end(why, time.monotonic())
        finally:
            if writer is not None:
                writer.close()
