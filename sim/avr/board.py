"""Board that runs the firmware binary on an emulated chip, with the interface of the Python board."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from pneuforce.protocol.frames import (
    PROTOCOL_VERSION,
    SAMPLES_PER_S,
    BoardKind,
    BoardState,
    FrameDecoder,
    Sample,
    Valve,
)
from pneuforce.protocol.limits import HELD
from pneuforce.sim.avr.emulator import CYCLES_PER_US, Emulator, ResetFlag
from pneuforce.sim.avr.toolchain import OTHER_VERSION, ToolchainError, program
from pneuforce.sim.board.states import ResetCause
from pneuforce.sim.faults import SimulatorRequestError

#: Port bits of valves and output contact, as in firmware/pneuforce/hardware.h.
INLET_BIT, VENT_BIT, OK_BIT = 4, 7, 0
CONVERSION_CYCLES = 13 * 128
#: Time from the start of a step until its ADC sum is complete [cycles]. The transmission of a frame takes
#: 0.5 ms. A frame that is sent to the board at the start of a step therefore arrives before the sum is
#: complete.
AHEAD_CYCLES = 600 * CYCLES_PER_US
#: Transmission time of two bytes [cycles]. After this time without a byte, the transmission is complete.
LINE_IDLE_CYCLES = 40 * CYCLES_PER_US
STEP_US = 1_000_000 // SAMPLES_PER_S
#: Time from the stop of the crystal to the reset by the watchdog [µs]. The watchdog has its own clock. Its
#: first time-out requests an interrupt, which the stopped processor cannot execute. Its second time-out
#: resets the chip.
WATCHDOG_RESET_US = 64_000
MAX_BOOT_CYCLES = 500_000 * CYCLES_PER_US


class AvrBoard:
    """Board with an emulated chip.

    A sample reports the inputs of the previous step, because the 16 conversions of an ADC sum take one step.
    """

    #: Resolution of the supply voltage near 5 V [mV]: 1/16 count of the bandgap conversion, plus truncation.
    supply_step_mv = 3

    def __init__(self, serial: int = 1, reset_cause: ResetCause = ResetCause.POWER_ON) -> None:
        """Start the emulated chip and boot the firmware.

        Raises ToolchainError if the emulator or the firmware cannot be compiled.
        """
        self._eeprom = bytes([BoardKind.EMULATED]) + serial.to_bytes(4, "little")
        self._version = PROTOCOL_VERSION
        self._time_us = 0
        self._boot(program(), ResetFlag[reset_cause.name])

    def _boot(self, binary: Path, cause: ResetFlag) -> None:
        self._binary = binary
        self.chip = Emulator(binary, self._eeprom)
        self.chip.reset(cause)
        self.samples = 0  #: samples sent since boot
        self._state = BoardState.BOOT
        self._decoder = FrameDecoder.for_board_frames()
        self._time_zero_cycle: int | None = None  # cycle at which the board time was 0
        self._clock_stopped_us = 0  # time for which the crystal has been stopped

    @property
    def valves(self) -> int:
        """Return the `Valve` mask of the valves that the board powers now."""
        high = self.chip.high("D")
        inlet, vent = (high >> bit & 1 for bit in (INLET_BIT, VENT_BIT))
        return inlet * Valve.INLET_OPEN.value | vent * Valve.VENT_CLOSED.value

    @property
    def ok(self) -> bool:
        """Return True if the output contact "instrument OK" is closed."""
        return bool(self.chip.high("B") >> OK_BIT & 1)

    @property
    def is_holding(self) -> bool:
        """Return True if the board reports that it holds the balloon at its setpoint."""
        return self._state in HELD

    @property
    def version(self) -> int:
        """Return the protocol version of the flashed firmware."""
        return self._version

    @version.setter
    def version(self, version: int) -> None:
        """Flash a firmware with another protocol version and boot it.

        Raises SimulatorRequestError if that firmware cannot be compiled.
        """
        if version == self._version:
            return
        try:
            binary = _program_of(version)
        except ToolchainError as error:
            raise SimulatorRequestError(str(error)) from None
        self._version = version
        self._boot(binary, ResetFlag.EXTERNAL)

    def step(self, board_time_us: int, adc_sum: int, supply_mv: int, received: bytes) -> bytes:
        """Run until `board_time_us` and return the bytes that the board has sent.

        The received bytes arrive at the bit rate of the line. If the board time is the same as in the
        previous step, the crystal has stopped: the board receives and sends nothing. Raises FirmwareCrashed
        if the firmware crashes.
        """
        if board_time_us == self._time_us:
            self._stop_clock()
            return b""
        self._time_us, self._clock_stopped_us = board_time_us, 0
        self.chip.set_inputs(adc_sum, supply_mv)
        if self._time_zero_cycle is None:
            self.chip.run(_first_sum_cycle(self._binary) - AHEAD_CYCLES)
            self._time_zero_cycle = self.chip.cycle + (STEP_US - board_time_us) * CYCLES_PER_US
        self.chip.receive(received)
        sent = self._sent_until(self._time_zero_cycle + board_time_us * CYCLES_PER_US)
        for frame in self._decoder.feed(sent):
            if isinstance(frame.message, Sample):
                self.samples += 1
                self._state = BoardState(frame.message.state)
        return sent

    def _stop_clock(self) -> None:
        self._clock_stopped_us += STEP_US
        if self._clock_stopped_us == WATCHDOG_RESET_US:
            self._boot(self._binary, ResetFlag.WATCHDOG)
            self._clock_stopped_us = WATCHDOG_RESET_US

    def _sent_until(self, cycle: int) -> bytes:
        """Run to a cycle and return the bytes sent, including the rest of a transmission in progress.

        The function waits for the rest, because three frames can take longer than a step.
        """
        latest = cycle + STEP_US * CYCLES_PER_US
        sent, more = b"", b""
        while self.chip.cycle < cycle or (more and self.chip.cycle < latest):
            self.chip.run(max(cycle, self.chip.cycle + LINE_IDLE_CYCLES))
            more = self.chip.sent()
            sent += more
        return sent


def _program_of(version: int) -> Path:
    """Return the path of a firmware with this protocol version.

    Raises ToolchainError if a firmware with another version cannot be compiled. The supplied binary has only
    the present version.
    """
    if version == PROTOCOL_VERSION:
        return program()
    return program(OTHER_VERSION, f"-DOTHER_VERSION={version}u")


@cache
def _first_sum_cycle(binary: Path) -> int:
    """Return the cycle at which the first ADC sum after a boot is complete.

    At boot, the firmware computes the CRC of its image. Coarse steps first make this search fast.
    """
    chip, before = Emulator(binary), 0
    for step in (STEP_US * CYCLES_PER_US, CYCLES_PER_US):
        chip, cycle = Emulator(binary), before
        while not chip.sums and cycle < MAX_BOOT_CYCLES:
            before, cycle = cycle, cycle + step
            chip.run(cycle)
    return chip.cycle + CONVERSION_CYCLES
