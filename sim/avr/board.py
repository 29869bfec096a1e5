"""The emulated board: the firmware's own binary behind the seam of the board in Python."""

from __future__ import annotations

from functools import cache

from instrument.rig.frames import (
    PROTOCOL_VERSION,
    SAMPLES_PER_S,
    BoardKind,
    BoardState,
    Decoder,
    Sample,
    Valve,
)
from sim.avr.emulator import CYCLES_PER_US, Emulator, Reset
from sim.avr.toolchain import program
from sim.board.states import ResetCause
from sim.faults import Refused

#: What hangs at which pin: firmware/pneuforce/hardware.h.
INLET_BIT, VENT_BIT, OK_BIT = 4, 7, 0
CONVERSION_CYCLES = 13 * 128
#: A step begins this long before its sum is complete, so that a frame that it receives, of 0.5 ms, is known.
AHEAD_CYCLES = 600 * CYCLES_PER_US
#: Two bytes' time: when nothing was sent for so long, nothing is under way.
QUIET_CYCLES = 40 * CYCLES_PER_US
STEP_US = 1_000_000 // SAMPLES_PER_S
LONGEST_BOOT_CYCLES = 100_000 * CYCLES_PER_US


class AvrBoard:
    """A board that has just booted.

    A sample shows what was given one step before, because its 16 conversions take that long.
    """

    supply_step_mv = 3  #: a sixteenth of a count of the bandgap's conversion, near 5 V, and what is cut off

    def __init__(self, serial: int = 1, reset_cause: ResetCause = ResetCause.POWER_ON) -> None:
        """Raises ToolMissing."""
        self.samples = 0  #: sent since boot
        self._state = BoardState.BOOT
        self._decoder = Decoder.of_board()
        self.chip = Emulator(program(), bytes([BoardKind.EMULATED]) + serial.to_bytes(4, "little"))
        self.chip.reset(Reset[reset_cause.name])
        self._begun: int | None = None  # cycle at which the board's time began

    @property
    def valves(self) -> int:
        """`Valve` mask that the board drives now."""
        high = self.chip.high("D")
        inlet, vent = (high >> bit & 1 for bit in (INLET_BIT, VENT_BIT))
        return inlet * Valve.INLET_OPEN.value | vent * Valve.VENT_CLOSED.value

    @property
    def ok(self) -> bool:
        """What the contact for others says."""
        return bool(self.chip.high("B") >> OK_BIT & 1)

    @property
    def holds(self) -> bool:
        """Whether the balloon is locked at its setpoint, as the board says."""
        return self._state is BoardState.HOLDING

    @property
    def version(self) -> int:
        """Of the protocol, as flashed."""
        return PROTOCOL_VERSION

    @version.setter
    def version(self, version: int) -> None:
        """Raises Refused where it is another."""
        if version != self.version:
            raise Refused("the emulated board speaks the version of the protocol that it was flashed with")

    def step(self, board_time_us: int, adc_sum: int, supply_mv: int, received: bytes) -> bytes:
        """Bytes sent until `board_time_us`; those received come at the pace of the line. Raises Crashed."""
        self.chip.convert(adc_sum, supply_mv)
        if self._begun is None:
            self.chip.run(_first_sum() - AHEAD_CYCLES)
            self._begun = self.chip.cycle + (STEP_US - board_time_us) * CYCLES_PER_US
        self.chip.receive(received)
        sent = self._sent_until(self._begun + board_time_us * CYCLES_PER_US)
        for frame in self._decoder.feed(sent):
            if isinstance(frame.message, Sample):
                self.samples += 1
                self._state = BoardState(frame.message.state)
        return sent

    def _sent_until(self, cycle: int) -> bytes:
        """What is sent until then, and the rest of what is under way: three frames can take too long."""
        latest = cycle + STEP_US * CYCLES_PER_US
        sent, more = b"", b""
        while self.chip.cycle < cycle or (more and self.chip.cycle < latest):
            self.chip.run(max(cycle, self.chip.cycle + QUIET_CYCLES))
            more = self.chip.sent()
            sent += more
        return sent


@cache
def _first_sum() -> int:
    """Cycle at which the first sum after a boot is complete."""
    chip = Emulator(program())
    while not chip.sums and chip.cycle < LONGEST_BOOT_CYCLES:
        chip.run(chip.cycle + CYCLES_PER_US)
    return chip.cycle + CONVERSION_CYCLES
