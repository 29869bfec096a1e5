"""What Linux knows about a serial device without opening it: names, permission, holders, USB latency."""

from __future__ import annotations

import os
import stat
from contextlib import suppress
from pathlib import Path

#: Who has opened one of these is the far end of its pty, as a simulator is, and no rival for it.
MASTERS = {"/dev/ptmx", "/dev/pts/ptmx"}
#: The rule's name for a machine's only UNO, whichever it is.
ONLY_BOARD = "/dev/pneuforce"
#: What udev is to know of the boards.
RULES = Path(__file__).parents[1] / "service/60-pneuforce.rules"


def is_device(url: str) -> bool:
    """Whether this names a device of this machine, not one behind `socket://`."""
    return "://" not in url


def is_serial(port: str, devices: Path = Path("/sys/dev/char")) -> bool:
    """Whether this may be a serial port: a character device that Linux does not know as something else."""
    about = os.stat(port)
    if not stat.S_ISCHR(about.st_mode):
        return False
    kind = devices / f"{os.major(about.st_rdev)}:{os.minor(about.st_rdev)}" / "subsystem"
    return not kind.exists() or kind.resolve().name in {"tty", "usb-serial"}


def stable_name(port: str, by_id: Path = Path("/dev/serial/by-id")) -> Path | None:
    """The name that follows the adapter wherever it is plugged in, None where the port has none."""
    device = os.path.realpath(port)
    with suppress(OSError):
        return next((name for name in sorted(by_id.iterdir()) if os.path.realpath(name) == device), None)
    return None


def holders(port: str, processes: Path = Path("/proc")) -> list[str]:
    """Other processes that have the port open, as `name (pid)`, as far as this user may see them."""
    device, own = os.path.realpath(port), str(os.getpid())
    return [
        f"{_name(process)} ({process.name})"
        for process in processes.iterdir()
        if process.name.isdecimal() and process.name != own and _has_open(process, device)
    ]


def _has_open(process: Path, device: str) -> bool:
    try:
        targets = {_target(descriptor) for descriptor in (process / "fd").iterdir()}
    except OSError:  # it has ended, or is another user's
        return False
    return device in targets and not targets & MASTERS


def _target(descriptor: Path) -> str:
    try:
        return os.readlink(descriptor)
    except OSError:
        return ""


def _name(process: Path) -> str:
    try:
        return (process / "comm").read_text().strip()
    except OSError:
        return "a process"


def usb_latency_ms(port: str, devices: Path = Path("/sys/bus/usb-serial/devices")) -> int | None:
    """How long a USB adapter keeps bytes back [ms]; None where it has no such timer, as an UNO's own USB."""
    try:
        return int((devices / Path(os.path.realpath(port)).name / "latency_timer").read_text())
    except (OSError, ValueError):
        return None
