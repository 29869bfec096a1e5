"""Modbus RTU unit without I/O: received bytes and their arrival times → answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pneuforce.registers.modbus.device_identification import DeviceIdentification
from pneuforce.registers.modbus.echo_detector import EchoDetector
from pneuforce.registers.modbus.pdu import FIRST_EXCEPTION_FUNCTION, RequestHandler
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.registers.modbus.rtu import RtuDecoder, RtuTiming, encode_frame
from pneuforce.registers.source import Peer, Source

BROADCAST = 0
_PEER = Peer("modbus_rtu")


@dataclass(slots=True)
class ModbusRtuCounters:
    """Event counters of the unit since its start."""

    requests: int = 0  #: requests to this unit
    exceptions: int = 0  #: requests answered with an exception code
    broadcasts: int = 0
    other_units: int = 0  #: frames to and from other units
    echoes: int = 0  #: received echoes of this unit's own answers


class ModbusRtuUnit:
    """Unit that answers its requests after the line has become silent. Broadcasts can only vent.

    If this process was late, several frames are decoded at once. All requests are then carried out in order,
    but only the last frame is answered: the master no longer waits for the other answers.
    """

    def __init__(
        self,
        source: Source,
        unit: int,
        timing: RtuTiming,
        identity: Mapping[int, str],
        *,
        word_swap: bool = False,
        read_only: bool = False,
    ) -> None:
        self.counters = ModbusRtuCounters()
        self._unit = unit
        bank, identification = RegisterBank(word_swap=word_swap), DeviceIdentification(identity)
        self._request_handler = RequestHandler(
            bank, source, identification, writable=() if read_only else None
        )
        self._broadcast_handler = RequestHandler(bank, source, identification, vent_only=True)
        self._timing = timing
        self._decoder, self._echo_detector = RtuDecoder(timing), EchoDetector(timing)
        self._lost_bytes_when_sent = 0

    def reset(self) -> None:
        """Drop incomplete frames and the echo state. Call this when the port has been reopened."""
        self._decoder.reset()
        self._echo_detector = EchoDetector(self._timing)

    @property
    def lost_bytes(self) -> int:
        """Return the number of bytes that belong to no complete frame."""
        return self._decoder.lost_bytes

    def feed(self, data: bytes, now_s: float) -> None:
        """Add received bytes."""
        self._decoder.feed(data, now_s)

    def answer(self, now_s: float) -> bytes:
        """Return the frame to send after a silence; b"" if there is no request to answer."""
        frames = self._decoder.frames()
        answers = [self._handle(frame, now_s) for frame in frames]
        if not answers or not answers[-1]:
            return b""
        self._echo_detector.sent(answers[-1], frames[-1], now_s)
        self._lost_bytes_when_sent = self.lost_bytes
        return answers[-1]

    def _handle(self, frame: bytes, now_s: float) -> bytes:
        unit, pdu, counters = frame[0], frame[1:-2], self.counters
        if self._echo_detector.is_echo(frame, now_s, self.lost_bytes == self._lost_bytes_when_sent):
            counters.echoes += 1
        elif unit == BROADCAST:
            counters.broadcasts += 1
            self._broadcast_handler.answer(pdu, _PEER, now_s)
        elif unit != self._unit:
            counters.other_units += 1
        else:
            return self._answer_request(pdu, now_s)
        return b""

    def _answer_request(self, pdu: bytes, now_s: float) -> bytes:
        answer = self._request_handler.answer(pdu, _PEER, now_s)
        if answer is None:
            return b""
        self.counters.requests += 1
        self.counters.exceptions += answer[0] >= FIRST_EXCEPTION_FUNCTION
        return encode_frame(self._unit, answer)
