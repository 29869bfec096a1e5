"""Modbus request handler: one request PDU in, one answer PDU out, independent of the transport."""

from __future__ import annotations

import logging
import struct
from collections.abc import Callable, Collection, Mapping
from typing import Any

from pneuforce.registers.modbus.device_identification import FUNCTION as IDENTIFICATION
from pneuforce.registers.modbus.device_identification import DeviceIdentification
from pneuforce.registers.modbus.exception_codes import ExceptionCode, exception_response
from pneuforce.registers.modbus.register_bank import VENT, RegisterBank, contains_vent, discrete_inputs
from pneuforce.registers.modbus.rejected_request import rejected_request
from pneuforce.registers.source import Peer, Source
from pneuforce.support.throttle import RateLimitedLogger

MAX_BITS_READ, MAX_BITS_WRITTEN = 2000, 1968
MAX_WORDS_READ, MAX_WORDS_WRITTEN = 125, 123
MAX_WORDS_WRITTEN_WITH_READ = 121  #: limit of function 23
WRITE_FUNCTIONS = frozenset((5, 6, 15, 16, 22, 23))
FIRST_EXCEPTION_FUNCTION = 0x80  #: function codes from 80h occur in exception responses only
_COIL_VALUES = (0x0000, 0xFF00)

_ADDRESS_COUNT = struct.Struct(">HH")
_ADDRESS_COUNT_SIZE = struct.Struct(">HHB")
_ADDRESS_MASKS = struct.Struct(">HHH")
_READ_AND_WRITE = struct.Struct(">HHHHB")

Handler = Callable[[bytes, Peer, float], bytes | ExceptionCode]


class RequestHandler:
    """Handler that answers requests from a source.

    The checks follow the flow charts of the Modbus specification: function (01), quantity (03), address (02),
    value (03), and finally the decision of the source (06). A rejected request changes nothing, unless it
    contains a vent. All values in an answer come from one snapshot.

    A vent is never rejected. If a well-formed write contains mode := vent, the source always receives the
    vent. If another part of the write is rejected, the source receives the vent alone, and the answer is an
    exception.

    `writable` contains the quantities that may be written; None means all. A write of another quantity is
    rejected (01). `vent_only` is for broadcasts. A broadcast without a vent is meant for other units. It is
    not carried out, and it is not logged as a rejected write.
    """

    def __init__(
        self,
        bank: RegisterBank,
        source: Source,
        identification: DeviceIdentification,
        *,
        writable: Collection[str] | None = None,
        vent_only: bool = False,
    ) -> None:
        self._bank = bank
        self._source = source
        self._writable = () if vent_only else writable
        self._logs_rejected_writes = not vent_only
        self._log = RateLimitedLogger(logging.getLogger(__name__))
        self._handlers: dict[int, Handler] = {
            1: self._read_coils,
            2: self._read_discrete_inputs,
            3: self._read_words,
            4: self._read_words,
            5: self._write_coil,
            6: self._write_word,
            8: self._diagnostics,
            15: self._write_coils,
            16: self._write_words,
            22: self._mask_write_word,
            23: self._read_and_write_words,
            IDENTIFICATION: lambda pdu, _peer, _now_s: identification.answer(pdu),
        }

    def answer(self, pdu: bytes, peer: Peer, now_s: float) -> bytes | None:
        """Return the answer to one request PDU of at least one byte.

        Returns None if the function is 80h or above. Such a PDU is not a request: close the connection.
        """
        function = pdu[0]
        if function >= FIRST_EXCEPTION_FUNCTION:
            return None
        handler = self._handlers.get(function)
        if handler is None:
            return exception_response(function, ExceptionCode.ILLEGAL_FUNCTION)
        try:
            answer = handler(pdu, peer, now_s)
            if (
                isinstance(answer, ExceptionCode)
                and function in WRITE_FUNCTIONS
                and self._logs_rejected_writes
            ):
                answer = self._log_rejected_write(answer, pdu, peer, now_s)
        except Exception:  # a failed request must not stop the server for other clients
            self._log.warning(
                now_s, "Modbus request %s from %s failed", pdu.hex(" "), peer.address, exc_info=True
            )
            answer = ExceptionCode.DEVICE_FAILURE
        return exception_response(function, answer) if isinstance(answer, ExceptionCode) else answer

    def _log_rejected_write(self, code: ExceptionCode, pdu: bytes, peer: Peer, now_s: float) -> ExceptionCode:
        """Log a rejected write. Return the exception code for the answer."""
        read_only = self._writable is not None and not self._writable
        code = ExceptionCode.ILLEGAL_FUNCTION if read_only else code
        if code is not ExceptionCode.DEVICE_BUSY:  # the source logs its own rejections
            self._source.log_rejected_write(peer, rejected_request(pdu, code, self._bank), now_s)
        return code

    def _read_coils(self, pdu: bytes, _peer: Peer, _now_s: float) -> ExceptionCode:
        if len(pdu) != 5 or not 1 <= _ADDRESS_COUNT.unpack_from(pdu, 1)[1] <= MAX_BITS_READ:
            return ExceptionCode.ILLEGAL_VALUE
        return ExceptionCode.ILLEGAL_ADDRESS

    def _read_discrete_inputs(self, pdu: bytes, peer: Peer, now_s: float) -> bytes | ExceptionCode:
        if len(pdu) != 5:
            return ExceptionCode.ILLEGAL_VALUE
        address, count = _ADDRESS_COUNT.unpack_from(pdu, 1)
        if not 1 <= count <= MAX_BITS_READ:
            return ExceptionCode.ILLEGAL_VALUE
        data = discrete_inputs(self._source.snapshot(peer, now_s), address, count)
        return data if isinstance(data, ExceptionCode) else bytes((pdu[0], len(data))) + data

    def _read_words(self, pdu: bytes, peer: Peer, now_s: float) -> bytes | ExceptionCode:
        if len(pdu) != 5:
            return ExceptionCode.ILLEGAL_VALUE
        address, count = _ADDRESS_COUNT.unpack_from(pdu, 1)
        if not 1 <= count <= MAX_WORDS_READ:
            return ExceptionCode.ILLEGAL_VALUE
        read = self._bank.reader(address, count)
        if read is None:
            return ExceptionCode.ILLEGAL_ADDRESS
        return bytes((pdu[0], 2 * count)) + read(self._source.snapshot(peer, now_s))

    def _write_coil(self, pdu: bytes, _peer: Peer, _now_s: float) -> ExceptionCode:
        if len(pdu) != 5 or _ADDRESS_COUNT.unpack_from(pdu, 1)[1] not in _COIL_VALUES:
            return ExceptionCode.ILLEGAL_VALUE
        return ExceptionCode.ILLEGAL_ADDRESS

    def _write_coils(self, pdu: bytes, _peer: Peer, _now_s: float) -> ExceptionCode:
        if len(pdu) < 6:
            return ExceptionCode.ILLEGAL_VALUE
        _, count, size = _ADDRESS_COUNT_SIZE.unpack_from(pdu, 1)
        if not 1 <= count <= MAX_BITS_WRITTEN or not (count + 7) // 8 == size == len(pdu) - 6:
            return ExceptionCode.ILLEGAL_VALUE
        return ExceptionCode.ILLEGAL_ADDRESS

    def _write_word(self, pdu: bytes, peer: Peer, now_s: float) -> bytes | ExceptionCode:
        if len(pdu) != 5:
            return ExceptionCode.ILLEGAL_VALUE
        address = _ADDRESS_COUNT.unpack_from(pdu, 1)[0]
        return self._write(address, pdu[3:], peer, now_s) or pdu

    def _write_words(self, pdu: bytes, peer: Peer, now_s: float) -> bytes | ExceptionCode:
        if len(pdu) < 6:
            return ExceptionCode.ILLEGAL_VALUE
        address, count, size = _ADDRESS_COUNT_SIZE.unpack_from(pdu, 1)
        if not 1 <= count <= MAX_WORDS_WRITTEN or not 2 * count == size == len(pdu) - 6:
            return ExceptionCode.ILLEGAL_VALUE
        return self._write(address, pdu[6:], peer, now_s) or pdu[:5]

    def _mask_write_word(self, pdu: bytes, peer: Peer, now_s: float) -> bytes | ExceptionCode:
        if len(pdu) != 7:
            return ExceptionCode.ILLEGAL_VALUE
        address, and_mask, or_mask = _ADDRESS_MASKS.unpack_from(pdu, 1)
        read = self._bank.reader(address, 1)
        if read is None:
            return ExceptionCode.ILLEGAL_ADDRESS
        # Without an AND mask the old word is not needed: a vent then works even if no snapshot can be taken.
        word = int.from_bytes(read(self._source.snapshot(peer, now_s)), "big") if and_mask else 0
        masked = word & and_mask | or_mask & ~and_mask
        return self._write(address, masked.to_bytes(2, "big"), peer, now_s) or pdu

    def _read_and_write_words(self, pdu: bytes, peer: Peer, now_s: float) -> bytes | ExceptionCode:
        if len(pdu) < 10:
            return ExceptionCode.ILLEGAL_VALUE
        read_at, read_count, write_at, write_count, size = _READ_AND_WRITE.unpack_from(pdu, 1)
        if not 1 <= read_count <= MAX_WORDS_READ or not 1 <= write_count <= MAX_WORDS_WRITTEN_WITH_READ:
            return ExceptionCode.ILLEGAL_VALUE
        if not 2 * write_count == size == len(pdu) - 10:
            return ExceptionCode.ILLEGAL_VALUE
        read = self._bank.reader(read_at, read_count)
        read_error = ExceptionCode.ILLEGAL_ADDRESS if read is None else None
        error = self._write(write_at, pdu[10:], peer, now_s, read_error)
        if error or read is None:
            return error or ExceptionCode.ILLEGAL_ADDRESS
        return bytes((pdu[0], 2 * read_count)) + read(self._source.snapshot(peer, now_s))

    def _write(
        self, address: int, words: bytes, peer: Peer, now_s: float, earlier_error: ExceptionCode | None = None
    ) -> ExceptionCode | None:
        """Carry out one write, either completely or not at all. Return an exception code if it is rejected.

        A vent among the words is carried out even if the rest is rejected. `earlier_error` is the error in
        another part of the same request.
        """
        values = earlier_error or self._bank.decode_write(address, words)
        if not self._permits(values):
            values = ExceptionCode.ILLEGAL_FUNCTION
        if isinstance(values, ExceptionCode):
            if contains_vent(address, words):
                self._source.write(peer, VENT, now_s)
            return values
        return None if self._source.write(peer, values, now_s) == "none" else ExceptionCode.DEVICE_BUSY

    def _permits(self, values: Mapping[str, Any] | ExceptionCode) -> bool:
        """Return True if the values may be passed to the source, as a vent alone always may."""
        if self._writable is None or values == VENT:
            return True
        if isinstance(values, ExceptionCode):
            return bool(self._writable)
        return all(name in self._writable for name in values)

    def _diagnostics(self, pdu: bytes, _peer: Peer, _now_s: float) -> bytes | ExceptionCode:
        if len(pdu) < 3:
            return ExceptionCode.ILLEGAL_VALUE
        return pdu if pdu[1:3] == b"\x00\x00" else ExceptionCode.ILLEGAL_FUNCTION
