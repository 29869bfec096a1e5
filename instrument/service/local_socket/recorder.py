"""Recorder that reads the entries of a running instrument from its local socket and writes a recording."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable
from contextlib import ExitStack, closing, suppress
from pathlib import Path
from tempfile import gettempdir
from threading import Event
from typing import NamedTuple

from pneuforce.errors import ConfigurationError, ServerError
from pneuforce.instrument.recording.limits import NO_LIMITS, RecordingLimits
from pneuforce.instrument.recording.schema import EndReason
from pneuforce.instrument.recording.writer import RecordingWriteError, RecordingWriter, check_path_unused
from pneuforce.instrument.stream.entry import (
    EntryDecoder,
    EntryKind,
    StreamEntry,
    StreamError,
    encode,
    json_entry,
)

COMMIT_PERIOD_S = 0.2  #: a killed recorder loses the entries since its last commit
RECEIVE_TIMEOUT_S = 0.02  #: time between two checks of the stop event
FIRST_ENTRY_TIMEOUT_S = 5.0
MAX_RECEIVED_BYTES = 1 << 20
#: Detail of a connection that ended without an END entry. The recorder cannot find out which cause applies,
#: because the socket of a killed instrument accepts connections until the system has closed all its files.
NO_END = (
    "the connection ended without the final message of the instrument: the instrument was killed, or it "
    "disconnected this recorder, which read too slowly (then the log of the instrument says so)"
)
#: Sockets of running demos: a pattern in the folder for temporary files.
DEMO_SOCKETS = "pneuforce-*/pneuforce.sock"

OnCommit = Callable[[RecordingWriter], None]


class RecorderResult(NamedTuple):
    """Content of a finished recording and the reason why it ended."""

    path: Path
    reason: EndReason
    detail: str  #: details of the reason, empty if there are none
    duration_s: float
    samples: int
    events: int
    size_bytes: int

    @property
    def complete(self) -> bool:
        """Return True if the recording ended on request or with the instrument."""
        return self.reason in (EndReason.END, EndReason.STOPPED)


class _End(NamedTuple):
    """Reason why the stream of entries ended."""

    reason: EndReason
    detail: str = ""


def record_socket(
    path: Path,
    socket_path: Path,
    stop: Event,
    on_commit: OnCommit,
    limits: RecordingLimits = NO_LIMITS,
) -> RecorderResult:
    """Record an instrument into the new file `path` until `stop` is set or the instrument ends.

    The recording also ends when it reaches a limit. `on_commit` is called after each commit.

    Raises ConfigurationError if the file cannot be created or a limit is reached already, ServerError if no
    instrument answers.
    """
    check_path_unused(path)
    limits.check_start(path.parent)
    with ExitStack() as stack:
        connection = stack.enter_context(closing(_connect(socket_path)))
        file = RecordingWriter(path)
        stack.callback(file.close)
        try:
            end = _write_entries(connection, file, stop, on_commit, limits)
            if not file.has_header:
                file.discard()
                raise ServerError(f"{socket_path}: {end.detail or 'no data was received'}")
            file.end(*end)
            file.commit()
        except RecordingWriteError as error:
            end = _End(EndReason.UNWRITABLE, str(error))
            _report_failure(connection, f"{path} cannot be written: {error}")
    return RecorderResult(
        path, *end, round(file.extent_s, 3), file.committed_samples, file.events, file.size_bytes
    )


def served_demo_sockets() -> list[Path]:
    """Return the local sockets of the demos that this user runs."""
    return [file for file in Path(gettempdir()).glob(DEMO_SOCKETS) if _is_served(file)]


def _is_served(file: Path) -> bool:
    """Return True if the socket belongs to this user and a program accepts its connections."""
    with suppress(OSError):
        if file.stat().st_uid == os.getuid():
            _connect(file).close()
            return True
    return False


def _connect(socket_path: Path) -> socket.socket:
    connection = socket.socket(socket.AF_UNIX)
    try:
        connection.connect(str(socket_path))
    except PermissionError:
        connection.close()
        raise ConfigurationError(
            f"{socket_path}: only the user of the instrument can record: run the command as this user, for "
            "example with sudo -u pneuforce"
        ) from None
    except OSError as error:
        connection.close()
        raise ServerError(f"{socket_path}: {error.strerror or error}") from None
    connection.settimeout(RECEIVE_TIMEOUT_S)
    return connection


def _write_entries(
    connection: socket.socket,
    file: RecordingWriter,
    stop: Event,
    on_commit: OnCommit,
    limits: RecordingLimits,
) -> _End:
    """Write the received entries until the stream ends, `stop` is set or a limit is reached.

    Raises RecordingWriteError.
    """
    decoder, started_s = EntryDecoder(), time.monotonic()
    commit_s = started_s + COMMIT_PERIOD_S
    try:
        connection.sendall(encode(json_entry(EntryKind.SUBSCRIBE, 0.0, {"want": "record"})))
        while not stop.is_set():
            data = _receive(connection)
            for entry in decoder.feed(data or b""):
                if entry.kind is EntryKind.END:
                    return _End(EndReason.END, _detail_of(entry))
                file.add_entry(entry)
            if data == b"":
                return _End(EndReason.CUT_OFF, NO_END if file.has_header else "the connection was closed")
            now_s = time.monotonic()
            if reason := limits.over(now_s - started_s):
                return _End(EndReason.STOPPED, reason)
            if now_s >= commit_s:
                commit_s = now_s + COMMIT_PERIOD_S
                file.commit()
                on_commit(file)
                if reason := limits.reached(file.path.parent, file.size_bytes):
                    return _End(EndReason.STOPPED, reason)
            if not file.has_header and now_s > started_s + FIRST_ENTRY_TIMEOUT_S:
                return _End(EndReason.CUT_OFF, f"no data was received for {FIRST_ENTRY_TIMEOUT_S:g} s")
    except StreamError as error:
        return _End(EndReason.CUT_OFF, f"the data does not have the format of this version: {error}")
    except RecordingWriteError:
        raise
    except OSError as error:
        return _End(EndReason.CUT_OFF, f"the connection was lost: {error.strerror or error}")
    return _End(EndReason.STOPPED)


def _receive(connection: socket.socket) -> bytes | None:
    """Return the received bytes: None if no bytes have arrived, empty at the end of the connection."""
    try:
        return connection.recv(MAX_RECEIVED_BYTES)
    except TimeoutError:
        return None


def _detail_of(entry: StreamEntry) -> str:
    facts = entry.json_body
    return str(facts.get("why", "")) if isinstance(facts, dict) else ""


def _report_failure(connection: socket.socket, why: str) -> None:
    """Report the failure to the instrument, which sets `maintenance_required` until the next recording."""
    with suppress(OSError):
        connection.settimeout(1.0)
        connection.sendall(encode(StreamEntry(EntryKind.FAILURE, time.monotonic(), why.encode())))
