"""CAN interface through python-can.

python-can is imported when a bus is opened. All exceptions of python-can are raised again as OSError with a
message of one line.
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

from pneuforce.registers.can.carrier import link_problem
from pneuforce.registers.can.wire import CanFrame, FrameKind
from pneuforce.support.backlog import RECEIVE_TIMEOUT_S

if TYPE_CHECKING:
    import can

_SEND_TIMEOUT_S = 0.1  #: maximum wait for free space in the transmit buffer of the controller
#: Size of the kernel's send buffer: five frames. The buffer is small because frames in the buffer
#: become outdated while no node acknowledges them.
_SEND_BUFFER_BYTES = 4096
_BUS_OFF = 0x40  #: flag in an error frame of SocketCAN (linux/can/error.h, CAN_ERR_BUSOFF)


@dataclass(frozen=True, slots=True, kw_only=True)
class CanAddress:
    """Address of a CAN bus: the python-can interface and its channel.

    `interface` is `socketcan`, `socketcand` or `virtual`. Only `socketcand` uses `host` and `port`.
    """

    interface: str = "socketcan"
    channel: str = "can0"
    host: str = "127.0.0.1"
    port: int = 29536

    def __str__(self) -> str:
        location = f" at {self.host}:{self.port}" if self.interface == "socketcand" else ""
        return f"{self.interface} {self.channel}{location}"


def import_interface(interface: str) -> None:
    """Import the modules of an interface before the first sample.

    The import is slow. During an import in the event loop, the board would receive no commands.
    """
    own = "pneuforce.registers.can.socketcand_bus"
    import_module(own if interface == "socketcand" else f"can.interfaces.{interface}")
    import_module("encodings.idna")  # the socket module imports it when the first host name is resolved


def interface_exists(name: str) -> bool:
    """Return True if python-can has an interface of this name."""
    from can import VALID_INTERFACES

    return name in VALID_INTERFACES


class TxBufferFullError(OSError):
    """Error for a frame that was not sent because the controller's buffer is full. The bus stays usable."""


class CanBus:
    """One open CAN interface."""

    def __init__(self, address: CanAddress) -> None:
        """Open the interface.

        Raises OSError if the interface does not exist, is down, or is bus-off.
        """
        import can

        #: Error in the sending thread. The interface must be opened again after such an error.
        self.failure: Exception | None = None
        self._can = can
        # By default, python-can logs each exception that it raises and each frame that arrives in two pieces.
        logging.getLogger("can").setLevel(logging.CRITICAL)
        try:
            self._bus, self._link_problem = _open(address)
        except (can.CanError, OSError, ValueError, NotImplementedError) as error:
            reason = getattr(error, "strerror", None) or _without_traceback(error)
            raise OSError(f"CAN on {address} cannot be opened: {reason}") from None

    def send(self, frame: CanFrame) -> None:
        """Send one frame; wait for up to 0.1 s for free space in the transmit buffer.

        Raises TxBufferFullError if the buffer stays full, and OSError if the bus has failed.
        """
        message = self._can.Message(
            arbitration_id=frame.id,
            data=frame.data,
            is_extended_id=FrameKind.EXTENDED in frame.kind,
            is_remote_frame=FrameKind.REMOTE in frame.kind,
        )
        try:
            self._bus.send(message, _SEND_TIMEOUT_S)
        except self._can.CanError as error:
            full = error.error_code == errno.ENOBUFS or "buffer full" in str(error)
            raise (TxBufferFullError if full else OSError)(_without_traceback(error)) from None

    def receive(self, timeout_s: float = RECEIVE_TIMEOUT_S) -> tuple[float, CanFrame] | None:
        """Return the time [s since 1970] and the next frame, or None if no frame arrives in time.

        Raises OSError if the bus has failed or the controller is bus-off.
        """
        try:
            message = self._bus.recv(timeout_s)
        except self._can.CanError as error:
            raise OSError(_without_traceback(error)) from None
        if message is None:
            if problem := self._link_problem():
                raise ConnectionError(problem)
            return None
        if message.is_error_frame and message.arbitration_id & _BUS_OFF:
            raise OSError("the controller is bus-off")
        return message.timestamp, CanFrame(message.arbitration_id, bytes(message.data), _kind(message))

    def close(self) -> None:
        """Close the interface."""
        with suppress(Exception):
            self._bus.shutdown()


def listen(address: CanAddress, stop: threading.Event) -> Iterator[tuple[float, CanFrame]]:
    """Yield the time [s since 1970] and the content of each frame on the bus until `stop` is set.

    Raises OSError if the interface cannot be opened or fails.
    """
    bus = CanBus(address)
    try:
        while not stop.is_set():
            received = bus.receive()
            if received is not None:
                yield received
    finally:
        bus.close()


def _open(address: CanAddress) -> tuple[can.BusABC, Callable[[], str]]:
    """Return the open python-can bus, and a function that returns the link problem ("" if there is none)."""
    if address.interface == "socketcand":
        from pneuforce.registers.can.socketcand_bus import SocketcandBus

        return SocketcandBus(address.channel, address.host, address.port), str
    import can

    problem = partial(link_problem, address.channel) if address.interface == "socketcan" else str
    if problem():
        raise ConnectionError(problem())
    bus = can.Bus(interface=address.interface, channel=address.channel, ignore_config=True)
    if address.interface == "socketcan":
        bus.socket.setsockopt(  # type: ignore[attr-defined]
            socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER_BYTES
        )
    return bus, problem


def _without_traceback(error: Exception) -> str:
    """Return the message of a python-can error without the traceback that python-can appends."""
    return str(error).partition("Traceback (most recent call last)")[0].strip()


def _kind(message: can.Message) -> FrameKind:
    kind = FrameKind.DATA
    if message.is_extended_id:
        kind |= FrameKind.EXTENDED
    if message.is_remote_frame:
        kind |= FrameKind.REMOTE
    if message.is_error_frame:
        kind |= FrameKind.ERROR
    return kind
