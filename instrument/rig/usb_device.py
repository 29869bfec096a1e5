"""Facts about a serial device that Linux provides without opening the device."""

from __future__ import annotations

import os
import stat
from contextlib import suppress
from pathlib import Path

#: A process that has opened one of these files serves the other end of the pty, for example a simulator. Such
#: a process does not compete for the port.
PTY_MASTERS = {"/dev/ptmx", "/dev/pts/ptmx"}
#: Name that the udev rule gives to the only UNO of a machine.
SINGLE_BOARD_NAME = "/dev/pneuforce"
#: The udev rules for the boards.
UDEV_RULES = Path(__file__).parents[1] / "deploy/60-pneuforce.rules"


def is_local_device(url: str) -> bool:
    """Return True if `url` names a device of this machine, and not a rig behind `socket://`."""
    return "://" not in url


def is_serial(port: str, devices: Path = Path("/sys/dev/char")) -> bool:
    """Return True if `port` is a character device that Linux does not list as another kind of device."""
    status = os.stat(port)
    if not stat.S_ISCHR(status.st_mode):
        return False
    kind = devices / f"{os.major(status.st_rdev)}:{os.minor(status.st_rdev)}" / "subsystem"
    return not kind.exists() or kind.resolve().name in {"tty", "usb-serial"}


def stable_name(port: str, by_id: Path = Path("/dev/serial/by-id")) -> Path | None:
    """Return the device name that is the same in every USB socket; None if the port has no such name."""
    device = os.path.realpath(port)
    with suppress(OSError):
        return next((name for name in sorted(by_id.iterdir()) if os.path.realpath(name) == device), None)
    return None


def processes_using(port: str, processes: Path = Path("/proc")) -> list[str]:
    """Return the other processes that have the port open, as `name (pid)`.

    The list contains only processes that this user may inspect.
    """
    device, this_process = os.path.realpath(port), str(os.getpid())
    return [
        f"{_name(process)} ({process.name})"
        for process in processes.iterdir()
        if process.name.isdecimal() and process.name != this_process and _has_open(process, device)
    ]


def _has_open(process: Path, device: str) -> bool:
    try:
        targets = {_target(descriptor) for descriptor in (process / "fd").iterdir()}
    except OSError:  # the process has ended, or belongs to another user
        return False
    return device in targets and not targets & PTY_MASTERS


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
    """Return the latency timer of a USB adapter [ms]: the longest time for which the adapter delays bytes.

    The result is None if the adapter has no such timer. The USB interface of an UNO has none.
    """
    try:
        return int((devices / Path(os.path.realpath(port)).name / "latency_timer").read_text())
    except (OSError, ValueError):
        return None
