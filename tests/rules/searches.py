"""The searches: which peers, writes and other events each of them combines.

All events together have more states than a computer can visit. Each search therefore combines the events that
can affect each other, and visits all of their states.
"""

from __future__ import annotations

from typing import NamedTuple


class Search(NamedTuple):
    """Events that a search combines in all orders."""

    name: str
    sentence: str
    peers: tuple[str, ...]
    writes: tuple[str, ...]
    others: tuple[str, ...]  #: events that are not writes
    quick: bool = False  #: part of each `make test`

    def events(self) -> tuple[tuple[str, str], ...]:
        """Return each event with the name of the peer that writes, or ""."""
        written = tuple((write, peer) for peer in self.peers for write in self.writes)
        return written + tuple((event, "") for event in self.others)


EVERYBODY = ("PLC", "HMI", "robot")
ORDER = ("vent", "hold", "clear")
LEASES = ("lease", "end of lease")

SEARCHES = (
    Search(
        "order",
        "three peers on two buses, and a fault of the board",
        EVERYBODY,
        (*ORDER, "vent with a bad value"),
        ("wait", "cause"),
        quick=True,
    ),
    Search(
        "leases",
        "three peers that take leases",
        EVERYBODY,
        (*ORDER, *LEASES, "vent with a bad value"),
        ("wait",),
    ),
    Search("contacts", "leases that expire in a contact", EVERYBODY, (*ORDER, *LEASES), ("wait", "touch")),
    Search(
        "faults",
        "all causes of a trip",
        ("robot",),
        ORDER,
        ("wait", "silence", "touch", "cause", "restart of the board", "unplug", "master"),
    ),
    Search(
        "stalls",
        "a host that stalls while a lease or the link ends",
        ("robot",),
        (*ORDER, *LEASES),
        ("wait", "silence", "stall"),
    ),
    Search(
        "board", "a board that does not follow the commands", ("robot",), ORDER, ("wait", "ignore", "cause")
    ),
)
