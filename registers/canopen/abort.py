"""Why an SDO transfer is aborted: the codes of CiA 301, 7.2.4.3.17, as far as this node has use for them."""

from __future__ import annotations

from enum import Enum


class Why(Enum):
    """A reason: its code, and what it says."""

    TOGGLE = (0x0503_0000, "toggle bit not alternated")
    TIMEOUT = (0x0504_0000, "SDO protocol timed out")
    COMMAND = (0x0504_0001, "command specifier not valid, or not supported")
    READ_ONLY = (0x0601_0002, "attempt to write a read-only object")
    NO_OBJECT = (0x0602_0000, "object does not exist")
    TOO_LONG = (0x0607_0012, "length too high")
    TOO_SHORT = (0x0607_0013, "length too low")
    NO_SUB_INDEX = (0x0609_0011, "sub-index does not exist")
    VALUE = (0x0609_0030, "value not allowed")
    TOO_HIGH = (0x0609_0031, "value too high")
    TOO_LOW = (0x0609_0032, "value too low")
    NOT_STORED = (0x0800_0020, "cannot be stored by SDO")
    LOCAL_CONTROL = (0x0800_0021, "refused: another holds the lease, or writes are locked")
    DEVICE_STATE = (0x0800_0022, "refused by the instrument in its present state")
    NO_DATA = (0x0800_0024, "no data available")

    def __init__(self, code: int, sentence: str) -> None:
        self.code = code
        self.sentence = sentence


class Abort(Exception):
    """An SDO request that cannot be answered as asked."""

    def __init__(self, why: Why) -> None:
        super().__init__(why.sentence)
        self.why = why
