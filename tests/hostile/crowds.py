"""Cases that one connection cannot show: many clients, slow ones, and one that never reads."""

from __future__ import annotations

import select
import struct
import time
from contextlib import ExitStack, suppress

from tests.hostile.case import Ask, Wrong, framed
from tests.hostile.line import Line, Server, answering

_LONG_READ = bytes.fromhex("03 0000 007d")
_LONG_REQUEST = framed(1, 1, bytes.fromhex("10 0000 0064 c8") + bytes(200))
_MOST_TAKEN = 4_000_000  #: bytes of requests; their answers would be 80 MB
_LONGEST_FLOOD_S = 10.0


def slow_loris(server: Server) -> str:
    """A frame that never ends, though it grows all the time."""
    begun_s = time.monotonic()
    limit_s = server.frame_s + max(server.patience_s, server.frame_s)
    with Line(server) as line:
        for byte in _LONG_REQUEST[:-1]:
            line.send(bytes((byte,)))
            if line.readable(limit_s / 150):
                line.wait_closed(server.patience_s)
                return f"closed after {time.monotonic() - begun_s:.1f} s"
            if time.monotonic() - begun_s > limit_s:
                break
    raise Wrong(f"still open after {limit_s:.0f} s")


def resets(server: Server) -> str:
    """Clients that vanish within a frame; one that stays is answered all the time."""
    with Line(server) as stays:
        for at in range(50):
            line = Line(server)
            line.send(framed(1, server.unit, b"\x03\0\0\0\1")[: at % 12])
            line.reset()
            answering(server, stays)
    return "others are answered"


def many(server: Server) -> str:
    """More connections than a process may have descriptors, one after the other."""
    for at in range(1200):
        line = Line(server)
        line.send(framed(1, server.unit, b"\x03\0\0\0\1")[: at % 12])
        line.reset() if at % 2 else line.socket.close()
    return "others are answered"


def silent(server: Server) -> str:
    """Connections that say nothing keep nobody out."""
    with ExitStack() as held:
        for _ in range(100):
            held.enter_context(Line(server))
        answering(server)
    return "the newcomer is answered"


def never_reads(server: Server) -> str:
    """Requests without end, whose answers nobody reads: others are answered, what is taken in has an end."""
    with Line(server, SO_SNDBUF=16384, SO_RCVBUF=4096) as deaf, Line(server) as other:
        told = _flood(server, deaf, other)
        begun_s = time.monotonic()
        while not _hung_up(deaf):
            answering(server, other)
            if time.monotonic() - begun_s > server.frame_s + max(server.patience_s, server.frame_s):
                raise Wrong(f"{told}, but never closed")
            time.sleep(0.05)
    return f"{told}, closed"


def _flood(server: Server, deaf: Line, other: Line) -> str:
    requests = b"".join(framed(i, server.unit, _LONG_READ) for i in range(100))
    deaf.socket.setblocking(False)
    begun_s = moved_s = time.monotonic()
    taken = 0
    while (now_s := time.monotonic()) - moved_s < min(1.0, server.frame_s) and not _hung_up(deaf):
        with suppress(OSError):
            taken += deaf.socket.send(requests[taken % len(requests) :])
            moved_s = now_s
        answering(server, other)
        if taken > _MOST_TAKEN or now_s - begun_s > _LONGEST_FLOOD_S:
            raise Wrong(f"took {taken // 1000} kB of requests in {now_s - begun_s:.0f} s, and goes on")
    return f"took {taken // 1000} kB of requests"


def _hung_up(line: Line) -> bool:
    poll = select.poll()
    poll.register(line.socket, select.POLLRDHUP)
    return any(event & (select.POLLRDHUP | select.POLLHUP | select.POLLERR) for _, event in poll.poll(0))


def over_the_limit(server: Server) -> str:
    """One more than the limit, of one address: the newcomer stays, the one silent for longest goes."""
    with ExitStack() as held:
        lines = [held.enter_context(Line(server)) for _ in range(server.connections + 1)]
        for line in lines[-3:]:
            answering(server, line)
        return lines[0].wait_closed(server.patience_s)


def idle(server: Server) -> str:
    """A connection that says nothing is closed in its time."""
    with Line(server) as line:
        return line.wait_closed(server.idle_s + max(2.0, server.patience_s))


_ALL = Ask("04 0000 004a", ("04 94 .*",))
_FLOATS = ((0, 64), (4, 66), (18, 70))  #: force, pressure and peak: address in N or kPa, and in mN or Pa


def one_instant(server: Server) -> str:
    """In each of 300 answers the scaled mirror agrees with the values, and the counter never goes back."""
    counter, samples = -1, set()
    with Line(server) as line:
        for _ in range(300):
            line.ask(_ALL)
            words = bytes.fromhex(line.answer(server.patience_s)[2])[2:]
            _agree(words)
            samples.add(int.from_bytes(words[44:48], "big"))
            if max(samples) < counter:
                raise Wrong("the sample counter goes back")
            counter = max(samples)
    return f"{len(samples)} samples, every mirror agrees"


def _agree(words: bytes) -> None:
    for value_at, scaled_at in _FLOATS:
        (value,) = struct.unpack_from(">f", words, 2 * value_at)
        (scaled,) = struct.unpack_from(">h", words, 2 * scaled_at)
        if abs(scaled - value * 1000) > 1 if value == value else scaled != 0x7FFF:
            raise Wrong(f"register {value_at} is {value}, register {scaled_at} is {scaled}")
    if words[40:44] != words[146:148] + words[144:146]:
        raise Wrong("two registers show two statuses")
