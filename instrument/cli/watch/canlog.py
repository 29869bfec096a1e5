"""`pneuforce canlog`: record all frames on a CAN bus in a file format of other tools."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from threading import Event
from typing import IO, Any

from pneuforce.errors import ConfigurationError, ServerError, WriteFailed
from pneuforce.instrument.cli.terminal.output import CONNECTION_HINT, stop_after
from pneuforce.registers.can.bus import CanAddress, CanBus
from pneuforce.registers.can.log_writer import LOG_FORMATS, CanLogWriter
from pneuforce.registers.can.wire import CanFrame
from pneuforce.support.counted import counted
from pneuforce.support.write_error import REMEDY, write_error


def record(address: CanAddress, log_format: str, output: Path | None, seconds: float | None) -> None:
    """Write all frames to the new file `output`, or to stdout, until `seconds` have passed or Ctrl-C.

    Raises ConfigurationError if the file cannot be created, ServerError if the bus is not available, and
    WriteFailed if the file cannot be written.
    """
    frames = _frames(address, stop_after(seconds))
    next(frames)
    log = CanLogWriter(_open_output(log_format, output), log_format, address.channel)
    try:
        with closing(log):
            for t_s, frame in filter(None, frames):
                log.write(t_s, frame)
    except (ServerError, BrokenPipeError):
        raise
    except OSError as error:
        raise WriteFailed(
            f"{output or 'stdout'} cannot be written: {error.strerror}; it contains "
            f"{counted(log.frame_count, 'frame')}: {REMEDY}"
        ) from None
    print(f"pneuforce: {counted(log.frame_count, 'frame')} on {address}", file=sys.stderr)


def _frames(address: CanAddress, stop: Event) -> Iterator[tuple[float, CanFrame] | None]:
    """Yield time and frame of each received frame, and None if no frame arrives for a short time.

    The first item is None and shows that the bus is open. The file is created only then.
    """
    try:
        with closing(CanBus(address)) as bus:
            yield None
            while not stop.is_set():
                yield bus.receive()
    except OSError as error:
        raise ServerError(f"{error}; {CONNECTION_HINT}") from None


def _open_output(log_format: str, output: Path | None) -> IO[Any]:
    """Open the output file or stdout. An existing file is not overwritten: it may contain a recording."""
    text = LOG_FORMATS[log_format][1]
    if output is None and not text:
        raise ConfigurationError(f"{log_format} cannot be written to stdout: name a file with --output")
    target, mode = (output, "x") if output else (sys.stdout.fileno(), "w")
    try:
        if text:
            return open(target, mode, buffering=1, encoding="ascii", closefd=output is not None)
        return open(target, mode + "b")
    except FileExistsError:
        raise ConfigurationError(f"{output} already exists: choose another name") from None
    except OSError as error:
        raise write_error(output or Path("stdout"), error) from None
