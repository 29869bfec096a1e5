"""What systemd is told by datagrams: that the instrument serves, that its loop goes round, what it does.

The protocol: sd_notify(3), systemd.service(5) on WatchdogSec. Without $NOTIFY_SOCKET nobody is told.
"""

from __future__ import annotations

import math
import os
import socket
from collections.abc import Callable, Mapping
from contextlib import suppress

from instrument.faults import name_of
from registers.source import Peer, Source

Tell = Callable[[str], bool]  #: whether it was taken

BEATS_PER_WATCH = 4  #: so that a datagram lost, or a beat that came late, is no reason to be ended
STATUS_S = 0.5
OWN = Peer("service")


class ServiceFace:
    """A face of the host, so that the watchdog hears of the loop's own beats and of no other thread's."""

    def __init__(self, source: Source, tell: Tell, watch_s: float) -> None:
        """`watch_s` is the silence [s] after which systemd would end this process; inf: it does not watch."""
        self._source = source
        self._tell = tell
        self._watch_s = watch_s
        self._serving = self._ready_heard = False
        self._due_s = -math.inf
        self._status = ""

    def ready(self) -> None:
        """The buses are served."""
        self._serving = True
        self._ready_heard = self._tell("READY=1")

    def stopping(self) -> None:
        """It vents and ends."""
        self._serving = False
        self._tell("STOPPING=1\nSTATUS=venting, then ending")

    def on_sample(self, now_s: float) -> None:
        """Nothing: a rig that is silent is no reason to begin anew."""

    def tick(self, now_s: float) -> None:
        """Say that the loop goes round, and what has changed."""
        if not self._serving or now_s < self._due_s:
            return
        self._due_s = now_s + min(self._watch_s / BEATS_PER_WATCH, STATUS_S)
        status = status_of(self._source, now_s)
        news = {
            "READY=1": not self._ready_heard,
            "WATCHDOG=1": math.isfinite(self._watch_s),
            f"STATUS={status}": status != self._status,
        }
        said = [line for line, new in news.items() if new]
        if said and self._tell("\n".join(said)):
            self._ready_heard, self._status = True, status


def status_of(source: Source, now_s: float) -> str:
    """What the instrument does, and its faults, in words."""
    seen = source.snapshot(OWN, now_s)
    state = "no word from the board" if "link_lost" in seen.status else seen.state
    return ": ".join([state, *filter(None, [", ".join(map(name_of, seen.faults))])])


def service_face(source: Source, environment: Mapping[str, str] = os.environ) -> ServiceFace:
    """The face of a process that systemd started, or of one that it did not: that tells nobody."""
    return ServiceFace(source, tell_to(environment.get("NOTIFY_SOCKET", "")), watch_s_of(environment))


def watch_s_of(environment: Mapping[str, str]) -> float:
    """The silence [s] after which this process is ended, inf where it is not watched."""
    watched = environment.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
    us = environment.get("WATCHDOG_USEC", "")
    return int(us) / 1e6 if watched and us.isdecimal() and int(us) else math.inf


def tell_to(address: str) -> Tell:
    """Sends to a socket, or nowhere; never waits: a busy systemd must not hold up a sample."""
    if not address.startswith(("/", "@")):
        return lambda _: True
    sender = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
    sender.setblocking(False)
    at = "\0" + address[1:] if address.startswith("@") else address  # "@": the abstract name space

    def tell(text: str) -> bool:
        with suppress(OSError):
            return sender.sendto(text.encode(), at) > 0
        return False

    return tell
