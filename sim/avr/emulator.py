"""An emulated ATmega328P: its program, its pins and its serial line, at exact cycles."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from enum import IntFlag
from functools import cache
from pathlib import Path
from typing import Any
from weakref import finalize

from sim.avr.toolchain import harness

CYCLES_PER_US = 16
READ_BYTES = 4096
PORTS = "BCD"

_CHIP, _BYTES, _SIZE = ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int
_FUNCTIONS: dict[str, tuple[Any, ...]] = {  # what it returns, what it takes after the chip
    "chip_free": (None,),
    "chip_run": (ctypes.c_int, ctypes.c_uint64),
    "chip_convert": (None, ctypes.c_uint16, ctypes.c_uint32),
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


class Crashed(RuntimeError):
    """The program ran into what is no program, or switched itself off."""


class Reset(IntFlag):
    """Why the chip has reset, as MCUSR tells it."""

    POWER_ON = 1
    EXTERNAL = 2
    BROWN_OUT = 4
    WATCHDOG = 8


@cache
def _library() -> Any:
    library = ctypes.CDLL(str(harness()))
    library.chip_new.restype, library.chip_new.argtypes = _CHIP, (_BYTES, _BYTES, ctypes.c_uint32)
    for name, (result, *taken) in _FUNCTIONS.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, (_CHIP, *taken)
    return library


class Emulator:
    """A chip that was just switched on. The same calls give the same bytes."""

    def __init__(self, program: Path, eeprom: bytes = b"") -> None:
        """Load an ELF or a .hex; the EEPROM begins with these bytes and is erased (FFh) beyond.

        Raises ToolMissing, or ValueError where the file holds no program.
        """
        self._library = _library()
        self._chip = self._library.chip_new(str(program).encode(), eeprom, len(eeprom))
        if not self._chip:
            raise ValueError(f"{program} is no program for an ATmega328P")
        finalize(self, self._library.chip_free, self._chip)
        self._buffer = ctypes.create_string_buffer(READ_BYTES)

    def run(self, cycle: int) -> None:
        """Run to a cycle since it was switched on; one that has passed does nothing. Raises Crashed."""
        if self._library.chip_run(self._chip, cycle):
            raise Crashed(f"the program crashed after {self.cycle / CYCLES_PER_US / 1e6:.6f} s")

    def convert(self, adc_sum: int, supply_mv: int) -> None:
        """What the sensor gives in the next sum of 16 conversions, and the supply."""
        self._library.chip_convert(self._chip, adc_sum, supply_mv)

    def receive(self, data: bytes) -> None:
        """Send it bytes, at the pace of the line."""
        self._library.chip_receive(self._chip, data, len(data))

    def sent(self) -> bytes:
        """What it has sent since this was last asked."""
        size = self._library.chip_sent(self._chip, self._buffer, READ_BYTES)
        return self._buffer.raw[:size]

    def high(self, port: str) -> int:
        """Mask of the pins of a port (B, C, D) that are driven high."""
        mask: int = self._library.chip_high(self._chip, PORTS.index(port))
        return mask

    def reset(self, cause: Reset) -> None:
        """Reset it now."""
        self._library.chip_reset(self._chip, cause)

    def _count(self, name: str) -> int:
        function: Callable[[int], int] = getattr(self._library, name)
        return function(self._chip)

    @property
    def cycle(self) -> int:
        """Cycles since it was switched on."""
        return self._count("chip_cycle")

    @property
    def sums(self) -> int:
        """Sums of 16 conversions that have ended since the last reset."""
        return self._count("chip_sums")

    @property
    def longest_cycles(self) -> int:
        """Longest time from a complete sum to the kick of the watchdog."""
        return self._count("chip_longest")

    @property
    def overruns(self) -> int:
        """Received bytes that a real UART would have lost."""
        return self._count("chip_overruns")

    @property
    def resets(self) -> int:
        """How often it was reset since it was switched on."""
        return self._count("chip_resets")
