"""`pneuforce record`: record a running instrument into a file, and print a summary."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread
from typing import NamedTuple

from rich.console import Console
from rich.live import Live
from rich.text import Text

from pneuforce.errors import PneuforceError, ServerError
from pneuforce.instrument.cli.terminal.exit_codes import exit_code_of
from pneuforce.instrument.cli.terminal.failure import failure_values
from pneuforce.instrument.cli.terminal.output import (
    CONNECTION_HINT,
    json_text,
    print_done,
    print_text,
    stop_after,
)
from pneuforce.instrument.recording.limits import NO_LIMITS, RecordingLimits
from pneuforce.instrument.recording.schema import EndReason
from pneuforce.instrument.recording.writer import RecordingWriteError, RecordingWriter
from pneuforce.instrument.service.local_socket.recorder import (
    OnCommit,
    RecorderResult,
    record_socket,
    served_demo_sockets,
)
from pneuforce.protocol.frames import BoardState
from pneuforce.support.counted import counted

_STATES = {state.value: state.name.lower() for state in BoardState}


class RecordEnd(NamedTuple):
    """Conditions that end a recording, in addition to Ctrl-C, SIGTERM and the end of the instrument."""

    limits: RecordingLimits = NO_LIMITS
    until_stdin_closes: bool = False  #: end when the program that started this process ends


def record(path: Path, socket_path: Path, end: RecordEnd, as_json: bool) -> int:
    """Record until a condition of `end` is fulfilled, and print the result. Return the exit code.

    Raises ConfigurationError if the file cannot be created, ServerError if no instrument answers. Without
    `as_json`, also raises the error of a recording that is not complete.
    """
    stop = stop_after(None)
    if end.until_stdin_closes:
        Thread(target=_set_at_end_of_stdin, args=(stop,), daemon=True).start()
    try:
        with _progress() as show:
            result = record_socket(path, socket_path, stop, show, end.limits)
    except ServerError as error:
        raise ServerError(f"{error}; {CONNECTION_HINT}") from None
    return _print_result(result, as_json)


def _set_at_end_of_stdin(stop: Event) -> None:
    while os.read(sys.stdin.fileno(), 4096):
        pass
    stop.set()


def socket_of_demo() -> Path:
    """Return the local socket of the only demo that this user runs. Raises ServerError."""
    sockets = served_demo_sockets()
    if len(sockets) == 1:
        return sockets[0]
    if not sockets:
        raise ServerError(
            f"this user runs no demo: name an instrument with --config or --socket; {CONNECTION_HINT}"
        )
    raise ServerError(f"several demos are running: choose one with --socket: {', '.join(map(str, sockets))}")


@contextmanager
def _progress() -> Iterator[OnCommit]:
    """Show the progress as a line on stderr if stderr is a terminal."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _: None
        return
    with Live(console=console, auto_refresh=False, transient=True) as live:
        yield lambda file: live.update(Text(progress_line(file)), refresh=True)


def progress_line(file: RecordingWriter) -> str:
    """Return the progress of a recording: duration, samples, size, state of the rig."""
    state = _STATES.get(file.last_sample.state, "") if file.last_sample else "no samples yet"
    minutes, seconds = divmod(int(file.extent_s), 60)
    hours, minutes = divmod(minutes, 60)
    size_mb = file.size_bytes / 1e6
    return (
        f"{hours:02}:{minutes:02}:{seconds:02}  {counted(file.samples, 'sample')}  {size_mb:.1f} MB  {state}"
    )


def _print_result(result: RecorderResult, as_json: bool) -> int:
    """Print the result of a recording. Return the exit code. Without `as_json`, raise its error."""
    facts = {
        "file": str(result.path),
        "ended": result.reason.value,
        "why": result.detail,
        "seconds": result.duration_s,
        "samples": result.samples,
        "events": result.events,
        "bytes": result.size_bytes,
    }
    error = _error_of(result)
    if error is None:
        print_done(_sentence(result), as_json, **facts)
    elif as_json:
        print_text(json_text({**failure_values(error), **facts}))
    else:
        raise error
    return 0 if error is None else exit_code_of(error)


def _error_of(result: RecorderResult) -> PneuforceError | None:
    """Return the error of a recording that is not complete, None for a complete recording."""
    if result.complete:
        return None
    kind = RecordingWriteError if result.reason is EndReason.UNWRITABLE else PneuforceError
    return kind(_sentence(result))


def _sentence(result: RecorderResult) -> str:
    limit_reached = result.reason is EndReason.STOPPED and result.detail
    reason = result.detail if limit_reached else ": ".join(filter(None, (result.reason.value, result.detail)))
    size_mb = result.size_bytes / 1e6
    extent = f"{result.duration_s:.1f} s, {counted(result.samples, 'sample')}, {size_mb:.1f} MB"
    return f"{result.path}: {extent}; {reason}"
