"""Host: the event loop that connects rig, instrument and output channels, and vents when it ends."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable
from functools import partial

from pneuforce.errors import ProtocolMismatch, RigError, RigNotResponding, TimeoutMismatch
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.faults import described
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.core.state import STATE_LOGGER
from pneuforce.instrument.rig.firmware import REMEDY, Firmware, FirmwareOrigin
from pneuforce.instrument.rig.link import Link, LinkPhase, RawSample
from pneuforce.instrument.service.host.command_gaps import CommandGaps
from pneuforce.instrument.service.host.last_vent import LastVent
from pneuforce.instrument.service.host.loop import OutputChannel
from pneuforce.instrument.service.host.repeated_warning import RepeatedWarning
from pneuforce.protocol.frames import BoardState
from pneuforce.support.background import cancel_on, run_in_background
from pneuforce.support.backoff import Backoff
from pneuforce.support.call_guard import CallGuard
from pneuforce.support.serial_port import BytePort, SerialPort

log = logging.getLogger(STATE_LOGGER)

TICK_S = 0.01
HANDSHAKE_S = 5.0  #: longest handshake; an UNO restarts for two seconds after its port was opened
REOPEN_S = 3.0  #: time without samples after which the port is opened again
FIRST_RETRY_S, MAX_RETRY_S = 0.1, 2.0


class Host:
    """Loop that reads the rig, feeds the instrument, calls the output channels and reconnects."""

    def __init__(
        self,
        session: Session,
        url: str,
        open_port: Callable[[str], BytePort] = SerialPort,
        clock: Callable[[], float] = time.monotonic,
        utc: Callable[[], float] = time.time,
    ) -> None:
        self.session = session
        self.url = url
        self.channels: list[OutputChannel] = []
        self.reconnects = 0
        self.command_gaps = CommandGaps()
        self._open_port = open_port
        self._clock = clock
        self._utc = utc
        self._port: BytePort | None = None
        self._backoff = Backoff(FIRST_RETRY_S, MAX_RETRY_S, stable_s=0.0)
        self._retry_s = 0.0
        self._reopening: asyncio.Task[None] | None = None
        self._failure: RigError | None = None
        self._clock_off = False
        self._firmware: Firmware | None = None  # firmware in the last line of the log about it
        self._guarded = CallGuard("call of the host loop dropped after an internal error")
        self._still_down = RepeatedWarning(log, "rig link still down")
        self._bytes_before = 0  # number of bytes received up to the last sample
        self._end_at_once = False
        self.vent_verified = False  #: the vent at the end was verified

    @property
    def instrument(self) -> Instrument:
        """Return the instrument of the session."""
        return self.session.instrument

    @property
    def link(self) -> Link:
        """Return the link to the board."""
        return self.session.link

    async def connect(self, stop: asyncio.Event) -> None:
        """Open the port and complete the handshake with the board, or return early when `stop` is set.

        Raises RigError if the port is missing or in use, or if no compatible board answers. The port is then
        closed again.
        """
        port = await cancel_on(stop, run_in_background(partial(self._open_port, self.url)))
        if port is None:
            return
        self._attach(port)
        try:
            await self._shake_hands(stop)
        except BaseException:
            self._close()
            raise
        if not stop.is_set():
            log.info("rig on %s answered", self.url)

    async def _shake_hands(self, stop: asyncio.Event) -> None:
        deadline_s = self._clock() + HANDSHAKE_S
        while self.link.phase is not LinkPhase.READY and not stop.is_set():
            self._tick()
            if self._failure is not None:
                raise self._failure
            if self._clock() > deadline_s:
                raise RigNotResponding(self.url, HANDSHAKE_S, self.link.received_bytes)
            await asyncio.sleep(TICK_S)

    async def run(self, stop: asyncio.Event) -> None:
        """Run until `stop` is set. The balloon is vented at the end, also after an exception."""
        try:
            while not stop.is_set():
                self._tick()
                await asyncio.sleep(TICK_S)
        finally:
            await self._vent_and_close()

    def end_at_once(self) -> None:
        """End without a wait for the verification of the vent."""
        self._end_at_once = True

    def _tick(self) -> None:
        now_s = self._clock()
        self.instrument.utc_offset_s = self._utc() - now_s
        self.session.tick(now_s)
        self._send_commands(now_s)
        for channel in self.channels:
            self._guarded(channel.tick, now_s)

    def _send_commands(self, now_s: float) -> None:
        if self._port is None:
            self._reopen_when_due(now_s)
            return
        silent_s = self.instrument.stalls.active_s(self.session.heard_s, now_s)
        if silent_s > REOPEN_S:
            received_bytes = self.link.received_bytes - self._bytes_before
            self._detach(str(RigNotResponding(self.url, silent_s, received_bytes)))
            return
        self._send(self.session.outgoing(now_s))

    def _send(self, data: bytes) -> None:
        if not data or self._port is None:
            return
        try:
            self._port.write(data)
        except OSError as error:
            self._detach(str(error))
            return
        if self.link.phase is LinkPhase.READY:
            self.command_gaps.sent(self._clock())
        else:
            self.command_gaps.restart()

    # ---- the port

    def _attach(self, port: BytePort) -> None:
        self._port = port
        self.session.attach(self._clock())
        self._bytes_before = self.link.received_bytes
        asyncio.get_running_loop().add_reader(port.fileno(), self._on_readable)

    def _detach(self, why: str) -> None:
        log.warning("rig link down: %s", why)
        self.session.detach(self._clock())
        self._close_port()
        self._wait_longer()

    def _wait_longer(self) -> None:
        """Delay the next attempt to open the port. The delay doubles until samples arrive."""
        self._retry_s = self._clock() + self._backoff.wait_s
        self._backoff.attempted()

    def _close_port(self) -> None:
        port, self._port = self._port, None
        self.command_gaps.restart()
        if port is not None:
            asyncio.get_running_loop().remove_reader(port.fileno())
            with contextlib.suppress(OSError):
                port.close()

    def _reopen_when_due(self, now_s: float) -> None:
        if now_s >= self._retry_s and (self._reopening is None or self._reopening.done()):
            self._reopening = asyncio.get_running_loop().create_task(self._reopen())

    async def _reopen(self) -> None:
        try:
            port = await run_in_background(partial(self._open_port, self.url))
        except Exception as error:
            self._still_down.warn(str(error), self._clock())
            self._wait_longer()
            return
        self.reconnects += 1
        log.warning("rig port open again")
        self._attach(port)

    def _on_readable(self) -> None:
        assert self._port is not None
        now_s = self._clock()
        try:
            samples = self.session.receive(self._port.read(), now_s)
        except (ProtocolMismatch, TimeoutMismatch) as error:
            self._failure = error
            self._detach(str(error))
            return
        except OSError as error:
            self._detach(str(error))
            return
        self._guarded(self._log_board_events)
        self._guarded(self._log_board_clock)
        self._guarded(self._log_firmware)
        if samples:
            self._backoff.reset()
            self._still_down.reset()
            self._bytes_before = self.link.received_bytes
        for sample in samples:
            self._guarded(self._process, sample, now_s)

    def _log_board_events(self) -> None:
        events, self.link.events = self.link.events, []
        for event in events:
            before, after = (_state_name(code) for code in (event.previous_state, event.state))
            why = f": {described(event.fault)}" if event.fault else ""
            log.info("board: %s to %s%s", before, after, why)

    def _log_board_clock(self) -> None:
        clock = self.link.clock
        if clock.out_of_tolerance != self._clock_off:
            self._clock_off = clock.out_of_tolerance
            if self._clock_off:
                error_percent = clock.rate_error * 100
                log.warning("the clock of the board has an error of %+.1f %%", error_percent)

    def _log_firmware(self) -> None:
        firmware = self.instrument.firmware
        if firmware is not None and firmware != self._firmware:
            self._firmware = firmware
            if firmware.origin is FirmwareOrigin.CURRENT:
                log.info("%s", firmware)
            else:
                log.warning("%s; %s", firmware, REMEDY)

    def _process(self, sample: RawSample, now_s: float) -> None:
        self.session.process(sample, now_s)
        for channel in self.channels:
            self._guarded(channel.on_sample, now_s)

    # ---- the end

    async def _vent_and_close(self) -> None:
        """Vent, wait until the vent is verified, log the result, and close the port.

        The loop continues during the wait, so that the buses and the event log show the vent.
        """
        begin_s = self._clock()
        vent = LastVent(self.instrument, begin_s)
        self._vent(begin_s)
        try:
            while vent.pending(self._clock(), self._port is not None) and not self._end_at_once:
                await asyncio.sleep(TICK_S)
                if self.instrument.holding:
                    self._vent(self._clock())  # a client has requested a hold
                self._tick()
        finally:
            self.vent_verified = vent.verified
            result = vent.result(self._clock(), self._port is not None)
            log.log(
                logging.INFO if vent.verified else logging.WARNING, "ended: %s; look at the balloon", result
            )
            self._close()

    def _vent(self, now_s: float) -> None:
        self.session.leave(now_s)
        self._send(self.session.outgoing(now_s))

    def _close(self) -> None:
        if self._reopening is not None:
            self._reopening.cancel()
        self._close_port()


def _state_name(code: int) -> str:
    """Return the name of a board state, as in the documents."""
    return "proof test" if code == BoardState.TESTING else BoardState(code).name.lower()
