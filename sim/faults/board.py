"""Faults of the board."""

from __future__ import annotations

from instrument.rig.frames import PROTOCOL_VERSION
from sim.faults.kind import Argument, FaultKind, Given

BOARD = (
    FaultKind(
        "board_reset",
        "The board restarts: its uptime begins anew, its valves are SAFE.",
        "The restart is told from the uptime; the setpoint is not restored.",
        does="rig.reset_board",
        shows="board_reset",
    ),
    FaultKind(
        "board_frozen",
        "The board's clock stands still; it sends the same instant again and again.",
        "Ten samples of one instant trip. The emulated chip says nothing then: its watchdog vents, and the "
        "link is lost.",
        {"rig.frozen_board": True},
        shows="sensor_fault",
    ),
    FaultKind(
        "clock_off",
        "The board's quartz is off: its seconds are too short or too long.",
        "Nothing trips: the link estimates the rate of the board's clock, and ages stay true. Beyond 1 % it "
        "wants maintenance; up to 0.5 % a resonator may be off.",
        {"rig.clock_rate": Given("rate")},
        arguments=(Argument("rate", "of the true rate", 1.015, 0.98, 1.02),),
        shows="maintenance",
    ),
    FaultKind(
        "other_version",
        "The firmware speaks another version of the protocol.",
        "The versions are compared in the greeting, before a valve may move: the host refuses the board.",
        {"rig.board.version": PROTOCOL_VERSION + 1},
        shows="link_lost",
    ),
)
