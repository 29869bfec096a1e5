"""Permanent connection to a CAN bus, which reopens the interface after a failure.

`CanConnection.send` never blocks its caller. No exception ends the threads of the connection.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass

from pneuforce.registers.can.bus import CanAddress, CanBus, TxBufferFullError
from pneuforce.registers.can.transmit_queue import DropCause, TransmitQueue
from pneuforce.registers.can.tx_stall_detector import TxStallDetector
from pneuforce.registers.can.wire import CanFrame, FrameKind
from pneuforce.support.backlog import Backlog
from pneuforce.support.backoff import Backoff
from pneuforce.support.throttle import RateLimitedLogger

log = logging.getLogger(__name__)

FIRST_WAIT_S, MAX_WAIT_S = 0.1, 2.0  #: waits before the interface is opened again
STABLE_S = 5.0  #: if the bus was open for longer than this, the next wait is FIRST_WAIT_S again
LISTEN_S = 1.2  #: time to detect another node with the same node id; a heartbeat comes each second
LOG_PERIOD_S = 60.0


class NodeIdInUseError(OSError):
    """Error for a node id that another node on the bus uses."""


@dataclass(slots=True)
class CanCounters:
    """Counters of a connection since its creation."""

    sent: int = 0
    received: int = 0
    reopened: int = 0
    errors: int = 0  #: exceptions of the `on_frame` callback
    error_frames: int = 0  #: error reports of the local controller


class CanConnection:
    """One CAN interface with two threads: one sends; the other receives and reopens the interface."""

    def __init__(self, address: CanAddress, on_frame: Callable[[CanFrame], None]) -> None:
        """Prepare the connection. `on_frame` is called with each received frame, in the receiving thread."""
        self.address = address
        self.counters = CanCounters()
        self._on_frame = on_frame
        self._queue = TransmitQueue()
        self._bus: CanBus | None = None
        self._stall_detector = TxStallDetector()
        self._backoff = Backoff(FIRST_WAIT_S, MAX_WAIT_S, STABLE_S)
        self._backlog = Backlog()
        self._warning = RateLimitedLogger(log, LOG_PERIOD_S).warning
        self._closing = threading.Event()
        self._threads = [
            threading.Thread(target=self._transmit, name="can-transmit", daemon=True),
            threading.Thread(target=self._receive, name="can-receive", daemon=True),
        ]

    def open(self, transmit_ids: Collection[int] = ()) -> None:
        """Open the interface and start the threads.

        If `transmit_ids` are given, first listen for 1.2 s for another node that sends one of them.

        Raises OSError if the interface cannot be opened, or NodeIdInUseError if another node sends one of
        `transmit_ids`.
        """
        bus = CanBus(self.address)
        try:
            used_id = self._find_used_id(bus, transmit_ids) if transmit_ids else None
            if used_id is not None:
                raise NodeIdInUseError(
                    f"CAN node id {used_id & 0x7F} is already in use on {self.address}: another node sends "
                    f"{used_id:03X}h. Choose another node id"
                )
        except OSError:
            bus.close()
            raise
        self._use(bus)
        for thread in self._threads:
            thread.start()

    def _use(self, bus: CanBus) -> None:
        self._backoff.opened(time.monotonic())
        self._stall_detector.frame_sent()
        self._bus = bus

    def _find_used_id(self, bus: CanBus, transmit_ids: Collection[int]) -> int | None:
        """Return the first of `transmit_ids` that another node sends within 1.2 s. `close` ends the wait.

        Raises OSError if the bus fails.
        """
        until_s = time.monotonic() + LISTEN_S
        while time.monotonic() < until_s and not self._closing.is_set():
            try:
                received = bus.receive()
            except OSError as error:
                raise OSError(f"CAN on {self.address} went down: {error}") from None
            if received is not None and received[1].id in transmit_ids and not received[1].kind:
                return received[1].id
        return None

    @property
    def may_be_old(self) -> bool:
        """Return True if the received frames possibly waited, because this process did not run."""
        return self._backlog.possible

    @property
    def is_up(self) -> bool:
        """Return True if frames can be sent and received now."""
        return self._is_open and not self._stall_detector.stalled

    @property
    def _is_open(self) -> bool:
        bus = self._bus
        return bus is not None and bus.failure is None

    @property
    def dropped(self) -> int:
        """Return the number of unsent frames: bus down, queue or controller full, or frame too old."""
        return self._queue.dropped

    @property
    def drops(self) -> dict[DropCause, int]:
        """Return the number of unsent frames by cause."""
        return dict(self._queue.drops)

    def send(self, frame: CanFrame, made_s: float | None = None) -> None:
        """Put a frame into the transmit queue and return at once. Only one thread may call this method.

        `made_s` is the time of the values in the frame (`time.monotonic`); None means now. A frame whose
        values are older than 0.1 s is not sent.
        """
        if self._is_open:
            self._queue.put(frame, made_s)
        else:
            self._queue.count_dropped(DropCause.BUS_DOWN)

    def close(self) -> None:
        """Send the frames in the queue and close the interface, within 0.3 s."""
        transmit, receive = self._threads
        self._queue.close()
        if transmit.is_alive():
            transmit.join(0.15)
        self._closing.set()
        if receive.is_alive():
            receive.join(0.15)

    # ---- sending thread

    def _transmit(self) -> None:
        while (frame := self._queue.get()) is not None:
            bus = self._bus
            if bus is None:
                self._queue.count_dropped(DropCause.BUS_DOWN)
            else:
                self._send_now(bus, frame)

    def _send_now(self, bus: CanBus, frame: CanFrame) -> None:
        try:
            bus.send(frame)
        except TxBufferFullError:
            self._queue.count_dropped(DropCause.NOT_ACCEPTED)
            now_s = time.monotonic()
            if self._stall_detector.frame_rejected(now_s):
                self._warning(
                    now_s,
                    "CAN is down: %s accepts no frames, because no node acknowledges them. "
                    "Check the cable, the termination and the other nodes",
                    self.address,
                )
        except Exception as error:
            self._queue.count_dropped(DropCause.BUS_DOWN)
            bus.failure = error
        else:
            self.counters.sent += 1
            if self._stall_detector.frame_sent():
                self._warning(time.monotonic(), "CAN is up again: %s accepts frames", self.address)

    # ---- receiving thread

    def _receive(self) -> None:
        while not self._closing.is_set():
            if self._bus is not None:
                self._receive_one(self._bus)
            elif not self._closing.wait(self._backoff.wait_s):
                self._reopen()
        self._close_bus()

    def _receive_one(self, bus: CanBus) -> None:
        try:
            if bus.failure is not None:
                raise bus.failure
            received = bus.receive(self._backlog.timeout_s)
        except Exception as error:
            self._warning(
                time.monotonic(),
                "CAN is down: %s: %s; check the interface and the cable; it is opened again automatically",
                self.address,
                str(error).partition("\n")[0],
            )
            self._close_bus()
            self._backoff.failed(time.monotonic())
            return
        pause_s = self._backlog.add(time.monotonic(), arrived=received is not None)
        if received is not None:
            self._deliver(received[1])
        elif pause_s:
            self._closing.wait(pause_s)

    def _deliver(self, frame: CanFrame) -> None:
        if FrameKind.ERROR in frame.kind:
            self.counters.error_frames += 1
            return
        self.counters.received += 1
        try:
            self._on_frame(frame)
        except Exception:
            self.counters.errors += 1
            self._warning(
                time.monotonic(),
                "CAN frame %03Xh dropped because of an internal error",
                frame.id,
                exc_info=True,
            )

    def _reopen(self) -> None:
        self._backoff.attempted()
        try:
            bus = CanBus(self.address)
        except Exception as error:
            log.debug("CAN is still down: %s", error)
            return
        self._use(bus)
        self.counters.reopened += 1
        self._warning(time.monotonic(), "CAN is up again: %s", self.address)

    def _close_bus(self) -> None:
        bus, self._bus = self._bus, None
        if bus is not None:
            bus.close()
