"""`pneuforce record`: the tape of a running instrument, from its local socket into a file."""

from __future__ import annotations

import json
import os
import socket
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path
from tempfile import gettempdir
from threading import Event
from typing import NamedTuple

from rich.console import Console
from rich.live import Live
from rich.text import Text

from instrument.cli.showing import HINT, stop_after
from instrument.errors import FaceError
from instrument.rig.frames import BoardState
from instrument.tape.entry import Decoder, Entry, Kind, TapeError, encode, told
from instrument.tape.file import TapeFile, Unwritable, refuse_taken
from instrument.tape.schema import How

COMMIT_S = 0.2  #: what is not yet committed is lost where the recorder is killed
LISTEN_S = 0.02  #: between two looks at whether it is to stop
BEGIN_WAIT_S = 5.0
LET_GO = "the instrument goes on, and let go of this recorder, which was too far behind"
AT_ONCE = 1 << 20
DEMOS = "pneuforce-*/pneuforce.sock"  #: below the folder for temporary files
_STATES = {state.value: state.name.lower() for state in BoardState}

Show = Callable[[TapeFile], None]


class Ended(NamedTuple):
    """Why no more entries come."""

    how: How
    why: str = ""

    def __str__(self) -> str:
        return f"{self.how.value}{f': {self.why}' if self.why else ''}"


def record(path: Path, at: Path, seconds: float | None, as_json: bool) -> int:
    """Record until `seconds` have passed, Ctrl-C, SIGTERM or the end of the instrument; the exit code.

    Raises ConfigurationError: no such file can be made; FaceError: no instrument there.
    """
    stop = stop_after(seconds)
    refuse_taken(path)
    with ExitStack() as stack:
        line = stack.enter_context(closing(_connected(at)))
        file = TapeFile(path)
        stack.callback(file.close)
        try:
            with _progress() as show:
                ended = _take(line, at, file, stop, show)
            if not file.begun:
                file.discard()
                raise FaceError(f"{at}: {ended.why or 'nothing came as yet'}; {HINT}")
            file.end(*ended)
            file.commit()
        except Unwritable as error:
            ended = Ended(How.UNWRITABLE, str(error))
            _tell_trouble(line, f"{path} cannot be written: {error}")
    _say_end(file, ended, as_json)
    return 0 if ended.how in (How.END, How.STOPPED) else 1


def socket_of_demo() -> Path:
    """The local socket of the demo that this user runs. Raises FaceError where there is none, or several."""
    found = [file for file in Path(gettempdir()).glob(DEMOS) if _is_served(file)]
    if len(found) == 1:
        return found[0]
    if not found:
        raise FaceError(f"no demo runs here: name an instrument with --config or --socket; {HINT}")
    raise FaceError(f"several demos run here: name one with --socket: {', '.join(map(str, found))}")


def _is_served(file: Path) -> bool:
    """Whether it is our own, and somebody answers."""
    with suppress(OSError):
        if file.stat().st_uid == os.getuid():
            _connected(file).close()
            return True
    return False


def _connected(at: Path) -> socket.socket:
    line = socket.socket(socket.AF_UNIX)
    try:
        line.connect(str(at))
    except OSError as error:
        line.close()
        raise FaceError(f"{at}: {error.strerror or error}; {HINT}") from None
    line.settimeout(LISTEN_S)
    return line


def _take(line: socket.socket, at: Path, file: TapeFile, stop: Event, show: Show) -> Ended:
    """Put down what comes until no more does. Raises Unwritable."""
    decoder, began_s = Decoder(), time.monotonic()
    commit_s = began_s + COMMIT_S
    try:
        line.sendall(encode(told(Kind.WANT, 0.0, {"want": "record"})))
        while not stop.is_set():
            data = _heard(line)
            for entry in decoder.feed(data or b""):
                if entry.kind is Kind.END:
                    return Ended(How.END, _why(entry))
                file.put(entry)
            if data == b"":
                return _broken_off(at, file, "the instrument closed it")
            now_s = time.monotonic()
            if now_s >= commit_s:
                commit_s = now_s + COMMIT_S
                file.commit()
                show(file)
            if not file.begun and now_s > began_s + BEGIN_WAIT_S:
                return Ended(How.CUT_OFF, f"nothing came for {BEGIN_WAIT_S:g} s")
    except TapeError as error:
        return Ended(How.CUT_OFF, f"what came is no tape of this version: {error}")
    except Unwritable:
        raise
    except OSError as error:
        return _broken_off(at, file, f"the connection was lost: {error.strerror or error}")
    return Ended(How.STOPPED)


def _broken_off(at: Path, file: TapeFile, why: str) -> Ended:
    """The end that an instrument makes that is gone, or that is still there and did not wait any longer."""
    if file.begun:
        with suppress(FaceError):
            _connected(at).close()
            why = LET_GO
    return Ended(How.CUT_OFF, why)


def _heard(line: socket.socket) -> bytes | None:
    """What came; None for nothing as yet, nothing at all for the end."""
    try:
        return line.recv(AT_ONCE)
    except TimeoutError:
        return None


def _why(entry: Entry) -> str:
    facts = entry.facts
    return str(facts.get("why", "")) if isinstance(facts, dict) else ""


def _tell_trouble(line: socket.socket, why: str) -> None:
    """Let the instrument know, which asks for maintenance until a next recording begins."""
    with suppress(OSError):
        line.settimeout(1.0)
        line.sendall(encode(Entry(Kind.TROUBLE, time.monotonic(), why.encode())))


# ---- in words


@contextmanager
def _progress() -> Iterator[Show]:
    """A line on stderr, where that is a terminal."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _: None
        return
    with Live(console=console, auto_refresh=False, transient=True) as live:
        yield lambda file: live.update(Text(progress_line(file)), refresh=True)


def progress_line(file: TapeFile) -> str:
    """How far a recording is: time, samples, size, state of the rig."""
    state = _STATES.get(file.last.state, "") if file.last else "no samples yet"
    minutes, seconds = divmod(int(file.extent_s), 60)
    hours, minutes = divmod(minutes, 60)
    size_mb = file.bytes / 1e6
    return f"{hours:02}:{minutes:02}:{seconds:02}  {file.samples} samples  {size_mb:.1f} MB  {state}"


def _say_end(file: TapeFile, ended: Ended, as_json: bool) -> None:
    good = ended.how in (How.END, How.STOPPED)
    facts = {
        "file": str(file.path),
        "ended": ended.how.value,
        "why": ended.why,
        "seconds": round(file.extent_s, 3),
        "samples": file.kept,
        "events": file.events,
        "bytes": file.bytes,
    }
    words = f"{file.path}: {file.extent_s:.1f} s, {file.kept} samples, {file.bytes / 1e6:.1f} MB; {ended}"
    if as_json:
        print(json.dumps(facts))
    if not good:
        print(f"pneuforce: {words}", file=sys.stderr)
    elif not as_json:
        print(words)
