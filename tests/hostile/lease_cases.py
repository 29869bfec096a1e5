"""Cases about leases: two writers with different addresses, and a writer that disappears."""

from __future__ import annotations

import time
from collections.abc import Callable

from tests.hostile.case import CaseFailure, NotSupported
from tests.hostile.connection import RawConnection, ServerUnderTest, spaced

_OTHER_ADDRESS = "127.0.0.2"
_VENT = "06 0204 0000"
_TRIPPED, _LEASE_EXPIRED, _DONE = 6, 1 << 14, 2


def two_writers(server: ServerUnderTest) -> str:
    """Write as lease holder and as another peer.

    The writes of the other peer must be rejected with a reason, except a vent.
    """
    if not server.host.startswith("127."):
        raise NotSupported("needs an instrument on this machine")
    with RawConnection(server) as holder, RawConnection(server, _OTHER_ADDRESS) as other:
        _expect_answer(holder, _VENT, _VENT)
        _expect_answer(holder, "06 0205 1388", "06 0205 1388")
        _expect_answer(holder, "06 0220 1388", "06 0220 1388")
        _expect_answer(other, "06 0220 1770", "86 06")
        _expect_answer(other, "03 001b 0001", "03 02 0003")
        _expect_answer(holder, "03 001b 0001", "03 02 0000")
        _expect_answer(holder, "03 0220 0001", "03 02 1388")
        _expect_answer(other, _VENT, _VENT)
        _expect_answer(other, "10 0204 0002 04 0000 0000", "90 06")
        _expect_answer(holder, "06 0205 0000", "06 0205 0000")
        _expect_answer(other, "06 0220 1770", "06 0220 1770")
    return "06, reason 3; a vent passes"


def lost_writer(server: ServerUnderTest) -> str:
    """Let a lease expire. The rig must trip, show the reason, and reject a new inflation."""
    with RawConnection(server) as writer:
        _expect_answer(writer, _VENT, _VENT)
        _expect_answer(writer, "06 0205 00c8", "06 0205 00c8")
        writer.reset()
    with RawConnection(server) as connection:
        try:
            _wait(lambda: _word(connection, 72) & _LEASE_EXPIRED != 0, "status bit 14 is not set")
            if _word(connection, 25) != _TRIPPED:
                raise CaseFailure("status bit 14 is set, but the rig is not tripped")
            _expect_answer(connection, "06 0204 0001", "86 06")
            _expect_answer(connection, "03 001b 0001", "03 02 0002")
        finally:
            _clear(connection)
    return "tripped, bit 14; hold: 06, reason 2"


def _clear(connection: RawConnection) -> None:
    """Clear the faults with a new sequence number, and leave the rig vented."""
    sequence = _word(connection, 524) + 1 & 0xFFFF
    connection.request(f"10 0208 0004 08 5046 0002 0000 {sequence:04x}")
    _wait(
        lambda: (_word(connection, 524), _word(connection, 525)) == (sequence, _DONE),
        "the faults are not cleared",
    )
    _expect_answer(connection, _VENT, _VENT)
    _expect_answer(connection, "06 0205 0000", "06 0205 0000")


def _expect_answer(connection: RawConnection, pdu: str, expected: str) -> None:
    got = connection.request(pdu)
    if got != expected.replace(" ", ""):
        raise CaseFailure(f"{pdu} is answered {spaced(got)}, not {expected}")


def _word(connection: RawConnection, address: int) -> int:
    got = connection.request(f"03 {address:04x} 0001")
    if not got.startswith("0302"):
        raise CaseFailure(f"register {address} is answered {spaced(got)}")
    return int(got[4:], 16)


def _wait(condition: Callable[[], bool], failure: str) -> None:
    until_s = time.monotonic() + 5.0
    while not condition():
        if time.monotonic() > until_s:
            raise CaseFailure(f"{failure} within 5 s")
        time.sleep(0.02)
