"""What a hostile case is made of: steps on one connection, and what a server may do about them."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tests.hostile.line import Server

CLOSE = "close"  #: among the legal answers: the server may close instead
#: Functions that a server need not offer: it answers 01 to all of their requests, and that is no fault.
OPTIONAL = frozenset((1, 2, 4, 5, 6, 8, 15, 16, 22, 23, 43))


class Wrong(Exception):
    """What a server did and may not do."""


class NotOffered(Exception):
    """The server, or the machine, has not what the case is about."""


class End(Enum):
    """What must become of the connection behind the last step."""

    ANSWERS = "goes on answering"
    CLOSED = "closed at once"
    OVERDUE = "closed in time"  #: a frame was left unfinished
    FIN = "FIN"


@dataclass(frozen=True, slots=True)
class Ask:
    """One request PDU in hex, and the legal answers: PDUs in hex, as regular expressions, or CLOSE."""

    pdu: str
    legal: tuple[str, ...]
    unit: int | None = None  #: the server's own where none is named
    number: int | None = None  #: of the transaction; a new one where none is named

    def allows(self, answer: str) -> bool:
        """Whether this is a legal answer, in hex without spaces."""
        return any(re.fullmatch(legal.replace(" ", ""), answer) for legal in self.legal)

    def not_offered(self, answer: str) -> bool:
        """Whether the answer says that the server has no such function, which it need not have."""
        function = int(self.pdu[:2], 16)
        return function in OPTIONAL and answer == f"{function | 0x80:02x}01"


@dataclass(frozen=True, slots=True)
class Together:
    """Requests sent without waiting for an answer, in pieces of so many bytes."""

    asks: tuple[Ask, ...]
    pieces: tuple[int, ...] = (1 << 20,)  #: used in turn
    apart_s: float = 0.0
    then_fin: bool = False  #: before an answer is read


@dataclass(frozen=True, slots=True)
class Raw:
    """Bytes that are no request, or not a whole one."""

    data: bytes


@dataclass(frozen=True, slots=True)
class Pause:
    """Nothing, for a while."""

    pause_s: float


@dataclass(frozen=True, slots=True)
class HalfClose:
    """The client sends no more, and goes on reading."""


Step = Ask | Together | Raw | Pause | HalfClose
Play = Callable[["Server"], str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One case; `ours` needs the register map of this instrument, all others any Modbus TCP server.

    What one connection cannot show is a `play`: it tells what it got, or raises Wrong.
    """

    group: str
    name: str
    steps: tuple[Step, ...] = ()
    end: End = End.ANSWERS
    ours: bool = False
    play: Play | None = None
    wanted: str = ""

    @property
    def expected(self) -> str:
        """What is legal, in a few words."""
        if self.wanted:
            return self.wanted
        asks = [step for step in self.steps if isinstance(step, Ask)]
        answers = " or ".join(asks[-1].legal) if asks else ""
        return ", ".join(filter(None, (answers, "" if self.end is End.ANSWERS and asks else self.end.value)))


def framed(number: int, unit: int, pdu: bytes, length: int | None = None, protocol: int = 0) -> bytes:
    """A frame, whose length and protocol identifier may be wrong."""
    return struct.pack(">HHHB", number, protocol, len(pdu) + 1 if length is None else length, unit) + pdu
