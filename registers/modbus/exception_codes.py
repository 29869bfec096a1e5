"""Exception codes of the Modbus application protocol, section 7."""

from __future__ import annotations

from enum import IntEnum


class Code(IntEnum):
    """Why a request gets no answer of its own."""

    ILLEGAL_FUNCTION = 0x01
    ILLEGAL_ADDRESS = 0x02
    ILLEGAL_VALUE = 0x03
    DEVICE_FAILURE = 0x04
    DEVICE_BUSY = 0x06
    NO_SUCH_UNIT = 0x0B


def exception(function: int, code: Code) -> bytes:
    """Answer that refuses a request for `function`."""
    return bytes((function | 0x80, code))
