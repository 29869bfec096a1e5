"""`pneuforce cansend`: send frames on a CAN bus."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager, suppress

from pneuforce.errors import ConfigurationError, ServerError
from pneuforce.instrument.cli.terminal.output import CONNECTION_HINT
from pneuforce.registers.can.bus import CanAddress, CanBus
from pneuforce.registers.can.frame_text import parse_frame
from pneuforce.registers.can.wire import CanFrame

STDIN = "-"


def send(address: CanAddress, texts: list[str]) -> None:
    """Send all frames in their order. The text `-` stands for all lines of stdin.

    Raises ConfigurationError before the first frame is sent if an argument is not a frame, and at an invalid
    line of stdin. Raises ServerError if the bus is not available.
    """
    frames = [_parse(text) for text in texts if text != STDIN]
    try:
        with closing(CanBus(address)) as bus:
            _send(bus, frames)
            if STDIN in texts:
                with _reading(bus):
                    _send(bus, (_parse(line) for line in sys.stdin if line.strip()))
    except OSError as error:
        raise ServerError(f"{error}; {CONNECTION_HINT}") from None


@contextmanager
def _reading(bus: CanBus) -> Iterator[None]:
    """Read and discard all frames until the block ends: a hub disconnects a client that does not read."""
    stop = threading.Event()

    def read() -> None:
        with suppress(OSError):  # sending reports a lost connection
            while not stop.is_set():
                bus.receive()

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    try:
        yield
    finally:
        stop.set()
        reader.join()


def _parse(text: str) -> CanFrame:
    try:
        return parse_frame(text)
    except ValueError as error:
        raise ConfigurationError(str(error)) from None


def _send(bus: CanBus, frames: Iterable[CanFrame]) -> None:
    for frame in frames:
        bus.send(frame)
