"""The host: one loop that keeps rig, instrument and buses together, and vents when it ends."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable
from functools import partial
from typing import Protocol

from instrument.aside import aside, unless
from instrument.core import Instrument
from instrument.coupling import Coupling
from instrument.errors import ProtocolMismatch, RigError, RigSilent, TimeOutMismatch
from instrument.faults import name_of
from instrument.guard import Guard
from instrument.rig.frames import BoardState, Valve
from instrument.rig.link import Link, Phase, RawSample
from instrument.rig.port import RigLink, SerialPort

log = logging.getLogger("pneuforce")

TICK_S = 0.01
GREETING_S = 5.0  #: an UNO that was reset by opening its port needs two of them
REOPEN_S = 3.0  #: then the port is opened anew
BACK_OFF_S = (0.1, 2.0)
SAY_AGAIN_S = (10.0, 3600.0)  #: least and most between two words of the same trouble
VENT_ANSWER_S = 0.3


class Face(Protocol):
    """A bus that pushes: it is told of every sample and of the time."""

    def on_sample(self, now_s: float) -> None:
        """A new measurement is there."""
        ...

    def tick(self, now_s: float) -> None:
        """Time has passed, with samples or without."""
        ...


class Host:
    """Reads the rig, feeds the instrument, tells the faces, keeps the board alive, reconnects."""

    def __init__(
        self,
        coupling: Coupling,
        url: str,
        open_port: Callable[[str], RigLink] = SerialPort,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.coupling = coupling
        self.url = url
        self.faces: list[Face] = []
        self.reconnects = 0
        self._open_port = open_port
        self._clock = clock
        self._port: RigLink | None = None
        self._back_off_s = BACK_OFF_S[0]
        self._try_again_s = 0.0
        self._reopening: asyncio.Task[None] | None = None
        self._failure: RigError | None = None
        self._clock_off = False
        self._guarded = Guard("dropped after an error of ours")
        self._down_because, self._hush_s, self._say_again_s = "", 0.0, 0.0
        self._bytes_before = 0  # heard until then, for whoever asks what came in a silence

    @property
    def instrument(self) -> Instrument:
        """What is fed."""
        return self.coupling.instrument

    @property
    def link(self) -> Link:
        """The link to the board."""
        return self.coupling.link

    async def connect(self, stop: asyncio.Event) -> None:
        """Open the port and greet the board; or come back without, when `stop` is set.

        Raises RigError: port busy or missing, no board of ours there, or one of another version. The port is
        given back then.
        """
        port = await unless(stop, aside(partial(self._open_port, self.url)))
        if port is None:
            return
        self._attach(port)
        try:
            await self._greet(stop)
        except BaseException:
            self._close()
            raise
        if not stop.is_set():
            log.info("rig on %s answered", self.url)

    async def _greet(self, stop: asyncio.Event) -> None:
        deadline_s = self._clock() + GREETING_S
        while self.link.phase is not Phase.READY and not stop.is_set():
            self._beat()
            if self._failure is not None:
                raise self._failure
            if self._clock() > deadline_s:
                raise RigSilent(self.url, GREETING_S, self.link.heard_bytes)
            await asyncio.sleep(TICK_S)

    async def run(self, stop: asyncio.Event) -> None:
        """Work until `stop` is set; whatever ends it, the balloon is vented."""
        try:
            while not stop.is_set():
                self._beat()
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(stop.wait(), TICK_S)
        finally:
            await self._vent_and_close()
        log.info("vented; ended")

    def _beat(self) -> None:
        now_s = self._clock()
        self.coupling.beat(now_s)
        self._keep_alive(now_s)
        for face in self.faces:
            self._guarded(face.tick, now_s)

    def _keep_alive(self, now_s: float) -> None:
        if self._port is None:
            self._reopen_later(now_s)
            return
        silent_s = now_s - self.coupling.heard_s
        if silent_s > REOPEN_S:
            self._detach(str(RigSilent(self.url, silent_s, self.link.heard_bytes - self._bytes_before)))
            return
        self._send(self.coupling.orders(now_s))

    def _send(self, data: bytes) -> None:
        if not data or self._port is None:
            return
        try:
            self._port.write(data)
        except OSError as error:
            self._detach(str(error))

    # ---- the port

    def _attach(self, port: RigLink) -> None:
        self._port = port
        self.coupling.attach(self._clock())
        self._bytes_before = self.link.heard_bytes
        asyncio.get_running_loop().add_reader(port.fileno(), self._readable)

    def _detach(self, why: str) -> None:
        log.warning("rig link down: %s", why)
        self.coupling.detach(self._clock())
        self._release()
        self._wait_longer()

    def _wait_longer(self) -> None:
        """Put off the next try, twice as long each time until samples come."""
        self._try_again_s = self._clock() + self._back_off_s
        self._back_off_s = min(2 * self._back_off_s, BACK_OFF_S[1])

    def _release(self) -> None:
        port, self._port = self._port, None
        if port is not None:
            asyncio.get_running_loop().remove_reader(port.fileno())
            with contextlib.suppress(OSError):
                port.close()

    def _reopen_later(self, now_s: float) -> None:
        if now_s >= self._try_again_s and (self._reopening is None or self._reopening.done()):
            self._reopening = asyncio.get_running_loop().create_task(self._reopen())

    async def _reopen(self) -> None:
        try:
            port = await aside(partial(self._open_port, self.url))
        except Exception as error:
            self._say_still_down(str(error))
            self._wait_longer()
            return
        self.reconnects += 1
        log.warning("rig port open again")
        self._attach(port)

    def _say_still_down(self, because: str) -> None:
        """Once for each reason, and then at intervals that double: a night without a rig is a short log."""
        now_s = self._clock()
        if because != self._down_because:
            self._down_because, self._hush_s = because, SAY_AGAIN_S[0]
        elif now_s < self._say_again_s:
            return
        else:
            self._hush_s = min(2 * self._hush_s, SAY_AGAIN_S[1])
        self._say_again_s = now_s + self._hush_s
        log.warning("rig link still down: %s", because)

    def _readable(self) -> None:
        assert self._port is not None
        now_s = self._clock()
        try:
            samples = self.coupling.receive(self._port.read(), now_s)
        except (ProtocolMismatch, TimeOutMismatch) as error:
            self._failure = error
            self._detach(str(error))
            return
        except OSError as error:
            self._detach(str(error))
            return
        self._guarded(self._log_events)
        self._guarded(self._log_clock)
        if samples:
            self._back_off_s, self._down_because = BACK_OFF_S[0], ""
            self._bytes_before = self.link.heard_bytes
        for sample in samples:
            self._guarded(self._use, sample, now_s)

    def _log_events(self) -> None:
        events, self.link.events = self.link.events, []
        for event in events:
            was, state = (BoardState(code).name.lower() for code in (event.was, event.state))
            why = f" ({name_of(event.fault)})" if event.fault else ""
            log.info("board: %s to %s%s", was, state, why)

    def _log_clock(self) -> None:
        if self.link.clock.off != self._clock_off:
            self._clock_off = self.link.clock.off
            found = f"{self.link.clock.rate_error:+.1%} off" if self._clock_off else "as it should be again"
            log.warning("the board's clock is %s; all its times are by it", found)

    def _use(self, sample: RawSample, now_s: float) -> None:
        self.coupling.take(sample, now_s)
        for face in self.faces:
            self._guarded(face.on_sample, now_s)

    # ---- the end

    async def _vent_and_close(self) -> None:
        """Vent, wait until the board says that its valves are SAFE, and give the port back."""
        now_s = self._clock()
        self.coupling.leave(now_s)
        self._send(self.coupling.orders(now_s))
        while self._port is not None and self._clock() < now_s + VENT_ANSWER_S:
            sample = self.instrument.sample
            if sample is not None and sample.valves == Valve.NONE and self._clock() > now_s + TICK_S:
                break
            await asyncio.sleep(TICK_S / 2)
        self._close()

    def _close(self) -> None:
        if self._reopening is not None:
            self._reopening.cancel()
        self._release()
