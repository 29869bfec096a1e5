"""Cases with many clients, slow clients, and clients that never read."""

from __future__ import annotations

import math
import select
import struct
import time
from contextlib import ExitStack, suppress

from tests.hostile.case import CaseFailure, ModbusRequest, build_frame
from tests.hostile.connection import RawConnection, ServerUnderTest, check_answers

_LONG_READ = bytes.fromhex("03 0000 007d")
_LONG_REQUEST = build_frame(1, 1, bytes.fromhex("10 0000 0064 c8") + bytes(200))
_MAX_REQUEST_BYTES = 4_000_000  #: limit of a flood; the answers to so many requests have 80 MB
_MAX_FLOOD_S = 10.0


def slow_loris(server: ServerUnderTest) -> str:
    """Send a frame byte by byte without ever completing it."""
    start_s = time.monotonic()
    limit_s = server.frame_timeout_s + max(server.answer_timeout_s, server.frame_timeout_s)
    with RawConnection(server) as connection:
        for byte in _LONG_REQUEST[:-1]:
            connection.send(bytes((byte,)))
            if connection.is_readable(limit_s / 150):
                connection.wait_closed(server.answer_timeout_s)
                return f"closed after {time.monotonic() - start_s:.1f} s"
            if time.monotonic() - start_s > limit_s:
                break
    raise CaseFailure(f"still open after {limit_s:.0f} s")


def resets(server: ServerUnderTest) -> str:
    """Reset 50 connections in the middle of a frame. Requests on another connection must be answered."""
    with RawConnection(server) as permanent:
        for at in range(50):
            connection = RawConnection(server)
            connection.send(build_frame(1, server.unit, b"\x03\0\0\0\1")[: at % 12])
            connection.reset()
            check_answers(server, permanent)
    return "others are answered"


def many(server: ServerUnderTest) -> str:
    """Open more connections, one after the other, than a process may have open files."""
    for at in range(1200):
        connection = RawConnection(server)
        connection.send(build_frame(1, server.unit, b"\x03\0\0\0\1")[: at % 12])
        connection.reset() if at % 2 else connection.socket.close()
    return "others are answered"


def silent(server: ServerUnderTest) -> str:
    """Open 100 connections that send nothing. A request on a new connection must be answered."""
    with ExitStack() as held:
        for _ in range(100):
            held.enter_context(RawConnection(server))
        check_answers(server)
    return "the new connection is answered"


def never_reads(server: ServerUnderTest) -> str:
    """Send requests without reading the answers.

    The server must stop reading these requests, close the connection, and answer other clients.
    """
    with (
        RawConnection(server, SO_SNDBUF=16384, SO_RCVBUF=4096) as not_reading,
        RawConnection(server) as other,
    ):
        result = _flood(server, not_reading, other)
        start_s = time.monotonic()
        limit_s = server.frame_timeout_s + max(server.answer_timeout_s, server.frame_timeout_s)
        while not _is_closed(not_reading):
            check_answers(server, other)
            if time.monotonic() - start_s > limit_s:
                raise CaseFailure(f"{result}, but never closed")
            time.sleep(0.05)
    return f"{result}, closed"


def _flood(server: ServerUnderTest, not_reading: RawConnection, other: RawConnection) -> str:
    requests = b"".join(build_frame(i, server.unit, _LONG_READ) for i in range(100))
    not_reading.socket.setblocking(False)
    start_s = last_sent_s = time.monotonic()
    accepted = 0
    stalled_s = min(1.0, server.frame_timeout_s)
    while (now_s := time.monotonic()) - last_sent_s < stalled_s and not _is_closed(not_reading):
        with suppress(OSError):
            accepted += not_reading.socket.send(requests[accepted % len(requests) :])
            last_sent_s = now_s
        check_answers(server, other)
        if accepted > _MAX_REQUEST_BYTES or now_s - start_s > _MAX_FLOOD_S:
            raise CaseFailure(
                f"took {accepted // 1000} kB of requests in {now_s - start_s:.0f} s, and goes on"
            )
    return f"took {accepted // 1000} kB of requests"


def _is_closed(connection: RawConnection) -> bool:
    poll = select.poll()
    poll.register(connection.socket, select.POLLRDHUP)
    closed = select.POLLRDHUP | select.POLLHUP | select.POLLERR
    return any(event & closed for _, event in poll.poll(0))


def over_the_limit(server: ServerUnderTest) -> str:
    """Open one connection more than the limit. The connection that was silent for longest must be closed."""
    with ExitStack() as held:
        connections = [held.enter_context(RawConnection(server)) for _ in range(server.max_connections + 1)]
        for connection in connections[-3:]:
            check_answers(server, connection)
        return connections[0].wait_closed(server.answer_timeout_s)


def idle(server: ServerUnderTest) -> str:
    """Open a connection that sends nothing. The server must close this connection in time."""
    with RawConnection(server) as connection:
        return connection.wait_closed(server.idle_timeout_s + max(2.0, server.answer_timeout_s))


_ALL = ModbusRequest("04 0000 004a", ("04 94 .*",))
#: Force, pressure and peak force: address of the value in N or kPa, and of the copy in mN or Pa.
_COPIES = ((0, 64), (4, 66), (18, 70))


def one_instant(server: ServerUnderTest) -> str:
    """Read 300 times. Scaled copies must agree with the values; the sample counter must not decrease."""
    counter, samples = -1, set()
    with RawConnection(server) as connection:
        for _ in range(300):
            connection.send_request(_ALL)
            words = bytes.fromhex(connection.read_answer(server.answer_timeout_s)[2])[2:]
            _check_copies(words)
            samples.add(int.from_bytes(words[44:48], "big"))
            if max(samples) < counter:
                raise CaseFailure("the sample counter decreases")
            counter = max(samples)
    return f"{len(samples)} samples, every copy agrees"


def _check_copies(words: bytes) -> None:
    for value_at, copy_at in _COPIES:
        (value,) = struct.unpack_from(">f", words, 2 * value_at)
        (copy,) = struct.unpack_from(">h", words, 2 * copy_at)
        if copy != 0x7FFF if math.isnan(value) else abs(copy - value * 1000) > 1:
            raise CaseFailure(f"register {value_at} is {value}, register {copy_at} is {copy}")
    if words[40:44] != words[146:148] + words[144:146]:
        raise CaseFailure("registers 20 and 72 show different statuses")
