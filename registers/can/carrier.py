"""Whether a kernel's CAN interface takes part in its bus: what a socket that was opened on it does not tell.

While a controller is bus-off, a new socket opens, takes frames, and nothing is ever sent.
"""

from __future__ import annotations

import errno
from pathlib import Path

CARRIER = "/sys/class/net/{}/carrier"  #: Linux, Documentation/ABI/testing/sysfs-class-net


def trouble_of(channel: str) -> str:
    """Why nothing can be sent there; empty where it can, or where this system does not say."""
    try:
        carrier = Path(CARRIER.format(channel)).read_text("ascii").strip()
    except OSError as error:
        return "the interface is down" if error.errno == errno.EINVAL else ""
    return "" if carrier == "1" else "no carrier: the controller is bus-off or stopped"
