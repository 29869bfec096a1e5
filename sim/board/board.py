"""The board's end of the rig link: bytes in, bytes out, once per sample."""

from __future__ import annotations

from instrument.rig.frames import (
    PROTOCOL_VERSION,
    SAMPLES_PER_S,
    BoardKind,
    BoardState,
    Command,
    Decoder,
    Event,
    Fault,
    Frame,
    Hello,
    Identify,
    Message,
    Mode,
    Sample,
    Vent,
    encode,
)
from instrument.rig.limits import HOST_SILENCE_S
from sim.board.pressure import Pressure
from sim.board.states import UNASKED, ResetCause

FIRMWARE = 0x0100
HELLO_EVERY_US = 200_000
SAMPLE_S = 1 / SAMPLES_PER_S


class Board:
    """A board that has just booted. It streams to a host of its own version only."""

    def __init__(self, serial: int = 1, reset_cause: ResetCause = ResetCause.POWER_ON) -> None:
        self.serial = serial
        self.reset_cause = reset_cause
        self.version = PROTOCOL_VERSION  #: of the frames that it sends, and of the hosts that it listens to
        self.samples = 0  #: sent since boot; a sample's sequence is its low 16 bits
        self._pressure = Pressure()
        self._decoder = Decoder.of_host()
        self._identified = False
        self._obeyed = 0
        self._others = 0  # frames sent that are no samples
        self._time_us = 0
        self._greeted_us: int | None = None
        if reset_cause in UNASKED:
            self._pressure.restarted()

    @property
    def valves(self) -> int:
        """`Valve` mask that the board drives now."""
        return self._pressure.now.valves

    @property
    def holds(self) -> bool:
        """Whether the balloon is locked at its setpoint."""
        return self._pressure.now.state is BoardState.HOLDING

    def step(self, board_time_us: int, adc_sum: int, supply_mv: int, received: bytes) -> bytes:
        """Bytes to send at `board_time_us` since boot, after bytes received and one sample taken."""
        self._time_us = board_time_us
        answers = (
            b"".join([self._handle(frame) for frame in self._decoder.feed(received)]) if received else b""
        )
        self._pressure.step(adc_sum, supply_mv, SAMPLE_S)
        return answers + self._greeting() + self._events() + self._sample(adc_sum)

    def _handle(self, frame: Frame) -> bytes:
        """Answer a greeting, obey the rest. Before its greeting a host may only vent."""
        message = frame.message
        if isinstance(message, Identify):
            if frame.version == self.version:
                self._identified = True
                self._pressure.greet()
            return self._hello()
        if isinstance(message, Vent):
            self._pressure.vent()
        elif isinstance(message, Command) and self._identified and message.mode in tuple(Mode):
            self._obeyed = frame.sequence & 0xFF
            self._pressure.obey(message)
        return b""

    def _greeting(self) -> bytes:
        """Hello until a host has greeted."""
        if self._identified:
            return b""
        waited = self._greeted_us is None or self._time_us - self._greeted_us >= HELLO_EVERY_US
        return self._hello() if waited else b""

    def _hello(self) -> bytes:
        self._greeted_us = self._time_us
        return self._other(
            Hello(
                board=BoardKind.SIMULATED,
                firmware=FIRMWARE,
                uptime_ms=self._time_us // 1000 & 0xFFFF_FFFF,
                serial=self.serial,
                host_silence_ms=round(HOST_SILENCE_S * 1e3),
                vent_after_ms=round(self._pressure.now.vent_after_s * 1e3),
            )
        )

    def _events(self) -> bytes:
        if not self._pressure.changes:
            return b""
        changes, self._pressure.changes = self._pressure.changes, []
        if not self._identified:
            return b""
        time_us = self._time_us & 0xFFFF_FFFF
        return b"".join(self._other(Event(time_us, c.state, c.was, c.fault)) for c in changes)

    def _other(self, message: Message) -> bytes:
        self._others += 1
        return encode(message, self._others, self.version)

    def _sample(self, adc_sum: int) -> bytes:
        if not self._identified:
            return b""
        self.samples += 1
        now = self._pressure.now
        return encode(
            Sample(
                board_time_us=self._time_us & 0xFFFF_FFFF,
                adc_sum=adc_sum,
                supply_mv=now.supply.mean_mv,
                valves=now.valves,
                state=now.state,
                fault=now.latched[0] if now.latched else Fault.NONE,
                faults=sum([1 << fault for fault in now.latched]),
                command=self._obeyed,
                setpoint_pa=round(now.setpoint_kpa * 1e3),
            ),
            self.samples,
            self.version,
        )
