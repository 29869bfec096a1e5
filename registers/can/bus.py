"""A CAN interface through python-can, imported when a bus is opened.

Whatever python-can raises becomes OSError with a sentence.
"""

from __future__ import annotations

import errno
import logging
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING

from registers.can.carrier import trouble_of
from registers.can.wire import CanFrame, Kind

if TYPE_CHECKING:
    import can

WAIT_S = 0.1
_SEND_WAIT_S = 0.1  #: for room in the controller's buffer; what waits behind is dropped by the outbox
_SEND_BYTES = 4096  #: five frames: what the kernel keeps while nobody acknowledges arrives late
_BUS_OFF = 0x40  #: in an error frame of SocketCAN (linux/can/error.h, CAN_ERR_BUSOFF)


@dataclass(frozen=True, slots=True, kw_only=True)
class BusAt:
    """Where a bus is to be found: `socketcan`, `socketcand` (which alone has host and port) or `virtual`."""

    interface: str = "socketcan"
    channel: str = "can0"
    host: str = "127.0.0.1"
    port: int = 29536

    def __str__(self) -> str:
        where = f" at {self.host}:{self.port}" if self.interface == "socketcand" else ""
        return f"{self.interface} {self.channel}{where}"


def load(interface: str) -> None:
    """Import python-can now: while that goes on, an instrument sends its board nothing."""
    import_module(f"can.interfaces.{interface}")
    import_module("encodings.idna")  # which sockets import at the first name of a host


class BusFull(OSError):
    """The controller's buffer is full: this frame was not sent, the bus itself is well."""


class Bus:
    """One open interface."""

    def __init__(self, at: BusAt) -> None:
        """Open it. Raises OSError: no such interface, or one that takes no part in its bus."""
        import can

        self.failure: Exception | None = None  #: why it must be opened anew, found by who sends
        self._can = can
        logging.getLogger("can").setLevel(logging.CRITICAL)  # it logs what it raises, and each split frame
        try:
            self._bus, self._trouble = _opened(at)
        except (can.CanError, OSError, ValueError, NotImplementedError) as error:
            reason = getattr(error, "strerror", None) or _sentence(error)
            raise OSError(f"CAN on {at} cannot be opened: {reason}") from None

    def send(self, frame: CanFrame) -> None:
        """Send one frame; waits for up to 0.1 s for room. Raises BusFull, or OSError: the bus is gone."""
        message = self._can.Message(
            arbitration_id=frame.id,
            data=frame.data,
            is_extended_id=Kind.EXTENDED in frame.kind,
            is_remote_frame=Kind.REMOTE in frame.kind,
        )
        try:
            self._bus.send(message, _SEND_WAIT_S)
        except self._can.CanError as error:
            full = error.error_code == errno.ENOBUFS or "buffer full" in str(error)
            raise (BusFull if full else OSError)(_sentence(error)) from None

    def receive(self) -> tuple[float, CanFrame] | None:
        """Time [s since 1970] and frame of the next message; None after 0.1 s of silence.

        Raises OSError: the bus is gone.
        """
        try:
            message = self._bus.recv(WAIT_S)
        except self._can.CanError as error:
            raise OSError(_sentence(error)) from None
        if message is None:
            if trouble := self._trouble():
                raise ConnectionError(trouble)
            return None
        if message.is_error_frame and message.arbitration_id & _BUS_OFF:
            raise OSError("the controller is bus-off")
        return message.timestamp, CanFrame(message.arbitration_id, bytes(message.data), _kind(message))

    def close(self) -> None:
        """Let the interface go."""
        with suppress(Exception):
            self._bus.shutdown()


def listen(at: BusAt, stop: threading.Event) -> Iterator[tuple[float, CanFrame]]:
    """Time [s since 1970] and frame of everything on the bus, until `stop` is set.

    Raises OSError: no such interface, or it went away.
    """
    bus = Bus(at)
    try:
        while not stop.is_set():
            heard = bus.receive()
            if heard is not None:
                yield heard
    finally:
        bus.close()


def _opened(at: BusAt) -> tuple[can.BusABC, Callable[[], str]]:
    """The interface, and what tells why it has ended without a word; empty while it lives."""
    if at.interface == "socketcand":
        from registers.can.daemon import DaemonBus

        return DaemonBus(at.channel, at.host, at.port), str
    import can

    trouble = partial(trouble_of, at.channel) if at.interface == "socketcan" else str
    if trouble():
        raise ConnectionError(trouble())
    bus = can.Bus(interface=at.interface, channel=at.channel, ignore_config=True)
    if at.interface == "socketcan":
        bus.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BYTES)  # type: ignore[attr-defined]
    return bus, trouble


def _sentence(error: Exception) -> str:
    """What python-can says, without the traceback that it appends."""
    return str(error).partition("Traceback (most recent call last)")[0].strip()


def _kind(message: can.Message) -> Kind:
    kind = Kind.DATA
    if message.is_extended_id:
        kind |= Kind.EXTENDED
    if message.is_remote_frame:
        kind |= Kind.REMOTE
    if message.is_error_frame:
        kind |= Kind.ERROR
    return kind
