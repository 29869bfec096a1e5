"""Faults of the board."""

from __future__ import annotations

from pneuforce.protocol.frames import PROTOCOL_VERSION
from pneuforce.sim.faults.kind import FaultArgument, FaultKind, FromArgument

BOARD = (
    FaultKind(
        "board_reset",
        "The board restarts: its uptime starts at zero, the inlet is closed, and the vent is open.",
        "The host detects the restart from the uptime. The setpoint is not restored.",
        call="rig.reset_board",
        effect="board_reset",
    ),
    FaultKind(
        "board_frozen",
        "The clock of the board has stopped: all samples have the same time.",
        "The rig trips after eight samples with the same time. The emulated chip sends no samples: its "
        "watchdog vents the balloon, and the host reports the loss of the link.",
        {"rig.frozen_board": True},
        effect="sensor_fault",
    ),
    FaultKind(
        "clock_off",
        "The crystal of the board has a wrong frequency: the board clock is too slow or too fast.",
        "The rig does not trip: the link estimates the rate of the board clock, so the ages of the samples "
        "are correct. An error of the rate above 1 % sets maintenance_required. A normal resonator may "
        "deviate by up to 0.5 %.",
        {"rig.clock_rate": FromArgument("rate")},
        arguments=(FaultArgument("rate", "of the true rate", 1.015, 0.98, 1.02),),
        effect="maintenance_required",
    ),
    FaultKind(
        "other_version",
        "The firmware uses another version of the protocol.",
        "The host compares the versions before a valve may move, and rejects the board.",
        {"rig.board.version": PROTOCOL_VERSION + 1},
        effect="link_lost",
    ),
)
