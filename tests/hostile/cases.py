"""Hostile cases as data: cases for any Modbus TCP server, then cases for the map of this instrument.

Sources: MODBUS Application Protocol Specification V1.1b3; MODBUS Messaging on TCP/IP Implementation Guide
V1.0b. The time-outs after which a connection is closed are a rule of this instrument, not of Modbus.
"""

from __future__ import annotations

from itertools import chain

from tests.hostile import lease_cases, many_clients
from tests.hostile.case import (
    CLOSE,
    ExpectedEnd,
    HalfClose,
    HostileCase,
    ModbusRequest,
    Pipelined,
    RawBytes,
    build_frame,
)
from tests.hostile.connection import PROBE

QUANTITIES, WRITES, FUNCTIONS, HEADERS, STREAMS, CONNECTIONS = (
    "quantities and addresses",
    "malformed writes",
    "functions",
    "headers",
    "streams",
    "connections",
)
VALUES, MAP, VENTS, LEASES = "values", "map", "vents", "leases"

#: Cases with one request on a new connection, which must stay open: group, name, request, legal answers.
GENERIC_SINGLE = [
    (QUANTITIES, "FC03, no register", "03 0000 0000", "83 03"),
    (QUANTITIES, "FC04, no register", "04 0000 0000", "84 03"),
    (QUANTITIES, "FC03, 126 registers", "03 0000 007e", "83 03"),
    (QUANTITIES, "FC04, 126 registers", "04 0000 007e", "84 03"),
    (QUANTITIES, "FC03, 65535 registers", "03 0000 ffff", "83 03"),
    (QUANTITIES, "FC01, no coil", "01 0000 0000", "81 03"),
    (QUANTITIES, "FC01, 2001 coils", "01 0000 07d1", "81 03"),
    (QUANTITIES, "FC02, no input", "02 0000 0000", "82 03"),
    (QUANTITIES, "FC02, 2001 inputs", "02 0000 07d1", "82 03"),
    (QUANTITIES, "FC03 past 65535", "03 ffff 0002", "83 02"),
    (QUANTITIES, "FC04 past 65535", "04 ffff 0002", "84 02"),
    (QUANTITIES, "FC03, 125 registers past 65535", "03 ff9c 007d", "83 02"),
    (QUANTITIES, "FC01 past 65535", "01 ffff 0002", "81 02"),
    (QUANTITIES, "FC02 past 65535", "02 ffff 0002", "82 02"),
    (QUANTITIES, "FC03, truncated", "03 0000", "83 03", CLOSE),
    (QUANTITIES, "FC03, function code only", "03", "83 03", CLOSE),
    (WRITES, "FC16, byte count below twice the quantity", "10 0000 0002 02 0000", "90 03"),
    (WRITES, "FC16, odd byte count", "10 0000 0002 03 000000", "90 03"),
    (WRITES, "FC16, byte count above twice the quantity", "10 0000 0001 04 00000000", "90 03"),
    (WRITES, "FC16, no register", "10 0000 0000 00", "90 03"),
    (WRITES, "FC16, 124 registers", "10 0000 007c f7" + 247 * "00", "90 03"),
    (WRITES, "FC16, 32768 registers", "10 0000 8000 00", "90 03"),
    (WRITES, "FC16, data shorter than the byte count", "10 0000 0002 04 0000", "90 03", CLOSE),
    (WRITES, "FC16, without data", "10 0000 0002", "90 03", CLOSE),
    (WRITES, "FC16 past 65535", "10 ffff 0002 04 00000000", "90 02"),
    (WRITES, "FC06, truncated", "06 0000", "86 03", CLOSE),
    (WRITES, "FC05, value 0001h", "05 0000 0001", "85 03"),
    (WRITES, "FC05, value FFFFh", "05 0000 ffff", "85 03"),
    (WRITES, "FC05, value 00FFh", "05 0000 00ff", "85 03"),
    (WRITES, "FC15, no coil", "0f 0000 0000 00", "8f 03"),
    (WRITES, "FC15, 1969 coils", "0f 0000 07b1 f7" + 247 * "00", "8f 03"),
    (WRITES, "FC15, byte count too small", "0f 0000 000a 01 00", "8f 03"),
    (WRITES, "FC15 past 65535", "0f ffff 0002 01 00", "8f 02"),
    (WRITES, "FC22, truncated", "16 0000 ffff", "96 03", CLOSE),
    (WRITES, "FC23, reads no register", "17 0000 0000 0000 0001 02 0000", "97 03"),
    (WRITES, "FC23, reads 126 registers", "17 0000 007e 0000 0001 02 0000", "97 03"),
    (WRITES, "FC23, writes no register", "17 0000 0001 0000 0000 00", "97 03"),
    (WRITES, "FC23, writes 122 registers", "17 0000 0001 0000 007a f3" + 243 * "00", "97 03"),
    (WRITES, "FC23, wrong byte count", "17 0000 0001 0000 0002 02 0000", "97 03"),
    (WRITES, "FC23, reads past 65535", "17 ffff 0002 0000 0001 02 0000", "97 02"),
    (WRITES, "FC23, writes past 65535", "17 0000 0001 ffff 0002 04 00000000", "97 02"),
    (WRITES, "FC23 writes before it reads", "17 0000 0001 0000 0001 02 2b67", "17 02 2b67", "97 02"),
    (FUNCTIONS, "function 0", "00 0000 0001", "80 01", CLOSE),
    (FUNCTIONS, "function 09h", "09 0000 0001", "89 01"),
    (FUNCTIONS, "function 48h", "48 0000 0001", "c8 01"),
    (FUNCTIONS, "function 64h", "64 0000 0001", "e4 01"),
    (FUNCTIONS, "function 7Fh without data", "7f", "ff 01"),
    (FUNCTIONS, "function 80h", "80 0000 0001", CLOSE, "80 01"),
    (FUNCTIONS, "function 83h, an exception response", "83 0000 0001", CLOSE, "83 01"),
    (FUNCTIONS, "function FFh", "ff 0000 0001", CLOSE, "ff 01"),
    (FUNCTIONS, "FC08/0 echoes", "08 0000 a537", "08 0000 a537"),
    (FUNCTIONS, "FC08, sub-function FFFFh", "08 ffff 0000", "88 0[13]"),
    (FUNCTIONS, "FC08, truncated", "08 00", "88 03", CLOSE),
    (FUNCTIONS, "FC43/14, basic objects", "2b 0e 01 00", "2b 0e 01 .. .. .. .. 00.*"),
    (FUNCTIONS, "FC43/14, stream from a missing object starts at the first object", "2b 0e 01 7f",
     "2b 0e 01 .. .. .. .. 00.*"),
    (FUNCTIONS, "FC43/14, read code 0", "2b 0e 00 00", "ab 03"),
    (FUNCTIONS, "FC43/14, read code 5", "2b 0e 05 00", "ab 03"),
    (FUNCTIONS, "FC43/14, individual access to a missing object", "2b 0e 04 7f", "ab 02"),
    (FUNCTIONS, "FC43, another MEI type", "2b 10 00 00", "ab 01"),
    (FUNCTIONS, "FC43, truncated", "2b 0e", "ab 03", CLOSE),
]  # fmt: skip

#: Bytes after which the start of the next request is unknown. They are sent after a valid request.
INVALID_HEADERS = [
    ("protocol identifier 1", build_frame(1, 1, b"\x03\0\0\0\1", protocol=1)),
    ("protocol identifier FFFFh", build_frame(1, 1, b"\x03\0\0\0\1", protocol=0xFFFF)),
    ("length 0", build_frame(1, 1, b"\x03\0\0\0\1", length=0)),
    ("length 1", build_frame(1, 1, b"\x03\0\0\0\1", length=1)),
    ("length 255", build_frame(1, 1, b"\x03\0\0\0\1", length=255)),
    ("length 65535", build_frame(1, 1, b"\x03\0\0\0\1", length=65535)),
    ("an HTTP request", b"GET / HTTP/1.1\r\nHost: plc\r\n\r\n"),
    ("a TLS hello", bytes.fromhex("16030100a5010000a10303") + bytes(range(160))),
    ("an SSH banner", b"SSH-2.0-OpenSSH_9.2\r\n"),
    ("a megabyte of FFh", b"\xff" * 1_000_000),
]

#: Cases for the map of this instrument. The instrument is vented before the first case and never inflated.
PNEUFORCE_SINGLE = [
    (QUANTITIES, "a read across the end of a block", "03 007f 0002", "83 02"),
    (QUANTITIES, "a read between the blocks", "03 0080 0001", "83 02"),
    (QUANTITIES, "a read before a block", "03 01ff 0002", "83 02"),
    (QUANTITIES, "quantity comes before address", "03 2710 0000", "83 03"),
    (QUANTITIES, "discrete inputs past 31", "02 001f 0002", "82 02"),
    (QUANTITIES, "there are no coils", "01 0000 0001", "81 02"),
    (QUANTITIES, "a byte too many", "03 0000 0001 00", "83 03"),
    (MAP, "the test pattern", "04 0f00 0005", "04 0a c2f6e666 12345678 cfc7"),
    (MAP, "half of a 32-bit value is read", "03 0001 0001", "03 02 ...."),
    (MAP, "reserved registers read 0", "03 003c 0003", "03 06 000000000000"),
    (MAP, "a read-only register", "06 0000 0000", "86 02"),
    (MAP, "a reserved register", "06 020f 0000", "86 02"),
    (MAP, "a register outside the blocks", "06 2710 0000", "86 02"),
    (MAP, "half of a 32-bit value is written", "06 0200 40a0", "86 03"),
    (MAP, "FC22 on half of a 32-bit value", "16 0200 0000 4100", "96 03"),
    (MAP, "valid FC05: there are no coils", "05 0000 ff00", "85 02"),
    (MAP, "valid FC15: there are no coils", "0f 0000 0001 01 01", "8f 02"),
    (MAP, "FC23: the write is rejected, so nothing is read", "17 0000 0002 0000 0001 02 0000", "97 02"),
    (FUNCTIONS, "FC08/1", "08 0001 0000", "88 01"),
    (FUNCTIONS, "FC08/10", "08 000a 0000", "88 01"),
    (FUNCTIONS, "FC43/14, serial number", "2b 0e 04 80", "2b 0e 04 83 00 00 01 80.*"),
]  # fmt: skip

#: Valid writes before each case of REJECTED_VALUES. The rejected write must not change these values.
_WRITE_OLD_VALUES = (
    ModbusRequest("06 0220 1388", ("06 0220 1388",)),
    ModbusRequest("06 0221 1388", ("06 0221 1388",)),
)
_READ_OLD_VALUES = ModbusRequest("03 0220 0002", ("03 04 1388 1388",))
REJECTED_VALUES = [
    ("setpoint NaN", "10 0200 0002 04 7fc00000", "90 03"),
    ("setpoint +∞", "10 0200 0002 04 7f800000", "90 03"),
    ("setpoint −∞", "10 0200 0002 04 ff800000", "90 03"),
    ("setpoint −1 kPa", "10 0200 0002 04 bf800000", "90 03"),
    ("setpoint 12.01 kPa", "06 0220 2eea", "86 03"),
    ("setpoint 1.999 kPa", "06 0220 07cf", "86 03"),
    ("setpoint 0", "10 0200 0002 04 00000000", "90 03"),
    ("setpoint subnormal", "10 0200 0002 04 00000001", "90 03"),
    ("setpoint “not available”", "06 0220 ffff", "86 03"),
    ("the second of two values is invalid: the first is not written", "10 0220 0002 04 1f40 ffff", "90 03"),
    ("a reserved fourth register: nothing is written", "10 0228 0004 08 0064 07d0 0000 0000", "90 02"),
    ("FC23: the read is rejected, so nothing is written", "17 0080 0001 0220 0001 02 1f40", "97 02"),
    ("an unknown mode", "06 0204 0002", "86 03"),
    ("a lease that is too short", "06 0205 00c7", "86 03"),
    ("a wrong command key", "10 0208 0004 08 5045 0002 0000 0007", "90 03"),
]  # fmt: skip

VENT_REQUESTS = [
    ("FC06", "06 0204 0000", "06 0204 0000"),
    ("FC16", "10 0204 0001 02 0000", "10 0204 0001"),
    ("FC22", "16 0204 fffe 0000", "16 0204 fffe 0000"),
    ("FC23", "17 0019 0001 0204 0001 02 0000", "17 02 ...."),
    ("in a rejected write", "10 0202 0003 06 7fc00000 0000", "90 03"),
]


def _single(rows: list[tuple[str, ...]], needs_pneuforce: bool) -> list[HostileCase]:
    return [
        HostileCase(
            group=group, name=name, steps=(ModbusRequest(pdu, tuple(legal)),), needs_pneuforce=needs_pneuforce
        )
        for group, name, pdu, *legal in rows
    ]


_VALID_REQUEST = PROBE
_INVALID_REQUEST = ModbusRequest("03 0000 0000", ("83 03",))
_UNKNOWN_FUNCTION = ModbusRequest("64 0000 0001", ("e4 01",))
_REQUEST = build_frame(1, 1, b"\x03\0\0\0\1")
_SEGMENT_SIZES = (1, 2, 3, 5, 8, 13, 21, 34)

_STREAMS = [
    ("byte by byte", (Pipelined((_VALID_REQUEST,), (1,), 0.005),)),
    *(
        (f"in two segments, {at} bytes first", (Pipelined((_VALID_REQUEST,), (at, 12), 0.02),))
        for at in range(1, 12, 2)
    ),
    ("ten in one segment", (Pipelined(10 * (_VALID_REQUEST,)),)),
    ("300 in one segment", (Pipelined(300 * (_VALID_REQUEST,)),)),
    ("500 in segments of changing size", (Pipelined(500 * (_VALID_REQUEST,), _SEGMENT_SIZES),)),
    (
        "valid, invalid and valid request in one segment",
        (Pipelined((_VALID_REQUEST, _INVALID_REQUEST, _VALID_REQUEST)),),
    ),
    (
        "valid request, unknown function and valid request in one segment",
        (Pipelined((_VALID_REQUEST, _UNKNOWN_FUNCTION, _VALID_REQUEST)),),
    ),
    (
        "300 in one segment, the middle one invalid",
        (Pipelined((*150 * (_VALID_REQUEST,), _INVALID_REQUEST, *149 * (_VALID_REQUEST,))),),
    ),
    ("one and a half requests, then the rest", (Pipelined((_VALID_REQUEST, _VALID_REQUEST), (18, 6), 0.1),)),
    (
        "three requests with the same transaction number",
        (Pipelined(3 * (ModbusRequest(_VALID_REQUEST.pdu, _VALID_REQUEST.legal, transaction=7),)),),
    ),
    (
        "transaction numbers 0 and FFFFh",
        tuple(ModbusRequest(_VALID_REQUEST.pdu, _VALID_REQUEST.legal, transaction=n) for n in (0, 0xFFFF)),
    ),
]

_ENDS = [
    (
        "half close after a request: answer, then FIN",
        (Pipelined((_VALID_REQUEST,), then_fin=True),),
        ExpectedEnd.FIN,
    ),
    ("half close after 100 requests", (Pipelined(100 * (_VALID_REQUEST,), then_fin=True),), ExpectedEnd.FIN),
    ("half close within a frame", (RawBytes(_REQUEST[:7]), HalfClose()), ExpectedEnd.FIN),
    ("half close at once", (HalfClose(),), ExpectedEnd.FIN),
    ("a header that is never completed", (RawBytes(_REQUEST[:3]),), ExpectedEnd.TIMED_OUT),
    ("a request that is never completed", (RawBytes(_REQUEST[:-1]),), ExpectedEnd.TIMED_OUT),
    (
        "a valid request, then half of a request",
        (_VALID_REQUEST, RawBytes(_REQUEST[:8])),
        ExpectedEnd.TIMED_OUT,
    ),
]

_FUNCTIONS_GENERIC = [
    (CONNECTIONS, "a request that is sent very slowly", many_clients.slow_loris, "closed in time"),
    (CONNECTIONS, "RST within a frame, 50 times", many_clients.resets, "others are answered"),
    (CONNECTIONS, "1200 connections, half of them reset", many_clients.many, "others are answered"),
    (CONNECTIONS, "100 silent connections", many_clients.silent, "the new connection is answered"),
    (CONNECTIONS, "a client that never reads", many_clients.never_reads, "no longer read, closed in time"),
]

_FUNCTIONS_PNEUFORCE = [
    (
        CONNECTIONS,
        "one connection over the limit",
        many_clients.over_the_limit,
        "the new connection stays, the longest silent one is closed",
    ),
    (CONNECTIONS, "an idle connection", many_clients.idle, "closed in time"),
    (MAP, "one read is one instant", many_clients.one_instant, "every copy agrees"),
    (LEASES, "two writers under a lease", lease_cases.two_writers, "06, reason 3; a vent passes"),
    (LEASES, "a writer that disappears", lease_cases.lost_writer, "tripped, bit 14; hold: 06, reason 2"),
]

CASES: tuple[HostileCase, ...] = tuple(
    chain(
        _single(GENERIC_SINGLE, needs_pneuforce=False),
        (
            HostileCase(
                group=HEADERS,
                name=name,
                steps=(_VALID_REQUEST, RawBytes(data)),
                end=ExpectedEnd.CLOSED,
                expected_text="closed at once",
            )
            for name, data in INVALID_HEADERS
        ),
        (
            HostileCase(group=STREAMS, name=name, steps=steps, expected_text="each answered once")
            for name, steps in _STREAMS
        ),
        (
            HostileCase(group=CONNECTIONS, name=n, steps=steps, end=end, expected_text=end.value)
            for n, steps, end in _ENDS
        ),
        (
            HostileCase(group=group, name=name, run=run, expected_text=expected)
            for group, name, run, expected in _FUNCTIONS_GENERIC
        ),
        _single(PNEUFORCE_SINGLE, needs_pneuforce=True),
        (
            HostileCase(
                group=MAP,
                name=f"unit {unit:02X}h",
                steps=(ModbusRequest("03 0000 0001", (legal,), unit),),
                needs_pneuforce=True,
            )
            for unit, legal in ((0, "03 02 ...."), (255, "03 02 ...."), (254, "83 0b"))
        ),
        (
            HostileCase(
                group=VALUES,
                name=n,
                steps=(*_WRITE_OLD_VALUES, ModbusRequest(pdu, (legal,)), _READ_OLD_VALUES),
                needs_pneuforce=True,
                expected_text=legal,
            )
            for n, pdu, legal in REJECTED_VALUES
        ),
        (
            HostileCase(group=VENTS, name=n, steps=(ModbusRequest(pdu, (legal,)),), needs_pneuforce=True)
            for n, pdu, legal in VENT_REQUESTS
        ),
        (
            HostileCase(group=g, name=name, run=run, needs_pneuforce=True, expected_text=expected)
            for g, name, run, expected in _FUNCTIONS_PNEUFORCE
        ),
    )
)
