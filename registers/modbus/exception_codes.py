"""Exception codes of the Modbus Application Protocol Specification, section 7."""

from __future__ import annotations

from enum import IntEnum


class ExceptionCode(IntEnum):
    """Reason why a request is answered with an exception response."""

    ILLEGAL_FUNCTION = 0x01
    ILLEGAL_ADDRESS = 0x02
    ILLEGAL_VALUE = 0x03
    DEVICE_FAILURE = 0x04
    DEVICE_BUSY = 0x06
    NO_SUCH_UNIT = 0x0B


def exception_response(function: int, code: ExceptionCode) -> bytes:
    """Return the PDU of the exception response to a request for `function`."""
    return bytes((function | 0x80, code))
