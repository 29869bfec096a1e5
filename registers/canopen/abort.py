"""SDO abort codes (CiA 301, 7.2.4.3.17) that this node sends."""

from __future__ import annotations

from enum import Enum


class AbortCode(Enum):
    """Abort code and its meaning."""

    TOGGLE = (0x0503_0000, "toggle bit not alternated")
    TIMEOUT = (0x0504_0000, "SDO protocol timed out")
    COMMAND = (0x0504_0001, "command specifier invalid or not supported")
    UNSUPPORTED_ACCESS = (0x0601_0000, "access not supported: the PDO mapping is fixed")
    WRITE_ONLY = (0x0601_0001, "attempt to read a write-only object")
    READ_ONLY = (0x0601_0002, "attempt to write a read-only object")
    NO_OBJECT = (0x0602_0000, "object does not exist")
    HARDWARE = (0x0606_0000, "the parameter file cannot be written")
    TOO_LONG = (0x0607_0012, "length too high")
    TOO_SHORT = (0x0607_0013, "length too low")
    NO_SUBINDEX = (0x0609_0011, "sub-index does not exist")
    INVALID_VALUE = (0x0609_0030, "value not allowed")
    TOO_HIGH = (0x0609_0031, "value too high")
    TOO_LOW = (0x0609_0032, "value too low")
    NOT_STORED = (0x0800_0020, "value cannot be written by SDO, or cannot be stored")
    LOCAL_CONTROL = (0x0800_0021, "rejected: another client holds the lease, or writes are disabled")
    DEVICE_STATE = (0x0800_0022, "rejected in this state of the instrument")
    NO_DATA = (0x0800_0024, "no data available")

    def __init__(self, code: int, meaning: str) -> None:
        self.code = code
        self.meaning = meaning


#: Abort codes of writes that the instrument rejected. The event log already contains these writes.
SOURCE_REJECTED = frozenset((AbortCode.LOCAL_CONTROL, AbortCode.DEVICE_STATE))


class SdoAbort(Exception):
    """Error that aborts an SDO transfer."""

    def __init__(self, abort_code: AbortCode) -> None:
        super().__init__(abort_code.meaning)
        self.abort_code = abort_code
