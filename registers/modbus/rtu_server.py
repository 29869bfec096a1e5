"""Modbus RTU on a serial port, opened anew when it comes back; what is said there is decided elsewhere."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import termios
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import serial

from registers.modbus.line_port import PARITIES, opened, why
from registers.modbus.rtu import Timing
from registers.modbus.rtu_unit import Unit
from registers.source import Source
from registers.sparing_log import SparingLog

_log = logging.getLogger(__name__)

_READ_BYTES = 4096
_RETRY_S = 0.5
_SAY_AGAIN_S = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """Where and how the unit listens and answers."""

    port: str
    baud: int = 19200
    parity: Literal["even", "odd", "none"] = "even"
    stop_bits: int = 1
    unit: int = 1
    word_swap: bool = False  #: low word of a 32-bit value first
    read_only: bool = False

    def __str__(self) -> str:
        """As serial ports are called for short: /dev/ttyUSB0, 19200 8E1."""
        return f"{self.port}, {self.baud} 8{PARITIES[self.parity]}{self.stop_bits}"


class ModbusRtuLine:
    """One source as one unit on one serial port."""

    def __init__(
        self,
        source: Source,
        options: Options,
        identity: Mapping[int, str],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.options = options
        self.unsent = 0  #: answers dropped, because the port took no bytes
        self._clock = clock
        self._timing = Timing(options.baud)
        self.unit = Unit(
            source,
            options.unit,
            self._timing,
            identity,
            word_swap=options.word_swap,
            read_only=options.read_only,
        )
        self._log = SparingLog(_log, _SAY_AGAIN_S)
        self._port: serial.Serial | None = None
        self._silence: asyncio.TimerHandle | None = None
        self._reopening: asyncio.Task[None] | None = None
        self._lost_bytes = 0  #: when last told of
        self._told_s = -_SAY_AGAIN_S

    @property
    def is_up(self) -> bool:
        """Whether the port is open."""
        return self._port is not None

    async def start(self) -> None:
        """Open the port and listen. Raises OSError, in a sentence, where it cannot be had."""
        self._attach(await asyncio.to_thread(self._opened))

    def _opened(self) -> serial.Serial:
        own = self.options
        return opened(own.port, own.baud, own.parity, own.stop_bits)

    def close(self) -> None:
        """Give the port back."""
        if self._reopening is not None:
            self._reopening.cancel()
        self._release()

    def _attach(self, port: serial.Serial) -> None:
        self._port = port
        self.unit.begin()
        asyncio.get_running_loop().add_reader(port.fileno(), self._readable)

    def _release(self) -> None:
        port, self._port = self._port, None
        if port is None:
            return
        if self._silence is not None:
            self._silence.cancel()
        asyncio.get_running_loop().remove_reader(port.fileno())
        _discard_output(port)  # else closing waits until it is sent
        port.close()

    def _readable(self) -> None:
        assert self._port is not None
        try:
            data = os.read(self._port.fileno(), _READ_BYTES)
        except BlockingIOError:
            return
        except OSError as error:
            self._lose(why(error))
            return
        if not data:
            self._lose("hung up")
            return
        self.unit.feed(data, self._clock())
        if self._silence is not None:
            self._silence.cancel()
        self._silence = asyncio.get_running_loop().call_later(self._timing.silence_s, self._silent)

    def _silent(self) -> None:
        now_s = self._clock()
        answer = self.unit.answer(now_s)
        if answer:
            self._send(answer)
        if self.unit.lost_bytes > self._lost_bytes and now_s >= self._told_s + _SAY_AGAIN_S:
            self._tell_of_lost_bytes(now_s)

    def _send(self, answer: bytes) -> None:
        """Send, or drop what the port does not take at once: an answer that comes late is a wrong one."""
        assert self._port is not None
        try:
            sent = os.write(self._port.fileno(), answer)
        except BlockingIOError:
            sent = 0
        except OSError as error:
            self._lose(why(error))
            return
        if sent < len(answer):
            self.unsent += 1
            _discard_output(self._port)

    def _tell_of_lost_bytes(self, now_s: float) -> None:
        lost, self._lost_bytes = self.unit.lost_bytes - self._lost_bytes, self.unit.lost_bytes
        self._told_s = now_s
        text = "Modbus RTU on %s: %d bytes were in no whole frame; noise, or other settings?"
        _log.warning(text, self.options, lost)

    def _lose(self, why: str) -> None:
        self._say("is gone: %s", why)
        self._release()
        self._reopening = asyncio.get_running_loop().create_task(self._reopen())

    async def _reopen(self) -> None:
        while self._port is None:
            await asyncio.sleep(_RETRY_S)
            with contextlib.suppress(OSError):
                self._attach(await asyncio.to_thread(self._opened))
        self._say("is open again")

    def _say(self, message: str, *facts: object) -> None:
        self._log.say(self._clock(), f"Modbus RTU: {self.options.port} {message}", *facts)


def _discard_output(port: serial.Serial) -> None:
    with contextlib.suppress(OSError, termios.error):
        port.reset_output_buffer()
