"""Checks of the serial port before it is opened."""

from __future__ import annotations

import getpass
import os

from pneuforce.instrument.doctor.check import Check, CheckResult, graded, inapplicable, unchecked
from pneuforce.instrument.rig.usb_device import (
    SINGLE_BOARD_NAME,
    UDEV_RULES,
    is_local_device,
    is_serial,
    processes_using,
    stable_name,
    usb_latency_ms,
)

MAX_LATENCY_MS = 2
INSTALL_RULES = f"run sudo cp {UDEV_RULES} /etc/udev/rules.d/, then plug the board in again"
NAMES = ("port", "stable name", "permission", "exclusive access", "USB latency")


def port_checks(url: str) -> list[Check]:
    """Return the checks of the port that are possible without opening the port."""
    if not is_local_device(url):
        return [inapplicable(name, "not a device of this machine") for name in NAMES]
    if not os.path.exists(url):
        return _no_port(f"{url} does not exist")
    if not is_serial(url):
        return _no_port(f"{url} is not a serial port")
    exists = Check(NAMES[0], CheckResult.PASS, f"{url} is {os.path.realpath(url)}")
    return [exists, _stable_name(url), _permission(url), _exclusive(url), _latency(url)]


def _no_port(finding: str) -> list[Check]:
    advice = "plug the board in, or name its port with --port: ls -l /dev/serial/by-id lists the serial ports"
    missing = Check(NAMES[0], CheckResult.FAIL, finding, advice)
    return [missing, *(unchecked(name, "no port") for name in NAMES[1:])]


def _stable_name(port: str) -> Check:
    name = stable_name(port)
    if name is None:
        return inapplicable(NAMES[1], "the device has no name in /dev/serial/by-id")
    advice = f'use [rig] port = "{name}", which names this board even if others are plugged in'
    named = os.path.abspath(port) in {str(name), SINGLE_BOARD_NAME}
    return graded(NAMES[1], str(name), advice, passed=named, usable=True)


def _permission(port: str) -> Check:
    allowed = os.access(port, os.R_OK | os.W_OK)
    user = getpass.getuser()
    advice = f"run sudo usermod -aG dialout {user}, then log in again"
    finding = f"the user {user} {'can' if allowed else 'cannot'} read and write"
    return graded(NAMES[2], finding, advice, passed=allowed, usable=False)


def _exclusive(port: str) -> Check:
    others = processes_using(port)
    finding = f"open in {', '.join(others)}" if others else "no other process has the port open"
    return graded(NAMES[3], finding, _remedy(others), passed=not others, usable=False)


def _remedy(others: list[str]) -> str:
    """Return how to end the processes that have the port open, by their names."""
    remedies = {
        "pneuforce": "stop the running instrument, which vents the balloon: sudo systemctl stop pneuforce "
        "(or pneuforce@NAME), or Ctrl-C in its terminal; start it again after the examination",
        "ModemManager": INSTALL_RULES,
    }
    found = [remedy for name, remedy in remedies.items() if any(each.startswith(name) for each in others)]
    return "; ".join(found) or "end that process first, then run pneuforce doctor again"


def _latency(port: str) -> Check:
    latency_ms = usb_latency_ms(port)
    if latency_ms is None:
        return inapplicable(NAMES[4], "the device has no latency timer")
    advice = f"set the latency timer to at most {MAX_LATENCY_MS} ms: {INSTALL_RULES}"
    return graded(NAMES[4], f"{latency_ms} ms", advice, passed=latency_ms <= MAX_LATENCY_MS, usable=True)
