"""A live CAN bus: it never makes its caller wait, survives every exception, and comes back by itself."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass

from registers.back_off import BackOff
from registers.can.bus import Bus, BusAt, BusFull
from registers.can.outbox import Outbox
from registers.can.patience import Patience
from registers.can.wire import CanFrame, Kind
from registers.sparing_log import SparingLog

log = logging.getLogger(__name__)

AGAIN_S, LONGEST_S = 0.1, 2.0  #: the waits before it is opened anew: the first, and the longest
WELL_S = 5.0
LISTEN_S = 1.2  #: for another node with our id; a heartbeat comes each second
SAY_PERIOD_S = 60.0


@dataclass(slots=True)
class Counters:
    """What has gone over the bus since it was made."""

    sent: int = 0
    received: int = 0
    reopened: int = 0
    errors: int = 0  #: exceptions of whoever takes the frames
    error_frames: int = 0  #: the controller's own reports


class CanBus:
    """One interface with a thread that sends and one that receives, which also reopens it."""

    def __init__(self, at: BusAt, on_frame: Callable[[CanFrame], None]) -> None:
        """Frames received are given to `on_frame`, in a thread of this bus."""
        self.at = at
        self.counters = Counters()
        self._on_frame = on_frame
        self._outbox = Outbox()
        self._bus: Bus | None = None
        self._patience = Patience()
        self._back_off = BackOff(AGAIN_S, LONGEST_S, WELL_S)
        self._say = SparingLog(log, SAY_PERIOD_S).say
        self._closing = threading.Event()
        self._threads = [
            threading.Thread(target=self._transmit, name="can-transmit", daemon=True),
            threading.Thread(target=self._receive, name="can-receive", daemon=True),
        ]

    def open(self, own_ids: Collection[int] = ()) -> None:
        """Open the interface and start; waits 1.2 s where `own_ids` are given.

        Raises OSError, in a sentence: no such interface, or another node sends one of `own_ids`.
        """
        bus = Bus(self.at)
        try:
            taken = self._heard(bus, own_ids) if own_ids else None
            if taken is not None:
                raise OSError(
                    f"CAN node id {taken & 0x7F} is taken on {self.at}: another node sends "
                    f"{taken:03X}h; choose another id"
                )
        except OSError:
            bus.close()
            raise
        self._use(bus)
        for thread in self._threads:
            thread.start()

    def _use(self, bus: Bus) -> None:
        self._back_off.opened(time.monotonic())
        self._patience.taken()
        self._bus = bus

    def _heard(self, bus: Bus, own_ids: Collection[int]) -> int | None:
        """The first of `own_ids` that comes within 1.2 s, or until `close`. Raises OSError: bus gone."""
        until_s = time.monotonic() + LISTEN_S
        while time.monotonic() < until_s and not self._closing.is_set():
            try:
                heard = bus.receive()
            except OSError as error:
                raise OSError(f"CAN on {self.at} went down: {error}") from None
            if heard is not None and heard[1].id in own_ids and not heard[1].kind:
                return heard[1].id
        return None

    @property
    def is_up(self) -> bool:
        """Whether frames can be sent and received now."""
        return self._is_open and not self._patience.ended

    @property
    def _is_open(self) -> bool:
        bus = self._bus
        return bus is not None and bus.failure is None

    @property
    def dropped(self) -> int:
        """Frames not sent: bus down, outbox or controller full, or too old."""
        return self._outbox.dropped

    def send(self, frame: CanFrame) -> None:
        """Have a frame sent; returns at once. To be called from one thread."""
        if self._is_open:
            self._outbox.put(frame)
        else:
            self._outbox.drop()

    def close(self) -> None:
        """Send what waits, and let the interface go; takes at most 0.3 s."""
        transmit, receive = self._threads
        self._outbox.close()
        if transmit.is_alive():
            transmit.join(0.15)
        self._closing.set()
        if receive.is_alive():
            receive.join(0.15)

    # ---- the thread that sends

    def _transmit(self) -> None:
        while (frame := self._outbox.take()) is not None:
            bus = self._bus
            if bus is None:
                self._outbox.drop()
            else:
                self._send_now(bus, frame)

    def _send_now(self, bus: Bus, frame: CanFrame) -> None:
        try:
            bus.send(frame)
        except BusFull:
            self._outbox.drop()
            now_s = time.monotonic()
            if self._patience.refused(now_s):
                self._say(now_s, "CAN is down: %s takes no frames; nobody there acknowledges them", self.at)
        except Exception as error:
            self._outbox.drop()
            bus.failure = error
        else:
            self.counters.sent += 1
            if self._patience.taken():
                self._say(time.monotonic(), "CAN is up again: %s takes frames", self.at)

    # ---- the thread that receives and reopens

    def _receive(self) -> None:
        while not self._closing.is_set():
            if self._bus is not None:
                self._receive_one(self._bus)
            elif not self._closing.wait(self._back_off.wait_s):
                self._reopen()
        self._let_go()

    def _receive_one(self, bus: Bus) -> None:
        try:
            if bus.failure is not None:
                raise bus.failure
            heard = bus.receive()
        except Exception as error:
            self._say(time.monotonic(), "CAN is down: %s: %s", self.at, str(error).partition("\n")[0])
            self._let_go()
            self._back_off.failed(time.monotonic())
            return
        if heard is not None:
            self._hand_over(heard[1])

    def _hand_over(self, frame: CanFrame) -> None:
        if Kind.ERROR in frame.kind:
            self.counters.error_frames += 1
            return
        self.counters.received += 1
        try:
            self._on_frame(frame)
        except Exception:
            self.counters.errors += 1
            self._say(
                time.monotonic(), "CAN frame %03Xh dropped after an error of ours", frame.id, trace=True
            )

    def _reopen(self) -> None:
        self._back_off.tried()
        try:
            bus = Bus(self.at)
        except Exception as error:
            log.debug("CAN is still down: %s", error)
            return
        self._use(bus)
        self.counters.reopened += 1
        self._say(time.monotonic(), "CAN is up again: %s", self.at)

    def _let_go(self) -> None:
        bus, self._bus = self._bus, None
        if bus is not None:
            bus.close()
