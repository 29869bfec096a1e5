"""Cycle-accurate emulation of an ATmega328P: program, pins and serial line."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from enum import IntFlag
from functools import cache
from pathlib import Path
from typing import Any
from weakref import finalize

from pneuforce.sim.avr.toolchain import harness

CYCLES_PER_US = 16
READ_BYTES = 4096
PORTS = "BCD"

_CHIP, _BYTES, _SIZE = ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int
_FUNCTIONS: dict[str, tuple[Any, ...]] = {  # result type, and types of the arguments after the chip pointer
    "chip_free": (None,),
    "chip_run": (ctypes.c_int, ctypes.c_uint64),
    "chip_set_inputs": (None, ctypes.c_uint16, ctypes.c_uint32),
    "chip_receive": (None, _BYTES, _SIZE),
    "chip_sent": (ctypes.c_int, _BYTES, _SIZE),
    "chip_high": (ctypes.c_uint8, ctypes.c_int),
    "chip_reset": (None, ctypes.c_uint8),
    "chip_cycle": (ctypes.c_uint64,),
    "chip_sums": (ctypes.c_uint32,),
    "chip_longest": (ctypes.c_uint32,),
    "chip_overruns": (ctypes.c_uint32,),
    "chip_resets": (ctypes.c_uint32,),
}


class FirmwareCrashed(RuntimeError):
    """Crash of the firmware: an invalid instruction, or a permanent stop of the processor."""


class ResetFlag(IntFlag):
    """Cause of a reset, as a flag of the register MCUSR."""

    POWER_ON = 1
    EXTERNAL = 2
    BROWN_OUT = 4
    WATCHDOG = 8


@cache
def _library() -> Any:
    library = ctypes.CDLL(str(harness()))
    library.chip_new.restype, library.chip_new.argtypes = _CHIP, (_BYTES, _BYTES, ctypes.c_uint32)
    for name, (result, *arguments) in _FUNCTIONS.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, (_CHIP, *arguments)
    return library


class Emulator:
    """Emulated chip, switched on by its constructor. The same calls always give the same bytes."""

    def __init__(self, program: Path, eeprom: bytes = b"") -> None:
        """Load an ELF or .hex file.

        The EEPROM starts with the bytes `eeprom`; its other cells are erased (FFh). Raises
        ToolchainError if the emulator cannot be compiled, or ValueError if the file contains no program.
        """
        self._library = _library()
        self._chip = self._library.chip_new(str(program).encode(), eeprom, len(eeprom))
        if not self._chip:
            raise ValueError(f"{program} contains no program for an ATmega328P: name an ELF or .hex file")
        finalize(self, self._library.chip_free, self._chip)
        self._buffer = ctypes.create_string_buffer(READ_BYTES)

    def run(self, cycle: int) -> None:
        """Run to a cycle, counted from power-on.

        Do nothing if that cycle is in the past. Raises FirmwareCrashed if the program crashes.
        """
        if self._library.chip_run(self._chip, cycle):
            raise FirmwareCrashed(f"the firmware crashed after {self.cycle / CYCLES_PER_US / 1e6:.6f} s")

    def set_inputs(self, adc_sum: int, supply_mv: int) -> None:
        """Set the sum that the next 16 sensor conversions give, and the supply voltage [mV]."""
        self._library.chip_set_inputs(self._chip, adc_sum, supply_mv)

    def receive(self, data: bytes) -> None:
        """Send bytes to the chip at the bit rate of the line."""
        self._library.chip_receive(self._chip, data, len(data))

    def sent(self) -> bytes:
        """Return the bytes that the chip has sent since the last call."""
        size = self._library.chip_sent(self._chip, self._buffer, READ_BYTES)
        return self._buffer.raw[:size]

    def high(self, port: str) -> int:
        """Return a bit mask of the pins that are driven high in a port (B, C or D)."""
        mask: int = self._library.chip_high(self._chip, PORTS.index(port))
        return mask

    def reset(self, cause: ResetFlag) -> None:
        """Reset the chip and report this cause to the program."""
        self._library.chip_reset(self._chip, cause)

    def _count(self, name: str) -> int:
        function: Callable[[int], int] = getattr(self._library, name)
        return function(self._chip)

    @property
    def cycle(self) -> int:
        """Return the number of cycles since power-on."""
        return self._count("chip_cycle")

    @property
    def sums(self) -> int:
        """Return the number of complete sums of 16 conversions since the last reset."""
        return self._count("chip_sums")

    @property
    def longest_cycles(self) -> int:
        """Return the longest time from a complete sum to the reset of the watchdog timer [cycles]."""
        return self._count("chip_longest")

    @property
    def overruns(self) -> int:
        """Return the number of received bytes that a real UART would have lost."""
        return self._count("chip_overruns")

    @property
    def resets(self) -> int:
        """Return the number of resets since power-on."""
        return self._count("chip_resets")
