"""A CAN interface through python-can, the one file that knows it.

It never makes its caller wait, survives every exception, and comes back by itself. python-can is imported
when a bus is opened, not before.
"""

from __future__ import annotations

import errno
import logging
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from registers.can.outbox import Outbox
from registers.can.socketcand import GREETING
from registers.can.wire import CanFrame, Kind

if TYPE_CHECKING:
    import can

log = logging.getLogger(__name__)

LISTEN_S = 1.2  #: for another node with our id; a heartbeat comes each second
BACK_OFF_S = (0.1, 2.0)
_WAIT_S = 0.1
_GREETING_S = 1.0
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


@dataclass(slots=True)
class Counters:
    """What has gone over the bus since it was made; frames not sent are counted by the outbox."""

    sent: int = 0
    received: int = 0
    reopened: int = 0
    errors: int = 0  #: exceptions of whoever takes the frames


class CanBus:
    """One interface with a thread that sends and one that receives, which also reopens it."""

    def __init__(self, at: BusAt, on_frame: Callable[[CanFrame], None]) -> None:
        """Frames received are given to `on_frame`, in a thread of this bus."""
        self.at = at
        self.counters = Counters()
        self._on_frame = on_frame
        self._bus: can.BusABC | None = None
        self._broken: Exception | None = None  #: why the bus must be opened anew
        self._outbox = Outbox()
        self._closing = threading.Event()
        self._threads = [
            threading.Thread(target=self._transmit, name="can-transmit", daemon=True),
            threading.Thread(target=self._receive, name="can-receive", daemon=True),
        ]

    def open(self, heartbeat_id: int | None = None) -> None:
        """Open the interface and start; takes 1.2 s where `heartbeat_id` is given.

        Raises OSError, in a sentence: no such interface, or another node sends `heartbeat_id`.
        """
        bus = _opened(self.at)
        if heartbeat_id is not None and _heard(bus, heartbeat_id):
            bus.shutdown()
            raise OSError(
                f"CAN node id {heartbeat_id & 0x7F} is taken on {self.at}: another node sends "
                f"{heartbeat_id:03X}h; choose another id"
            )
        self._bus = bus
        for thread in self._threads:
            thread.start()

    @property
    def is_up(self) -> bool:
        """Whether frames can be sent and received now."""
        return self._bus is not None and self._broken is None

    @property
    def dropped(self) -> int:
        """Frames not sent: bus down, outbox or controller full, or too old."""
        return self._outbox.dropped

    def send(self, frame: CanFrame) -> None:
        """Have a frame sent; returns at once. To be called from one thread."""
        if self.is_up:
            self._outbox.put(frame)
        else:
            self._outbox.drop()

    def close(self) -> None:
        """Send what waits, and let the interface go; takes at most 0.3 s."""
        self._closing.set()
        self._outbox.close()
        for thread in self._threads:
            if thread.is_alive():
                thread.join(0.15)

    # ---- the thread that sends

    def _transmit(self) -> None:
        while (frame := self._outbox.take()) is not None:
            bus = self._bus
            if bus is None:
                self._outbox.drop()
            else:
                self._send_now(bus, frame)

    def _send_now(self, bus: can.BusABC, frame: CanFrame) -> None:
        try:
            bus.send(_message(frame))
        except Exception as error:
            self._outbox.drop()
            if not _is_full(error) and bus is self._bus:
                self._broken = error
        else:
            self.counters.sent += 1

    # ---- the thread that receives and reopens

    def _receive(self) -> None:
        back_off_s = BACK_OFF_S[0]
        while not self._closing.is_set():
            if self._bus is not None:
                back_off_s = BACK_OFF_S[0]
                self._receive_one(self._bus)
            elif not self._closing.wait(back_off_s):
                back_off_s = min(2 * back_off_s, BACK_OFF_S[1])
                self._reopen()
        self._let_go()

    def _receive_one(self, bus: can.BusABC) -> None:
        try:
            if self._broken is not None:
                raise self._broken
            frame = _next_frame(bus)
        except Exception as error:
            log.warning("CAN is down: %s: %s", self.at, error)
            self._let_go()
            return
        if frame is not None:
            self._hand_over(frame[1])

    def _hand_over(self, frame: CanFrame) -> None:
        self.counters.received += 1
        try:
            self._on_frame(frame)
        except Exception:
            self.counters.errors += 1
            log.exception("CAN frame %03Xh dropped after an error of ours", frame.id)

    def _reopen(self) -> None:
        try:
            self._bus = _opened(self.at)
        except Exception as error:
            log.debug("CAN is still down: %s", error)
            return
        self.counters.reopened += 1
        log.warning("CAN is up again: %s", self.at)

    def _let_go(self) -> None:
        bus, self._bus, self._broken = self._bus, None, None
        if bus is not None:
            with suppress(Exception):
                bus.shutdown()


def listen(at: BusAt, stop: threading.Event) -> Iterator[tuple[float, CanFrame]]:
    """Time [s since 1970] and frame of everything on the bus, until `stop` is set.

    Raises OSError, in a sentence: no such interface, or it went away.
    """
    bus = _opened(at)
    try:
        while not stop.is_set():
            frame = _next_frame(bus)
            if frame is not None:
                yield frame
    finally:
        bus.shutdown()


def _opened(at: BusAt) -> can.BusABC:
    """A bus of python-can. Raises OSError in a sentence."""
    import can

    logging.getLogger("can").setLevel(logging.CRITICAL)  # it logs what it also raises, and each split frame
    options: dict[str, Any] = {}
    try:
        if at.interface == "socketcand":
            _await_greeting(at)
            options = {"host": at.host, "port": at.port, "tcp_tune": True}
        return can.Bus(interface=at.interface, channel=at.channel, ignore_config=True, **options)
    except (can.CanError, OSError, ValueError) as error:
        raise OSError(f"CAN on {at} cannot be opened: {error}") from None


def _await_greeting(at: BusAt) -> None:
    """See that a socketcand server is there: python-can hammers a closed port for 10 s, and waits for ever.

    Raises OSError.
    """
    with socket.create_connection((at.host, at.port), _GREETING_S) as probe:
        heard = probe.recv(len(GREETING), socket.MSG_WAITALL)
        if heard != GREETING:
            raise OSError(f"no socketcand server there (it said {heard!r})")


def _next_frame(bus: can.BusABC) -> tuple[float, CanFrame] | None:
    """Time and frame of the next message, None after 0.1 s of silence. Raises OSError: the bus is gone."""
    import can

    try:
        message = bus.recv(_WAIT_S)
    except can.CanError as error:
        raise OSError(str(error)) from None
    if message is None:
        if _hung_up(bus):
            raise ConnectionResetError("the server closed the connection")
        return None
    if message.is_error_frame and message.arbitration_id & _BUS_OFF:
        raise OSError("the controller is bus-off")
    return message.timestamp, _frame(message)


def _hung_up(bus: can.BusABC) -> bool:
    """Whether the server of a socketcand bus has gone: python-can takes that for silence, and spins."""
    link: socket.socket | None = getattr(bus, "_SocketCanDaemonBus__socket", None)
    if link is None:
        return False
    try:
        return link.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT) == b""
    except BlockingIOError:
        return False


def _heard(bus: can.BusABC, heartbeat_id: int) -> bool:
    """Whether a heartbeat comes within 1.2 s. Raises OSError: the bus is gone."""
    until_s = time.monotonic() + LISTEN_S
    while time.monotonic() < until_s:
        heard = _next_frame(bus)
        if heard is not None and heard[1].id == heartbeat_id and not heard[1].kind:
            return True
    return False


def _message(frame: CanFrame) -> can.Message:
    import can

    return can.Message(
        arbitration_id=frame.id,
        data=frame.data,
        is_extended_id=Kind.EXTENDED in frame.kind,
        is_remote_frame=Kind.REMOTE in frame.kind,
    )


def _frame(message: can.Message) -> CanFrame:
    kind = Kind.DATA
    if message.is_extended_id:
        kind |= Kind.EXTENDED
    if message.is_remote_frame:
        kind |= Kind.REMOTE
    if message.is_error_frame:
        kind |= Kind.ERROR
    return CanFrame(message.arbitration_id, bytes(message.data), kind)


def _is_full(error: Exception) -> bool:
    """Whether a frame was refused because the controller's buffer is full: the bus itself is well."""
    return getattr(error, "error_code", None) == errno.ENOBUFS or "buffer full" in str(error)
