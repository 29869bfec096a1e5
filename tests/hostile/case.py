"""Structure of a hostile case: steps on one connection, and the answers that a server may give."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tests.hostile.connection import ServerUnderTest

CLOSE = "close"  #: a legal answer that means: the server closes the connection
#: Optional Modbus functions. A server may answer each request with such a function by exception 01.
OPTIONAL = frozenset((1, 2, 4, 5, 6, 8, 15, 16, 22, 23, 43))


class CaseFailure(Exception):
    """Illegal behaviour of a server. The message describes this behaviour."""


class NotSupported(Exception):
    """Error for a case that needs a feature which the server or the machine lacks."""


class ExpectedEnd(Enum):
    """Expected state of the connection after the last step."""

    OPEN = "goes on answering"
    CLOSED = "closed at once"
    TIMED_OUT = "closed in time"  #: closed after a time-out, because a frame is incomplete
    FIN = "FIN"


@dataclass(frozen=True, slots=True)
class ModbusRequest:
    """One request PDU as hex text, and its legal answers: regular expressions for hex PDUs, or CLOSE."""

    pdu: str
    legal: tuple[str, ...]
    unit: int | None = None  #: None means the unit of the server
    transaction: int | None = None  #: None means a new transaction identifier

    def allows(self, answer: str) -> bool:
        """Return True if `answer` is legal. `answer` is a hex text without spaces."""
        return any(re.fullmatch(legal.replace(" ", ""), answer) for legal in self.legal)

    def is_not_supported(self, answer: str) -> bool:
        """Return True if the function is optional and `answer` says that the server does not support it."""
        function = int(self.pdu[:2], 16)
        return function in OPTIONAL and answer == f"{function | 0x80:02x}01"


@dataclass(frozen=True, slots=True)
class Pipelined:
    """Requests that are sent without waiting for answers, in segments of the given sizes."""

    requests: tuple[ModbusRequest, ...]
    segment_sizes: tuple[int, ...] = (1 << 20,)  #: in bytes; repeated as often as needed
    delay_s: float = 0.0  #: pause between two segments
    then_fin: bool = False  #: send FIN before the first answer is read


@dataclass(frozen=True, slots=True)
class RawBytes:
    """Bytes that are not a complete request."""

    data: bytes


@dataclass(frozen=True, slots=True)
class Pause:
    """Pause in which nothing is sent."""

    pause_s: float


@dataclass(frozen=True, slots=True)
class HalfClose:
    """End of sending (FIN). The client continues to read."""


Step = ModbusRequest | Pipelined | RawBytes | Pause | HalfClose
CaseFunction = Callable[["ServerUnderTest"], str]


@dataclass(frozen=True, slots=True, kw_only=True)
class HostileCase:
    """One case. It consists of steps on one connection, or of a function if one connection is not enough.

    The function returns a description of the result, or raises CaseFailure. A case with `needs_pneuforce`
    needs the register map of this instrument. All other cases are for any Modbus TCP server.
    """

    group: str
    name: str
    steps: tuple[Step, ...] = ()
    end: ExpectedEnd = ExpectedEnd.OPEN
    needs_pneuforce: bool = False
    run: CaseFunction | None = None
    expected_text: str = ""

    @property
    def expected(self) -> str:
        """Return a short description of the legal behaviour."""
        if self.expected_text:
            return self.expected_text
        requests = [step for step in self.steps if isinstance(step, ModbusRequest)]
        answers = " or ".join(requests[-1].legal) if requests else ""
        end = "" if self.end is ExpectedEnd.OPEN and requests else self.end.value
        return ", ".join(filter(None, (answers, end)))


def build_frame(
    transaction: int, unit: int, pdu: bytes, length: int | None = None, protocol: int = 0
) -> bytes:
    """Return a frame. `length` and `protocol` may be invalid."""
    header = struct.pack(">HHHB", transaction, protocol, len(pdu) + 1 if length is None else length, unit)
    return header + pdu
