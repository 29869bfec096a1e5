"""One unit on a serial line without I/O: bytes and their times in, answers out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from registers.modbus.bank import Bank
from registers.modbus.echo import Echo
from registers.modbus.identity import Identity
from registers.modbus.pdu import Responder
from registers.modbus.rtu import Decoder, Timing, frame
from registers.source import Peer, Source

BROADCAST = 0
_LINE = Peer("modbus_rtu")


@dataclass(slots=True)
class Counters:
    """What the unit has seen since it was made."""

    requests: int = 0  #: to this unit
    exceptions: int = 0  #: requests answered with an exception code
    broadcasts: int = 0
    others: int = 0  #: frames to and from other units
    echoes: int = 0  #: our own answers, heard again


class Unit:
    """Answers what it alone was asked, once the line is silent behind it; a broadcast may only vent.

    Where a late scheduler has joined frames, all requests are carried out in order, and the last frame is
    answered: whoever sent the others waits no more.
    """

    def __init__(
        self,
        source: Source,
        unit: int,
        timing: Timing,
        identity: Mapping[int, str],
        *,
        word_swap: bool = False,
        read_only: bool = False,
    ) -> None:
        self.counters = Counters()
        self._unit = unit
        bank, objects = Bank(word_swap=word_swap), Identity(identity)
        self._responder = Responder(bank, source, objects, read_only=read_only)
        self._everybody = Responder(bank, source, objects, vent_only=True)
        self._timing = timing
        self._decoder, self._echo = Decoder(timing), Echo(timing)
        self._lost_when_sent = 0

    def begin(self) -> None:
        """Forget what the line did: its port was opened anew, and another adapter may hear itself."""
        self._decoder.forget()
        self._echo = Echo(self._timing)

    @property
    def lost_bytes(self) -> int:
        """Bytes that were in no whole frame."""
        return self._decoder.lost_bytes

    def feed(self, data: bytes, now_s: float) -> None:
        """Take in what has just come."""
        self._decoder.feed(data, now_s)

    def answer(self, now_s: float) -> bytes:
        """The frame to send after a silence, b"" where nobody asked."""
        frames = self._decoder.frames()
        answers = [self._carry_out(heard, now_s) for heard in frames]
        if not answers or not answers[-1]:
            return b""
        self._echo.sent(answers[-1], frames[-1], now_s)
        self._lost_when_sent = self.lost_bytes
        return answers[-1]

    def _carry_out(self, heard: bytes, now_s: float) -> bytes:
        unit, pdu, counters = heard[0], heard[1:-2], self.counters
        if self._echo.is_echo(heard, now_s, self.lost_bytes == self._lost_when_sent):
            counters.echoes += 1
        elif unit == BROADCAST:
            counters.broadcasts += 1
            self._everybody.answer(pdu, _LINE, now_s)
        elif unit != self._unit:
            counters.others += 1
        else:
            return self._answered(pdu, now_s)
        return b""

    def _answered(self, pdu: bytes, now_s: float) -> bytes:
        answer = self._responder.answer(pdu, _LINE, now_s)
        if answer is None:
            return b""
        self.counters.requests += 1
        self.counters.exceptions += answer[0] >= 0x80
        return frame(self._unit, answer)
