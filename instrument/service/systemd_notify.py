"""Notifications to systemd: ready, watchdog and status (sd_notify(3), WatchdogSec in systemd.service(5)).

Without $NOTIFY_SOCKET nothing is sent.
"""

from __future__ import annotations

import math
import os
import socket
from collections.abc import Callable, Mapping
from contextlib import suppress

from pneuforce.instrument.core.faults import name_of
from pneuforce.registers.source import Peer, Source

#: Function that sends a message. It returns False if systemd did not accept the message.
Notify = Callable[[str], bool]

NOTIFICATIONS_PER_WATCHDOG = 4  #: more than one, so that a lost message does not end the process
STATUS_S = 0.5
SERVICE = Peer("service")


class SystemdNotifier:
    """Output channel that notifies systemd from the event loop, so that systemd detects a hanging loop."""

    def __init__(self, source: Source, notify: Notify, watchdog_s: float) -> None:
        """Create the notifier.

        systemd ends a process that is silent for `watchdog_s`. The time is infinite if there is no watchdog.
        """
        self._source = source
        self._notify = notify
        self._watchdog_s = watchdog_s
        self._serving = self._ready_accepted = False
        self._due_s = -math.inf
        self._status = ""

    def ready(self) -> None:
        """Report that the buses are served."""
        self._serving = True
        self._ready_accepted = self._notify("READY=1")

    def stopping(self) -> None:
        """Report that the instrument vents and ends."""
        self._serving = False
        self._notify("STOPPING=1\nSTATUS=venting, then ending")

    def on_sample(self, now_s: float) -> None:
        """Do nothing. The watchdog must not depend on samples, because a silent rig needs no restart."""

    def tick(self, now_s: float) -> None:
        """Report that the loop runs, and the status if it has changed."""
        if not self._serving or now_s < self._due_s:
            return
        self._due_s = now_s + min(self._watchdog_s / NOTIFICATIONS_PER_WATCHDOG, STATUS_S)
        status = status_text(self._source, now_s)
        lines = {
            "READY=1": not self._ready_accepted,
            "WATCHDOG=1": math.isfinite(self._watchdog_s),
            f"STATUS={status}": status != self._status,
        }
        due = [line for line, is_due in lines.items() if is_due]
        if due and self._notify("\n".join(due)):
            self._ready_accepted, self._status = True, status


def status_text(source: Source, now_s: float) -> str:
    """Return the state and the faults of the instrument as text."""
    snapshot = source.snapshot(SERVICE, now_s)
    state = "no samples from the board" if "link_lost" in snapshot.status else snapshot.state
    return ": ".join([state, *filter(None, [", ".join(map(name_of, snapshot.faults))])])


def systemd_notifier(source: Source, environment: Mapping[str, str] = os.environ) -> SystemdNotifier:
    """Return the notifier of this process. It sends nothing if systemd did not start the process."""
    return SystemdNotifier(
        source, notify_to(environment.get("NOTIFY_SOCKET", "")), watchdog_s_of(environment)
    )


def watchdog_s_of(environment: Mapping[str, str]) -> float:
    """Return the watchdog time of this process [s]; inf if the process has no watchdog."""
    watched = environment.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
    us = environment.get("WATCHDOG_USEC", "")
    return int(us) / 1e6 if watched and us.isdecimal() and int(us) else math.inf


def notify_to(address: str) -> Notify:
    """Return a function that sends messages to a socket and never waits.

    The function does nothing if `address` is not the address of a Unix socket.
    """
    if not address.startswith(("/", "@")):
        return lambda _: True
    sender = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
    sender.setblocking(False)
    # An address that begins with "@" is in the abstract name space.
    destination = "\0" + address[1:] if address.startswith("@") else address

    def notify(text: str) -> bool:
        with suppress(OSError):
            return sender.sendto(text.encode(), destination) > 0
        return False

    return notify
