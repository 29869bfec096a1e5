"""Leases: two writers, told apart by their addresses, and one that disappears."""

from __future__ import annotations

import time
from collections.abc import Callable

from tests.hostile.case import NotOffered, Wrong
from tests.hostile.line import Line, Server, spaced

_NEIGHBOUR = "127.0.0.2"
_VENT = "06 0204 0000"
_TRIPPED, _LEASE_EXPIRED, _DONE = 6, 1 << 14, 2


def two_writers(server: Server) -> str:
    """The holder writes; another one is refused and told why, and may vent all the same."""
    if not server.host.startswith("127."):
        raise NotOffered("needs an instrument on this machine")
    with Line(server) as holder, Line(server, _NEIGHBOUR) as other:
        _must(holder, _VENT, _VENT)
        _must(holder, "06 0205 1388", "06 0205 1388")
        _must(holder, "06 0220 1388", "06 0220 1388")
        _must(other, "06 0220 1770", "86 06")
        _must(other, "03 001b 0001", "03 02 0003")
        _must(holder, "03 001b 0001", "03 02 0000")
        _must(holder, "03 0220 0001", "03 02 1388")
        _must(other, _VENT, _VENT)
        _must(other, "10 0204 0002 04 0000 0000", "90 06")
        _must(holder, "06 0205 0000", "06 0205 0000")
        _must(other, "06 0220 1770", "06 0220 1770")
    return "06, reason 3; a vent passes"


def lost_writer(server: Server) -> str:
    """The lease of a writer that disappears runs out: the rig trips, says so, and is not inflated again."""
    with Line(server) as writer:
        _must(writer, _VENT, _VENT)
        _must(writer, "06 0205 00c8", "06 0205 00c8")
        writer.reset()
    with Line(server) as line:
        try:
            _wait(lambda: _word(line, 72) & _LEASE_EXPIRED != 0, "told by status bit 14")
            if _word(line, 25) != _TRIPPED:
                raise Wrong("status bit 14 is set, but it is not tripped")
            _must(line, "06 0204 0001", "86 06")
            _must(line, "03 001b 0001", "03 02 0002")
        finally:
            _clear(line)
    return "tripped, bit 14; hold: 06, reason 2"


def _clear(line: Line) -> None:
    """Clear the faults, with a sequence number that is new, and leave the rig vented."""
    sequence = _word(line, 524) + 1 & 0xFFFF
    line.said(f"10 0208 0004 08 5046 0002 0000 {sequence:04x}")
    _wait(lambda: (_word(line, 524), _word(line, 525)) == (sequence, _DONE), "cleared")
    _must(line, _VENT, _VENT)
    _must(line, "06 0205 0000", "06 0205 0000")


def _must(line: Line, pdu: str, wanted: str) -> None:
    got = line.said(pdu)
    if got != wanted.replace(" ", ""):
        raise Wrong(f"{pdu} is answered {spaced(got)}, not {wanted}")


def _word(line: Line, address: int) -> int:
    got = line.said(f"03 {address:04x} 0001")
    if not got.startswith("0302"):
        raise Wrong(f"register {address} is answered {spaced(got)}")
    return int(got[4:], 16)


def _wait(fact: Callable[[], bool], told: str) -> None:
    until_s = time.monotonic() + 5.0
    while not fact():
        if time.monotonic() > until_s:
            raise Wrong(f"not {told} within 5 s")
        time.sleep(0.02)
