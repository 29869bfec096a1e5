"""The emulated board: the firmware's own binary behind the seam of the board in Python."""

from __future__ import annotations

from functools import cache
from pathlib import Path

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
from sim.avr.toolchain import OTHER_VERSION, ToolMissing, program
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
#: The watchdog has a clock of its own: its interrupt finds no processor, its second time-out resets.
QUARTZ_MISSED_US = 64_000
LONGEST_BOOT_CYCLES = 100_000 * CYCLES_PER_US


class AvrBoard:
    """A board that has just booted.

    A sample shows what was given one step before, because its 16 conversions take that long.
    """

    supply_step_mv = 3  #: a sixteenth of a count of the bandgap's conversion, near 5 V, and what is cut off

    def __init__(self, serial: int = 1, reset_cause: ResetCause = ResetCause.POWER_ON) -> None:
        """Raises ToolMissing."""
        self._eeprom = bytes([BoardKind.EMULATED]) + serial.to_bytes(4, "little")
        self._version = PROTOCOL_VERSION
        self._time_us = 0
        self._boot(program(), Reset[reset_cause.name])

    def _boot(self, flashed: Path, cause: Reset) -> None:
        self._flashed = flashed
        self.chip = Emulator(flashed, self._eeprom)
        self.chip.reset(cause)
        self.samples = 0  #: sent since boot
        self._state = BoardState.BOOT
        self._decoder = Decoder.of_board()
        self._begun: int | None = None  # cycle at which the board's time began
        self._stands_us = 0  # for how long the quartz has stood still

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
        return self._version

    @version.setter
    def version(self, version: int) -> None:
        """Flash the program of another release. Raises Refused where it cannot be compiled."""
        if version == self._version:
            return
        try:
            flashed = _program_of(version)
        except ToolMissing as missing:
            raise Refused(str(missing)) from None
        self._version = version
        self._boot(flashed, Reset.EXTERNAL)

    def step(self, board_time_us: int, adc_sum: int, supply_mv: int, received: bytes) -> bytes:
        """Bytes sent until `board_time_us`; those received come at the pace of the line. Raises Crashed.

        Where the board's time stands still nothing is heard or said.
        """
        if board_time_us == self._time_us:
            self._stand_still()
            return b""
        self._time_us, self._stands_us = board_time_us, 0
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

    def _stand_still(self) -> None:
        self._stands_us += STEP_US
        if self._stands_us == QUARTZ_MISSED_US:
            self._boot(self._flashed, Reset.WATCHDOG)
            self._stands_us = QUARTZ_MISSED_US

    def _sent_until(self, cycle: int) -> bytes:
        """What is sent until then, and the rest of what is under way: three frames can take too long."""
        latest = cycle + STEP_US * CYCLES_PER_US
        sent, more = b"", b""
        while self.chip.cycle < cycle or (more and self.chip.cycle < latest):
            self.chip.run(max(cycle, self.chip.cycle + QUIET_CYCLES))
            more = self.chip.sent()
            sent += more
        return sent


def _program_of(version: int) -> Path:
    """Raises ToolMissing: what comes with a release speaks its own version only."""
    if version == PROTOCOL_VERSION:
        return program()
    return program(OTHER_VERSION, f"-DOTHER_VERSION={version}u")


@cache
def _first_sum() -> int:
    """Cycle at which the first sum after a boot is complete."""
    chip = Emulator(program())
    while not chip.sums and chip.cycle < LONGEST_BOOT_CYCLES:
        chip.run(chip.cycle + CYCLES_PER_US)
    return chip.cycle + CONVERSION_CYCLES
