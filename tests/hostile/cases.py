"""Every hostile case, as data: what any Modbus TCP server must stand, then this instrument's map.

Sources: MODBUS Application Protocol Specification V1.1b3; MODBUS Messaging on TCP/IP Implementation Guide
V1.0b. That a connection is closed in time is this instrument's rule.
"""

from __future__ import annotations

from itertools import chain

from tests.hostile import crowds, writers
from tests.hostile.case import CLOSE, Ask, Case, End, HalfClose, Raw, Together, framed
from tests.hostile.line import PROBE

QUANTITIES, WRITES, FUNCTIONS, HEADERS, STREAMS, CONNECTIONS = (
    "quantities and addresses",
    "writes in bad form",
    "functions",
    "headers",
    "streams",
    "connections",
)
VALUES, MAP, VENTS, LEASES = "values", "map", "vents", "leases"

#: One request on a fresh connection, which then goes on: group, name, request, legal answers.
SINGLE = [
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
    (QUANTITIES, "FC03 cut short", "03 0000", "83 03", CLOSE),
    (QUANTITIES, "FC03, the function alone", "03", "83 03", CLOSE),
    (WRITES, "FC16, byte count below twice the quantity", "10 0000 0002 02 0000", "90 03"),
    (WRITES, "FC16, odd byte count", "10 0000 0002 03 000000", "90 03"),
    (WRITES, "FC16, byte count above twice the quantity", "10 0000 0001 04 00000000", "90 03"),
    (WRITES, "FC16, no register", "10 0000 0000 00", "90 03"),
    (WRITES, "FC16, 124 registers", "10 0000 007c f7" + 247 * "00", "90 03"),
    (WRITES, "FC16, 32768 registers", "10 0000 8000 00", "90 03"),
    (WRITES, "FC16, data shorter than its count", "10 0000 0002 04 0000", "90 03", CLOSE),
    (WRITES, "FC16, no data at all", "10 0000 0002", "90 03", CLOSE),
    (WRITES, "FC16 past 65535", "10 ffff 0002 04 00000000", "90 02"),
    (WRITES, "FC06 cut short", "06 0000", "86 03", CLOSE),
    (WRITES, "FC05, value 0001h", "05 0000 0001", "85 03"),
    (WRITES, "FC05, value FFFFh", "05 0000 ffff", "85 03"),
    (WRITES, "FC05, value 00FFh", "05 0000 00ff", "85 03"),
    (WRITES, "FC15, no coil", "0f 0000 0000 00", "8f 03"),
    (WRITES, "FC15, 1969 coils", "0f 0000 07b1 f7" + 247 * "00", "8f 03"),
    (WRITES, "FC15, byte count too small", "0f 0000 000a 01 00", "8f 03"),
    (WRITES, "FC15 past 65535", "0f ffff 0002 01 00", "8f 02"),
    (WRITES, "FC22 cut short", "16 0000 ffff", "96 03", CLOSE),
    (WRITES, "FC23, reads none", "17 0000 0000 0000 0001 02 0000", "97 03"),
    (WRITES, "FC23, reads 126", "17 0000 007e 0000 0001 02 0000", "97 03"),
    (WRITES, "FC23, writes none", "17 0000 0001 0000 0000 00", "97 03"),
    (WRITES, "FC23, writes 122", "17 0000 0001 0000 007a f3" + 243 * "00", "97 03"),
    (WRITES, "FC23, wrong byte count", "17 0000 0001 0000 0002 02 0000", "97 03"),
    (WRITES, "FC23, reads past 65535", "17 ffff 0002 0000 0001 02 0000", "97 02"),
    (WRITES, "FC23, writes past 65535", "17 0000 0001 ffff 0002 04 00000000", "97 02"),
    (WRITES, "FC23 writes before it reads", "17 0000 0001 0000 0001 02 2b67", "17 02 2b67", "97 02"),
    (FUNCTIONS, "function 0", "00 0000 0001", "80 01", CLOSE),
    (FUNCTIONS, "function 09h", "09 0000 0001", "89 01"),
    (FUNCTIONS, "function 48h", "48 0000 0001", "c8 01"),
    (FUNCTIONS, "function 64h", "64 0000 0001", "e4 01"),
    (FUNCTIONS, "function 7Fh, alone", "7f", "ff 01"),
    (FUNCTIONS, "function 80h", "80 0000 0001", CLOSE, "80 01"),
    (FUNCTIONS, "function 83h, an exception's", "83 0000 0001", CLOSE, "83 01"),
    (FUNCTIONS, "function FFh", "ff 0000 0001", CLOSE, "ff 01"),
    (FUNCTIONS, "FC08/0 echoes", "08 0000 a537", "08 0000 a537"),
    (FUNCTIONS, "FC08, sub-function FFFFh", "08 ffff 0000", "88 0[13]"),
    (FUNCTIONS, "FC08 cut short", "08 00", "88 03", CLOSE),
    (FUNCTIONS, "FC43/14, basic objects", "2b 0e 01 00", "2b 0e 01 .. .. .. .. 00.*"),
    (FUNCTIONS, "FC43/14, a stream from an absent object begins anew", "2b 0e 01 7f",
     "2b 0e 01 .. .. .. .. 00.*"),
    (FUNCTIONS, "FC43/14, read code 0", "2b 0e 00 00", "ab 03"),
    (FUNCTIONS, "FC43/14, read code 5", "2b 0e 05 00", "ab 03"),
    (FUNCTIONS, "FC43/14, absent object alone", "2b 0e 04 7f", "ab 02"),
    (FUNCTIONS, "FC43, another MEI type", "2b 10 00 00", "ab 01"),
    (FUNCTIONS, "FC43 cut short", "2b 0e", "ab 03", CLOSE),
]  # fmt: skip

#: Bytes behind which no request can be found any more: what follows a good request on the connection.
NO_MODBUS = [
    ("protocol identifier 1", framed(1, 1, b"\x03\0\0\0\1", protocol=1)),
    ("protocol identifier FFFFh", framed(1, 1, b"\x03\0\0\0\1", protocol=0xFFFF)),
    ("length 0", framed(1, 1, b"\x03\0\0\0\1", length=0)),
    ("length 1", framed(1, 1, b"\x03\0\0\0\1", length=1)),
    ("length 255", framed(1, 1, b"\x03\0\0\0\1", length=255)),
    ("length 65535", framed(1, 1, b"\x03\0\0\0\1", length=65535)),
    ("an HTTP request", b"GET / HTTP/1.1\r\nHost: plc\r\n\r\n"),
    ("a TLS hello", bytes.fromhex("16030100a5010000a10303") + bytes(range(160))),
    ("an SSH banner", b"SSH-2.0-OpenSSH_9.2\r\n"),
    ("a megabyte of FFh", b"\xff" * 1_000_000),
]

#: Of this instrument's map; it is vented when they begin, and nothing in them inflates it.
OWN = [
    (QUANTITIES, "a read that leaves its block", "03 007f 0002", "83 02"),
    (QUANTITIES, "a read between the blocks", "03 0080 0001", "83 02"),
    (QUANTITIES, "a read before a block", "03 01ff 0002", "83 02"),
    (QUANTITIES, "quantity comes before address", "03 2710 0000", "83 03"),
    (QUANTITIES, "discrete inputs past 31", "02 001f 0002", "82 02"),
    (QUANTITIES, "there are no coils", "01 0000 0001", "81 02"),
    (QUANTITIES, "a byte too many", "03 0000 0001 00", "83 03"),
    (MAP, "the test pattern", "04 0f00 0005", "04 0a c2f6e666 12345678 cfc7"),
    (MAP, "half of a 32-bit value is read", "03 0001 0001", "03 02 ...."),
    (MAP, "reserved registers read 0", "03 0024 0003", "03 06 000000000000"),
    (MAP, "a read-only register", "06 0000 0000", "86 02"),
    (MAP, "a reserved register", "06 020f 0000", "86 02"),
    (MAP, "a register of no block", "06 2710 0000", "86 02"),
    (MAP, "half of a 32-bit value is written", "06 0200 40a0", "86 03"),
    (MAP, "FC22 on half of a 32-bit value", "16 0200 0000 4100", "96 03"),
    (MAP, "FC05 in good form: there are no coils", "05 0000 ff00", "85 02"),
    (MAP, "FC15 in good form: there are no coils", "0f 0000 0001 01 01", "8f 02"),
    (MAP, "FC23: a refused write, so nothing is read", "17 0000 0002 0000 0001 02 0000", "97 02"),
    (FUNCTIONS, "FC08/1", "08 0001 0000", "88 01"),
    (FUNCTIONS, "FC08/10", "08 000a 0000", "88 01"),
    (FUNCTIONS, "FC43/14, serial number", "2b 0e 04 80", "2b 0e 04 83 00 00 01 80.*"),
]  # fmt: skip

#: A setpoint, or another value, that is not taken: the one that stands before stands after.
_STANDS = (Ask("06 0220 1388", ("06 0220 1388",)), Ask("06 0221 1388", ("06 0221 1388",)))
_STILL = Ask("03 0220 0002", ("03 04 1388 1388",))
BAD_VALUES = [
    ("setpoint NaN", "10 0200 0002 04 7fc00000", "90 03"),
    ("setpoint +∞", "10 0200 0002 04 7f800000", "90 03"),
    ("setpoint −∞", "10 0200 0002 04 ff800000", "90 03"),
    ("setpoint −1 kPa", "10 0200 0002 04 bf800000", "90 03"),
    ("setpoint 12.01 kPa", "06 0220 2eea", "86 03"),
    ("setpoint 1.999 kPa", "06 0220 07cf", "86 03"),
    ("setpoint 0", "10 0200 0002 04 00000000", "90 03"),
    ("setpoint subnormal", "10 0200 0002 04 00000001", "90 03"),
    ("setpoint “not available”", "06 0220 ffff", "86 03"),
    ("the second value of two is bad: nothing of the first", "10 0220 0002 04 1f40 ffff", "90 03"),
    ("the third register is read-only: nothing of the first two", "10 0220 0003 06 1f40 07d0 0000", "90 02"),
    ("FC23 whose read is refused writes nothing", "17 0080 0001 0220 0001 02 1f40", "97 02"),
    ("an unknown mode", "06 0204 0002", "86 03"),
    ("a lease too short", "06 0205 00c7", "86 03"),
    ("a wrong command key", "10 0208 0004 08 5045 0002 0000 0007", "90 03"),
]  # fmt: skip

VENTED = [
    ("FC06", "06 0204 0000", "06 0204 0000"),
    ("FC16", "10 0204 0001 02 0000", "10 0204 0001"),
    ("FC22", "16 0204 fffe 0000", "16 0204 fffe 0000"),
    ("FC23", "17 0019 0001 0204 0001 02 0000", "17 02 ...."),
    ("among words that are refused", "10 0202 0003 06 7fc00000 0000", "90 03"),
]


def _single(rows: list[tuple[str, ...]], ours: bool) -> list[Case]:
    return [
        Case(group=group, name=name, steps=(Ask(pdu, tuple(legal)),), ours=ours)
        for group, name, pdu, *legal in rows
    ]


_GOOD = PROBE
_BAD = Ask("03 0000 0000", ("83 03",))
_UNKNOWN = Ask("64 0000 0001", ("e4 01",))
_REQUEST = framed(1, 1, b"\x03\0\0\0\1")
_SHREDS = (1, 2, 3, 5, 8, 13, 21, 34)

_STREAMS = [
    ("byte by byte", (Together((_GOOD,), (1,), 0.005),)),
    *(
        (f"in two segments, {at} bytes first", (Together((_GOOD,), (at, 12), 0.02),))
        for at in range(1, 12, 2)
    ),
    ("ten in one segment", (Together(10 * (_GOOD,)),)),
    ("300 in one segment", (Together(300 * (_GOOD,)),)),
    ("500 in pieces of changing size", (Together(500 * (_GOOD,), _SHREDS),)),
    ("a good, a bad and a good one in one segment", (Together((_GOOD, _BAD, _GOOD)),)),
    ("a good, an unknown and a good one in one segment", (Together((_GOOD, _UNKNOWN, _GOOD)),)),
    ("300 in one segment, the middle one bad", (Together((*150 * (_GOOD,), _BAD, *149 * (_GOOD,))),)),
    ("one and a half, then the rest", (Together((_GOOD, _GOOD), (18, 6), 0.1),)),
    (
        "one transaction number thrice",
        (Together(3 * (Ask(_GOOD.pdu, _GOOD.legal, number=7),)),),
    ),
    ("transaction numbers 0 and FFFFh", tuple(Ask(_GOOD.pdu, _GOOD.legal, number=n) for n in (0, 0xFFFF))),
]

_ENDS = [
    ("half close behind a request: its answer, then FIN", (Together((_GOOD,), then_fin=True),), End.FIN),
    ("half close behind 100 requests", (Together(100 * (_GOOD,), then_fin=True),), End.FIN),
    ("half close within a frame", (Raw(_REQUEST[:7]), HalfClose()), End.FIN),
    ("half close at once", (HalfClose(),), End.FIN),
    ("a header that is never finished", (Raw(_REQUEST[:3]),), End.OVERDUE),
    ("a request that is never finished", (Raw(_REQUEST[:-1]),), End.OVERDUE),
    ("a good request, then half of one for ever", (_GOOD, Raw(_REQUEST[:8])), End.OVERDUE),
]

_PLAYS = [
    (CONNECTIONS, "a request that grows by a byte now and then", crowds.slow_loris, "closed in time"),
    (CONNECTIONS, "RST within a frame, 50 times", crowds.resets, "others are answered"),
    (CONNECTIONS, "1200 connections, half of them reset", crowds.many, "others are answered"),
    (CONNECTIONS, "100 silent connections", crowds.silent, "the newcomer is answered"),
    (CONNECTIONS, "a client that never reads", crowds.never_reads, "read no further, closed in time"),
]

_OWN_PLAYS = [
    (
        CONNECTIONS,
        "one connection over the limit",
        crowds.over_the_limit,
        "the newcomer stays, the idlest goes",
    ),
    (CONNECTIONS, "a connection that says nothing", crowds.idle, "closed in time"),
    (MAP, "one read is one instant", crowds.one_instant, "every mirror agrees"),
    (LEASES, "two writers under a lease", writers.two_writers, "06, reason 3; a vent passes"),
    (LEASES, "a writer that disappears", writers.lost_writer, "tripped, bit 14; hold: 06, reason 2"),
]

CASES: tuple[Case, ...] = tuple(
    chain(
        _single(SINGLE, ours=False),
        (
            Case(group=HEADERS, name=name, steps=(_GOOD, Raw(data)), end=End.CLOSED, wanted="closed at once")
            for name, data in NO_MODBUS
        ),
        (
            Case(group=STREAMS, name=name, steps=steps, wanted="each answered once")
            for name, steps in _STREAMS
        ),
        (Case(group=CONNECTIONS, name=n, steps=steps, end=end, wanted=end.value) for n, steps, end in _ENDS),
        (Case(group=group, name=name, play=play, wanted=want) for group, name, play, want in _PLAYS),
        _single(OWN, ours=True),
        (
            Case(group=MAP, name=f"unit {unit:02X}h", steps=(Ask("03 0000 0001", (legal,), unit),), ours=True)
            for unit, legal in ((0, "03 02 ...."), (255, "03 02 ...."), (254, "83 0b"))
        ),
        (
            Case(group=VALUES, name=n, steps=(*_STANDS, Ask(pdu, (legal,)), _STILL), ours=True, wanted=legal)
            for n, pdu, legal in BAD_VALUES
        ),
        (Case(group=VENTS, name=n, steps=(Ask(pdu, (legal,)),), ours=True) for n, pdu, legal in VENTED),
        (Case(group=g, name=name, play=play, ours=True, wanted=want) for g, name, play, want in _OWN_PLAYS),
    )
)
