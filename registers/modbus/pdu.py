"""The request core: one request PDU in, one answer PDU out, whatever carried it."""

from __future__ import annotations

import logging
import struct
from collections.abc import Callable

from registers.modbus.bank import VENT, Bank, asks_vent, discrete_inputs
from registers.modbus.codes import Code, exception
from registers.modbus.identity import FUNCTION as IDENTIFICATION
from registers.modbus.identity import Identity
from registers.source import Peer, Source
from registers.sparing_log import SparingLog

MOST_BITS_READ, MOST_BITS_WRITTEN = 2000, 1968
MOST_WORDS_READ, MOST_WORDS_WRITTEN, MOST_WORDS_EXCHANGED = 125, 123, 121
WRITE_FUNCTIONS = frozenset((5, 6, 15, 16, 22, 23))
_COIL_VALUES = (0x0000, 0xFF00)

_TWO = struct.Struct(">HH")
_MANY = struct.Struct(">HHB")
_THREE = struct.Struct(">HHH")
_EXCHANGE = struct.Struct(">HHHHB")

Handler = Callable[[bytes, Peer, float], bytes | Code]


class Responder:
    """Answers requests out of a source.

    Checks come in the order of the specification's flow charts: function, quantity (03), address (02),
    value (03), then the source's own refusal (06); whatever is refused changes nothing. An answer shows one
    snapshot. `read_only` refuses every write function (01). `vent_only` is for what is sent to everybody:
    beyond a vent it is meant for others, so that it is neither carried out nor told of as refused.

    A vent is never refused: where mode := vent is among the words of a well-formed write, the source gets it,
    with the rest of the request if that can be accepted, else alone; the answer then refuses the rest.
    """

    def __init__(
        self,
        bank: Bank,
        source: Source,
        identity: Identity,
        *,
        read_only: bool = False,
        vent_only: bool = False,
    ) -> None:
        self._bank = bank
        self._source = source
        self._read_only = read_only or vent_only
        self._tells = not vent_only
        self._log = SparingLog(logging.getLogger(__name__))
        self._handlers: dict[int, Handler] = {
            1: self._read_coils,
            2: self._read_discrete_inputs,
            3: self._read_words,
            4: self._read_words,
            5: self._write_coil,
            6: self._write_word,
            8: self._diagnose,
            15: self._write_coils,
            16: self._write_words,
            22: self._mask_word,
            23: self._exchange,
            IDENTIFICATION: lambda pdu, _peer, _now_s: identity.answer(pdu),
        }

    def answer(self, pdu: bytes, peer: Peer, now_s: float) -> bytes | None:
        """Answer to one request PDU, at least its function long.

        None where the function, 80h or above, is no request's: the connection is to be closed.
        """
        function = pdu[0]
        if function >= 0x80:
            return None
        handler = self._handlers.get(function)
        if handler is None:
            return exception(function, Code.ILLEGAL_FUNCTION)
        try:
            answer = handler(pdu, peer, now_s)
            if isinstance(answer, Code) and function in WRITE_FUNCTIONS and self._tells:
                answer = self._refused(answer, pdu, peer, now_s)
        except Exception:  # one request's failure must not take the face away from the others
            self._log.say(now_s, "the request %s of %s failed", pdu.hex(" "), peer.address, trace=True)
            answer = Code.DEVICE_FAILURE
        return exception(function, answer) if isinstance(answer, Code) else answer

    def _refused(self, why: Code, pdu: bytes, peer: Peer, now_s: float) -> Code:
        """Tell of a write that is refused; the code to answer."""
        why = Code.ILLEGAL_FUNCTION if self._read_only else why
        self._log.say(now_s, "write %s of %s refused: %s", pdu.hex(" "), peer.address, why.name)
        if why is not Code.DEVICE_BUSY:  # the source's own refusal
            self._source.refused(peer, pdu, why.name.lower(), now_s)
        return why

    def _read_coils(self, pdu: bytes, _peer: Peer, _now_s: float) -> Code:
        if len(pdu) != 5 or not 1 <= _TWO.unpack_from(pdu, 1)[1] <= MOST_BITS_READ:
            return Code.ILLEGAL_VALUE
        return Code.ILLEGAL_ADDRESS

    def _read_discrete_inputs(self, pdu: bytes, peer: Peer, now_s: float) -> bytes | Code:
        if len(pdu) != 5:
            return Code.ILLEGAL_VALUE
        address, count = _TWO.unpack_from(pdu, 1)
        if not 1 <= count <= MOST_BITS_READ:
            return Code.ILLEGAL_VALUE
        data = discrete_inputs(self._source.snapshot(peer, now_s), address, count)
        return data if isinstance(data, Code) else bytes((pdu[0], len(data))) + data

    def _read_words(self, pdu: bytes, peer: Peer, now_s: float) -> bytes | Code:
        if len(pdu) != 5:
            return Code.ILLEGAL_VALUE
        address, count = _TWO.unpack_from(pdu, 1)
        if not 1 <= count <= MOST_WORDS_READ:
            return Code.ILLEGAL_VALUE
        read = self._bank.reader(address, count)
        if read is None:
            return Code.ILLEGAL_ADDRESS
        return bytes((pdu[0], 2 * count)) + read(self._source.snapshot(peer, now_s))

    def _write_coil(self, pdu: bytes, _peer: Peer, _now_s: float) -> Code:
        if len(pdu) != 5 or _TWO.unpack_from(pdu, 1)[1] not in _COIL_VALUES:
            return Code.ILLEGAL_VALUE
        return Code.ILLEGAL_ADDRESS

    def _write_coils(self, pdu: bytes, _peer: Peer, _now_s: float) -> Code:
        if len(pdu) < 6:
            return Code.ILLEGAL_VALUE
        _, count, size = _MANY.unpack_from(pdu, 1)
        if not 1 <= count <= MOST_BITS_WRITTEN or not (count + 7) // 8 == size == len(pdu) - 6:
            return Code.ILLEGAL_VALUE
        return Code.ILLEGAL_ADDRESS

    def _write_word(self, pdu: bytes, peer: Peer, now_s: float) -> bytes | Code:
        if len(pdu) != 5:
            return Code.ILLEGAL_VALUE
        address = _TWO.unpack_from(pdu, 1)[0]
        return self._write(address, pdu[3:], peer, now_s) or pdu

    def _write_words(self, pdu: bytes, peer: Peer, now_s: float) -> bytes | Code:
        if len(pdu) < 6:
            return Code.ILLEGAL_VALUE
        address, count, size = _MANY.unpack_from(pdu, 1)
        if not 1 <= count <= MOST_WORDS_WRITTEN or not 2 * count == size == len(pdu) - 6:
            return Code.ILLEGAL_VALUE
        return self._write(address, pdu[6:], peer, now_s) or pdu[:5]

    def _mask_word(self, pdu: bytes, peer: Peer, now_s: float) -> bytes | Code:
        if len(pdu) != 7:
            return Code.ILLEGAL_VALUE
        address, keep, put = _THREE.unpack_from(pdu, 1)
        read = self._bank.reader(address, 1)
        if read is None:
            return Code.ILLEGAL_ADDRESS
        # where nothing is kept, nothing that can be measured is needed: it may be a vent
        word = int.from_bytes(read(self._source.snapshot(peer, now_s)), "big") if keep else 0
        masked = word & keep | put & ~keep
        return self._write(address, masked.to_bytes(2, "big"), peer, now_s) or pdu

    def _exchange(self, pdu: bytes, peer: Peer, now_s: float) -> bytes | Code:
        if len(pdu) < 10:
            return Code.ILLEGAL_VALUE
        read_at, read_count, write_at, write_count, size = _EXCHANGE.unpack_from(pdu, 1)
        if not 1 <= read_count <= MOST_WORDS_READ or not 1 <= write_count <= MOST_WORDS_EXCHANGED:
            return Code.ILLEGAL_VALUE
        if not 2 * write_count == size == len(pdu) - 10:
            return Code.ILLEGAL_VALUE
        read = self._bank.reader(read_at, read_count)
        unreadable = Code.ILLEGAL_ADDRESS if read is None else None
        refused = self._write(write_at, pdu[10:], peer, now_s, unreadable)
        if refused or read is None:
            return refused or Code.ILLEGAL_ADDRESS
        return bytes((pdu[0], 2 * read_count)) + read(self._source.snapshot(peer, now_s))

    def _write(
        self, address: int, words: bytes, peer: Peer, now_s: float, refused: Code | None = None
    ) -> Code | None:
        """Carry out one write, all or nothing but for a vent; the code that refuses it, or None.

        `refused` is the verdict on another part of the same request.
        """
        wanted = refused or self._bank.writes(address, words)
        if self._read_only and wanted != VENT:
            wanted = Code.ILLEGAL_FUNCTION
        if isinstance(wanted, Code):
            if asks_vent(address, words):
                self._source.write(peer, VENT, now_s)
            return wanted
        return None if self._source.write(peer, wanted, now_s) == "none" else Code.DEVICE_BUSY

    def _diagnose(self, pdu: bytes, _peer: Peer, _now_s: float) -> bytes | Code:
        if len(pdu) < 3:
            return Code.ILLEGAL_VALUE
        return pdu if pdu[1:3] == b"\x00\x00" else Code.ILLEGAL_FUNCTION
