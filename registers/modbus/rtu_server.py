"""Modbus RTU server on a serial port. The port is reopened automatically after an error."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

from pneuforce.registers.modbus.rtu import RtuTiming
from pneuforce.registers.modbus.rtu_port import (
    PARITIES,
    RtuPort,
    describe_port_error,
    discard_output,
    open_port,
)
from pneuforce.registers.modbus.rtu_unit import ModbusRtuUnit
from pneuforce.registers.source import Source
from pneuforce.support.throttle import RateLimitedLogger

_log = logging.getLogger(__name__)

_READ_BYTES = 4096
_REOPEN_S = 0.5
_LOG_PERIOD_S = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ModbusRtuOptions:
    """Options of the server."""

    port: str
    baud: int = 19200
    parity: Literal["even", "odd", "none"] = "even"
    stop_bits: int = 1
    unit: int = 1
    word_swap: bool = False  #: low word of a 32-bit value first
    read_only: bool = False

    def __str__(self) -> str:
        """Return the port and its settings in the usual short form: /dev/ttyUSB0, 19200 8E1."""
        return f"{self.port}, {self.baud} 8{PARITIES[self.parity]}{self.stop_bits}"


class ModbusRtuServer:
    """Server for one source as one unit on one serial port."""

    def __init__(
        self,
        source: Source,
        options: ModbusRtuOptions,
        identity: Mapping[int, str],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.options = options
        self.dropped_answers = 0  #: answers dropped because the port did not accept them
        self._clock = clock
        self._timing = RtuTiming(options.baud)
        self.unit = ModbusRtuUnit(
            source,
            options.unit,
            self._timing,
            identity,
            word_swap=options.word_swap,
            read_only=options.read_only,
        )
        self._log = RateLimitedLogger(_log, _LOG_PERIOD_S)
        self._port: RtuPort | None = None
        self._silence_timer: asyncio.TimerHandle | None = None
        self._reopening: asyncio.Task[None] | None = None
        self._logged_lost_bytes = 0
        self._logged_lost_bytes_s = -_LOG_PERIOD_S

    @property
    def is_up(self) -> bool:
        """Return True if the port is open."""
        return self._port is not None

    async def start(self) -> None:
        """Open the port and listen. Raises OSError, with the cause in the message, if it cannot be opened."""
        self._attach(await asyncio.to_thread(self._open_port))

    def _open_port(self) -> RtuPort:
        options = self.options
        return open_port(options.port, options.baud, options.parity, options.stop_bits)

    def close(self) -> None:
        """Close the port."""
        if self._reopening is not None:
            self._reopening.cancel()
        self._detach()

    def _attach(self, port: RtuPort) -> None:
        self._port = port
        self.unit.reset()
        asyncio.get_running_loop().add_reader(port.fileno(), self._on_readable)

    def _detach(self) -> None:
        port, self._port = self._port, None
        if port is None:
            return
        if self._silence_timer is not None:
            self._silence_timer.cancel()
        asyncio.get_running_loop().remove_reader(port.fileno())
        discard_output(port)  # otherwise closing blocks until the output is sent
        port.close()

    def _on_readable(self) -> None:
        assert self._port is not None
        try:
            data = os.read(self._port.fileno(), _READ_BYTES)
        except BlockingIOError:
            return
        except OSError as error:
            self._on_port_lost(describe_port_error(error))
            return
        if not data:
            self._on_port_lost("hung up")
            return
        self.unit.feed(data, self._clock())
        if self._silence_timer is not None:
            self._silence_timer.cancel()
        loop = asyncio.get_running_loop()
        self._silence_timer = loop.call_later(self._timing.silence_s, self._on_silence)

    def _on_silence(self) -> None:
        now_s = self._clock()
        answer = self.unit.answer(now_s)
        if answer:
            self._send(answer)
        is_new = self.unit.lost_bytes > self._logged_lost_bytes
        if is_new and now_s >= self._logged_lost_bytes_s + _LOG_PERIOD_S:
            self._log_lost_bytes(now_s)

    def _send(self, answer: bytes) -> None:
        """Send the answer, or drop it if the port does not accept all of it at once.

        The master would treat a late answer as the answer to its next request.
        """
        assert self._port is not None
        try:
            sent = os.write(self._port.fileno(), answer)
        except BlockingIOError:
            sent = 0
        except OSError as error:
            self._on_port_lost(describe_port_error(error))
            return
        if sent < len(answer):
            self.dropped_answers += 1
            discard_output(self._port)

    def _log_lost_bytes(self, now_s: float) -> None:
        lost = self.unit.lost_bytes - self._logged_lost_bytes
        self._logged_lost_bytes, self._logged_lost_bytes_s = self.unit.lost_bytes, now_s
        _log.warning(
            "Modbus RTU on %s: %d received bytes belong to no complete frame: check the line for noise, and "
            "the settings of the other devices",
            self.options,
            lost,
        )

    def _on_port_lost(self, reason: str) -> None:
        self._log_warning("lost: %s; connect it again, then it is opened automatically", reason)
        self._detach()
        self._reopening = asyncio.get_running_loop().create_task(self._reopen())

    async def _reopen(self) -> None:
        while self._port is None:
            await asyncio.sleep(_REOPEN_S)
            with contextlib.suppress(OSError):
                self._attach(await asyncio.to_thread(self._open_port))
        self._log_warning("is open again")

    def _log_warning(self, message: str, *args: object) -> None:
        self._log.warning(self._clock(), f"Modbus RTU: {self.options.port} {message}", *args)
