"""Requests and records of RDT (Raw Data Transfer), the UDP protocol of ATI Net F/T and Axia sensors.

All numbers are big-endian. A request has 8 bytes: the header 1234h, a command, and the number of samples.
A record has 36 bytes: two counters, a status code, and six counts. The layout and the commands are those of
ATI's manuals 9620-05-net ft-11, section 10, and 9610-05-Ethernet Axia-09, section 12. The meaning of the
status bits is that of the client library netft-cpp.
"""

from __future__ import annotations

import math
import struct
from enum import IntEnum
from typing import NamedTuple

RDT_PORT = 49152
COUNTS_PER_N = 1_000_000
COUNTS_PER_NM = 1_000_000  #: torques are always 0
RATE_HZ = 500  #: records per second: one for each sample of the rig
#: Count of Fz without a valid force. The count corresponds to 2147 N, which no balloon can produce.
FULL_SCALE_COUNTS = 0x7FFF_FFFF
MAX_FORCE_N = 2147.0  #: largest force of a valid record, below full scale
STATUS_VALID = 0x0000_0000
#: Status without a valid force: bit 31, error summary, and bit 17, transducer saturation or A/D error.
#: Clients treat each status except 0 and 8001_0000h (threshold latched) as serious.
STATUS_INVALID = 0x8002_0000
COUNTER_MASK = 0xFFFF_FFFF

_HEADER = 0x1234
_REQUEST = struct.Struct(">HHI")
_RECORD = struct.Struct(">III6i")


class RdtCommand(IntEnum):
    """Command of a request."""

    STOP = 0x0000
    START_SINGLE_BLOCK = 0x0001  #: one record per datagram; only in the manual of the Axia
    START_REALTIME = 0x0002  #: the same; the Net F/T and the Axia
    START_BUFFERED = 0x0003  #: several records per datagram; the number is a setting of the sensor
    START_MULTI_UNIT = 0x0004  #: several sensors that are synchronized by a cable
    RESET_THRESHOLD_LATCH = 0x0041
    SET_BIAS = 0x0042  #: make the present force the new zero


class RdtRequest(NamedTuple):
    """One request of a client. `command` is not necessarily a known command."""

    command: int
    sample_count: int  #: number of records that the client requests; 0: until the client stops the stream


class RdtRecord(NamedTuple):
    """One record, with the forces and torques in counts."""

    rdt_sequence: int  #: number of the record in its stream, from 1; wraps to 0
    ft_sequence: int  #: sample counter of the instrument; wraps to 0
    status: int
    fx: int
    fy: int
    fz: int
    tx: int
    ty: int
    tz: int

    @property
    def is_valid(self) -> bool:
        """Return True if the force is valid."""
        return self.status == STATUS_VALID and abs(self.fz) < FULL_SCALE_COUNTS

    @property
    def force_n(self) -> float:
        """Return the force [N]; NaN if the force is not valid."""
        return self.fz / COUNTS_PER_N if self.is_valid else math.nan


def encode_request(command: int, sample_count: int = 0) -> bytes:
    """Return the bytes of a request. A sample count of 0 requests records until the stream is stopped."""
    return _REQUEST.pack(_HEADER, command, sample_count)


def decode_request(data: bytes) -> RdtRequest | None:
    """Return the request in a datagram, or None if its length or its header is wrong."""
    if len(data) != _REQUEST.size:
        return None
    header, command, sample_count = _REQUEST.unpack(data)
    return RdtRequest(command, sample_count) if header == _HEADER else None


def force_record(rdt_sequence: int, ft_sequence: int, force_n: float) -> RdtRecord:
    """Return the record of one sample. The force is Fz; all other axes are 0, because they are not measured.

    If `force_n` is NaN or out of range, the record is invalid: the status is serious, and Fz is at full
    scale, because old clients do not read the status. The other axes stay 0, so that a robot controller that
    does not read the status moves the tool only along its axis.
    """
    if -MAX_FORCE_N <= force_n <= MAX_FORCE_N:
        status, fz = STATUS_VALID, round(force_n * COUNTS_PER_N)
    else:
        status, fz = STATUS_INVALID, FULL_SCALE_COUNTS
    return RdtRecord(rdt_sequence & COUNTER_MASK, ft_sequence & COUNTER_MASK, status, 0, 0, fz, 0, 0, 0)


def encode_record(record: RdtRecord) -> bytes:
    """Return the 36 bytes of a record."""
    return _RECORD.pack(*record)


def decode_record(data: bytes) -> RdtRecord:
    """Return the record in a datagram. Raises ValueError if the datagram does not have 36 bytes."""
    if len(data) != _RECORD.size:
        raise ValueError(f"an RDT record has {_RECORD.size} bytes, not {len(data)}")
    return RdtRecord(*_RECORD.unpack(data))
