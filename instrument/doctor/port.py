"""Checks of the port, before it is opened."""

from __future__ import annotations

import os

from instrument.doctor.check import Check, Verdict, graded, unchecked
from instrument.rig.device import (
    ONLY_BOARD,
    RULES,
    holders,
    is_device,
    is_serial,
    stable_name,
    usb_latency_ms,
)

MOST_LATENCY_MS = 2
INSTALL_RULES = f"sudo cp {RULES} /etc/udev/rules.d/, then plug it in anew"
NAMES = ("port", "stable name", "permission", "exclusive access", "USB latency")


def port_checks(url: str) -> list[Check]:
    """What Linux says of the port. The board is not touched."""
    if not is_device(url):
        return [unchecked(name, "not a device of this machine") for name in NAMES]
    if not os.path.exists(url):
        return _no_port(f"there is no {url}")
    if not is_serial(url):
        return _no_port(f"{url} is not a serial port")
    exists = Check(NAMES[0], Verdict.GOOD, f"{url} is {os.path.realpath(url)}")
    return [exists, _stable_name(url), _permission(url), _exclusive(url), _latency(url)]


def _no_port(found: str) -> list[Check]:
    advice = "plug the board in; ls -l /dev/serial/by-id shows what is there"
    missing = Check(NAMES[0], Verdict.BAD, found, advice)
    return [missing, *(unchecked(name, "no port") for name in NAMES[1:])]


def _stable_name(port: str) -> Check:
    name = stable_name(port)
    if name is None:
        return unchecked(NAMES[1], "the device has none in /dev/serial/by-id")
    advice = f'[rig] port = "{name}" still is this board when others are plugged in'
    named = os.path.abspath(port) in {str(name), ONLY_BOARD}
    return graded(NAMES[1], str(name), advice, good=named, usable=True)


def _permission(port: str) -> Check:
    allowed = os.access(port, os.R_OK | os.W_OK)
    advice = "sudo usermod -aG dialout $USER, then log in anew"
    found = "may be read and written" if allowed else "may not be read and written"
    return graded(NAMES[2], found, advice, good=allowed, usable=False)


def _exclusive(port: str) -> Check:
    others = holders(port)
    advice = f"end that one first; ModemManager: {INSTALL_RULES}"
    found = f"open in {', '.join(others)}" if others else "nobody else has it open"
    return graded(NAMES[3], found, advice, good=not others, usable=False)


def _latency(port: str) -> Check:
    latency_ms = usb_latency_ms(port)
    if latency_ms is None:
        return unchecked(NAMES[4], "the device has no such timer")
    advice = f"set it to at most {MOST_LATENCY_MS} ms: {INSTALL_RULES}"
    return graded(NAMES[4], f"{latency_ms} ms", advice, good=latency_ms <= MOST_LATENCY_MS, usable=True)
