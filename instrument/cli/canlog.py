"""`pneuforce canlog`: everything on the CAN bus, kept for other tools."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from threading import Event
from typing import IO, Any

from instrument.cli.showing import HINT, stop_after
from instrument.errors import ConfigurationError, FaceError
from registers.can.bus import Bus, BusAt
from registers.can.recording import WRITERS, Recording
from registers.can.wire import CanFrame


def record(at: BusAt, form: str, output: Path | None, seconds: float | None) -> None:
    """Write all frames to `output`, a new file, or to stdout, until `seconds` have passed or Ctrl-C.

    Raises ConfigurationError: no such file can be made; FaceError: no bus, or no room for more.
    """
    frames = _frames(at, stop_after(seconds))
    next(frames)
    recording = Recording(_opened(form, output), form, at.channel)
    try:
        with closing(recording):
            for t_s, frame in filter(None, frames):
                recording.note(t_s, frame)
    except (FaceError, BrokenPipeError):
        raise
    except OSError as error:
        raise FaceError(
            f"{output or 'stdout'} cannot be written: {error.strerror}; {recording.frames} frames are in it"
        ) from None
    print(f"pneuforce: {recording.frames} frames on {at}", file=sys.stderr)


def _frames(at: BusAt, stop: Event) -> Iterator[tuple[float, CanFrame] | None]:
    """None once the bus is open, so that a file is made only then; and what comes, None for silence."""
    try:
        with closing(Bus(at)) as bus:
            yield None
            while not stop.is_set():
                yield bus.receive()
    except OSError as error:
        raise FaceError(f"{error}; {HINT}") from None


def _opened(form: str, output: Path | None) -> IO[Any]:
    """The file: never one that is there, because nobody makes a recording twice."""
    text = WRITERS[form][1]
    if output is None and not text:
        raise ConfigurationError(f"{form} needs a file: give it with --output")
    where, mode = (output, "x") if output else (sys.stdout.fileno(), "w")
    try:
        if text:
            return open(where, mode, buffering=1, encoding="ascii", closefd=output is not None)
        return open(where, mode + "b")
    except FileExistsError:
        raise ConfigurationError(f"{output} is there already: choose another name") from None
    except OSError as error:
        raise ConfigurationError(f"{output} cannot be made: {error.strerror}") from None
