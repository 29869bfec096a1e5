"""Carrier state of a CAN interface of the Linux kernel.

A socket does not report this state. While a controller is bus-off, a new socket still opens and accepts
frames, but nothing is sent.
"""

from __future__ import annotations

import errno
from pathlib import Path

CARRIER_FILE = "/sys/class/net/{}/carrier"  #: see Linux, Documentation/ABI/testing/sysfs-class-net


def link_problem(channel: str) -> str:
    """Return the reason why the interface cannot send; "" if it can send or has no carrier file."""
    try:
        carrier = Path(CARRIER_FILE.format(channel)).read_text("ascii").strip()
    except OSError as error:
        return "the interface is down" if error.errno == errno.EINVAL else ""
    return "" if carrier == "1" else "no carrier: the controller is bus-off or stopped"
