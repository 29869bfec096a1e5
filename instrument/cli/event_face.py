"""The event log of a running instrument, from its start to its end."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

from instrument.config import Configuration
from instrument.coupling import Coupling
from instrument.events.record import Record, body_of
from instrument.events.witness import Journal, Nowhere, Witness
from instrument.events.writer import Writer
from instrument.tape.entry import Kind
from instrument.tape.feed import Feed
from registers.map import MAP_HASH


class Told:
    """A journal whose records are also told to who listens."""

    def __init__(self, journal: Journal, feed: Feed) -> None:
        self._journal = journal
        self._feed = feed

    @property
    def trouble(self) -> str:
        """Why records cannot be kept now, empty where they can."""
        return self._journal.trouble

    def put(self, record: Record) -> None:
        """Take a record."""
        self._journal.put(record)
        if self._feed.listeners:
            self._feed.note(Kind.EVENT, record.at.mono_s, body_of(record))


@contextmanager
def witnessed(
    coupling: Coupling, configuration: Configuration, file: Path | None, feed: Feed
) -> Iterator[Witness]:
    """What the buses are to talk to, so that each write is put down in `file`, if any, and told to `feed`.

    Raises ConfigurationError where the file is no event log, or another instrument's.
    """
    writer = Writer(file) if file else None
    journal = Told(writer or Nowhere(), feed)
    witness = Witness(coupling, journal)
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
