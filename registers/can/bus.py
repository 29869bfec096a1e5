"""A CAN interface through python-can: the one file that knows it, and imports it when a bus is opened.

Whatever python-can raises becomes OSError with a sentence.
"""

from __future__ import annotations

import errno
import logging
import socket
import struct
import threading
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

from registers.can.socketcand import GREETING
from registers.can.wire import CanFrame, Kind

if TYPE_CHECKING:
    import can

WAIT_S = 0.1
_GREETING_S = 1.0
_SEND_BYTES = 2048  #: what the kernel may keep for a socketcand server that does not read
_SEND_WAIT = struct.pack("ll", 0, 100_000)  #: [s, us]; python-can lets a send wait for ever
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
        """Open it. Raises OSError."""
        import can

        self._can = can
        logging.getLogger("can").setLevel(logging.CRITICAL)  # it logs what it raises, and each split frame
        try:
            self._bus = _opened(at)
            self._link = _link(self._bus)
        except (can.CanError, OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or _sentence(error)
            raise OSError(f"CAN on {at} cannot be opened: {reason}") from None

    def send(self, frame: CanFrame) -> None:
        """Send one frame. Raises BusFull, or OSError: the bus is gone."""
        message = self._can.Message(
            arbitration_id=frame.id,
            data=frame.data,
            is_extended_id=Kind.EXTENDED in frame.kind,
            is_remote_frame=Kind.REMOTE in frame.kind,
        )
        try:
            self._bus.send(message)
        except BlockingIOError:
            self._forget_unsent()
            raise OSError("the server does not read") from None
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
            if self._hung_up():
                raise ConnectionResetError("the server closed the connection")
            return None
        if message.is_error_frame and message.arbitration_id & _BUS_OFF:
            raise OSError("the controller is bus-off")
        return message.timestamp, CanFrame(message.arbitration_id, bytes(message.data), _kind(message))

    def _hung_up(self) -> bool:
        """Whether the server of a socketcand bus has gone: python-can takes that for silence, and spins."""
        if self._link is None:
            return False
        try:
            return self._link.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT) == b""
        except BlockingIOError:
            return False

    def _forget_unsent(self) -> None:
        """Have the kernel throw away, on closing, what it could not send: it would arrive late."""
        if self._link is not None:
            self._link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))

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


def _opened(at: BusAt) -> can.BusABC:
    import can

    options: dict[str, Any] = {}
    if at.interface == "socketcand":
        _await_greeting(at)
        options = {"host": at.host, "port": at.port, "tcp_tune": True}
    return can.Bus(interface=at.interface, channel=at.channel, ignore_config=True, **options)


def _link(bus: can.BusABC) -> socket.socket | None:
    """The connection of a socketcand bus, set to fail rather than to keep frames for a server that stands."""
    link: socket.socket | None = getattr(bus, "_SocketCanDaemonBus__socket", None)
    if link is not None:
        link.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BYTES)
        link.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, _SEND_WAIT)
    return link


def _await_greeting(at: BusAt) -> None:
    """See that a socketcand server is there: python-can hammers a closed port for 10 s, and waits for ever.

    Raises OSError.
    """
    with socket.create_connection((at.host, at.port), _GREETING_S) as probe:
        heard = probe.recv(len(GREETING))
        if heard != GREETING:
            raise OSError(f"no socketcand server answers there (heard {heard!r})")


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
