"""The emulated board: the firmware's own binary behind the seam of the board in Python."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from instrument.rig.frames import (
    BAUD,
    FRAME_BYTES,
    PROTOCOL_VERSION,
    BoardKind,
    BoardState,
    Decoder,
    Sample,
    Valve,
)
from sim.avr.emulator import CYCLES_PER_US, Emulator, Reset
from sim.avr.toolchain import program
from sim.faults import Refused

FIRMWARE = Path(__file__).parents[2] / "firmware" / "pneuforce" / "pneuforce.ino"
#: Relays of the shield: pins of port D.
INLET_PIN, VENT_PIN = 4, 7
CONVERSION_CYCLES = 13 * 128
#: A step begins this long before its sum is complete, so that what it receives (24 bytes take 0.53 ms) is
#: known by then, and what is sent goes out before it ends.
AHEAD_CYCLES = 600 * CYCLES_PER_US
BYTE_CYCLES = 10 * 1_000_000 // BAUD * CYCLES_PER_US
LATEST_CYCLES = FRAME_BYTES * BYTE_CYCLES
LONGEST_BOOT_CYCLES = 100_000 * CYCLES_PER_US


class AvrBoard:
    """A board that has just booted.

    A sample shows what was given one step before, because its 16 conversions take that long.
    """

    def __init__(self, serial: int = 1) -> None:
        """Raises ToolMissing."""
        self.samples = 0  #: sent since boot
        self._state = BoardState.BOOT
        self._decoder = Decoder.of_board()
        self._binary = program(_source())
        self._emulator = Emulator(self._binary, bytes([BoardKind.EMULATED]) + serial.to_bytes(4, "little"))
        self._begin = 0  # cycle at which the first step begins

    @property
    def valves(self) -> int:
        """`Valve` mask that the board drives now."""
        high = self._emulator.high("D")
        inlet, vent = (high >> pin & 1 for pin in (INLET_PIN, VENT_PIN))
        return inlet * Valve.INLET_OPEN.value | vent * Valve.VENT_CLOSED.value

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
        if version != self.version:
            raise Refused("the emulated board speaks the version of the protocol that it was flashed with")

    def step(self, board_time_us: int, adc_sum: int, supply_mv: int, received: bytes) -> bytes:
        """Bytes sent until `board_time_us` since boot; bytes received come in at the pace of the line.

        Raises Crashed.
        """
        self._emulator.convert(adc_sum, supply_mv)
        if not self._begin:
            self._begin = _first_sum(self._binary) - AHEAD_CYCLES
            self._emulator.run(self._begin)
        self._emulator.receive(received)
        sent = self._sent_until(self._begin + board_time_us * CYCLES_PER_US)
        for frame in self._decoder.feed(sent):
            if isinstance(frame.message, Sample):
                self.samples += 1
                self._state = BoardState(frame.message.state)
        return sent

    def _sent_until(self, cycle: int) -> bytes:
        """What is sent until then, and the rest of a frame that is under way."""
        self._emulator.run(cycle)
        sent = self._emulator.sent()
        while len(sent) % FRAME_BYTES and self._emulator.cycle < cycle + LATEST_CYCLES:
            self._emulator.run(self._emulator.cycle + BYTE_CYCLES)
            sent += self._emulator.sent()
        return sent

    def reset(self, cause: Reset) -> None:
        """Let the chip boot anew, now."""
        self._emulator.reset(cause)


def _source() -> Path:
    if not FIRMWARE.exists():
        raise FileNotFoundError(
            f"the firmware's source is not here ({FIRMWARE}): the emulated board needs a clone"
        )
    return FIRMWARE


@cache
def _first_sum(binary: Path) -> int:
    """Cycle at which the first sum of a program is complete."""
    emulator = Emulator(binary)
    while not emulator.sums and emulator.cycle < LONGEST_BOOT_CYCLES:
        emulator.run(emulator.cycle + CYCLES_PER_US)
    return emulator.cycle + CONVERSION_CYCLES
