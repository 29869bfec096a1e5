"""Errors of the Modbus client."""

from __future__ import annotations

from pneuforce.errors import PneuforceError


class ModbusClientError(PneuforceError, OSError):
    """Error for an invalid request, a rejected request, or an instrument that cannot be reached."""


class SerialPortError(ModbusClientError):
    """Error for a serial port that cannot be opened."""


class NoAnswerError(ModbusClientError):
    """Error for a request without an answer: no instrument, or a closed connection."""


class UnknownHostError(NoAnswerError):
    """Error for a host name that has no address."""


class WriteRejectedError(ModbusClientError):
    """Error for a rejected write. `reason` is the reject reason, or the name of the exception."""

    def __init__(self, message: str, reason: str) -> None:
        super().__init__(message)
        self.reason = reason
