"""Flow for Node-RED with the nodes of node-red-contrib-modbus: read, hold, vent and clear.

The JavaScript of the function nodes is in the folder `javascript`. The tables that this code uses are in the
"On Start" part of each function node.
"""

from __future__ import annotations

from collections.abc import Sequence

from pneuforce.registers.map import MAP_VERSION
from pneuforce.registers.map_hash import MAP_HASH
from pneuforce.registers.views import node_red_nodes as nodes
from pneuforce.registers.views import node_red_tables as tables
from pneuforce.registers.views.node_red_nodes import Node

_TAB = "pneuforce"
_TARGETS = ("Vent", "Control")
_HELP = f"""\
Reads the instrument four times per second, holds and vents the balloon, and shows faults with their remedy.
Instructions: docs/how-to/node-red.md. Host, port and unit id are in the node "pneuforce instrument".

Map version {MAP_VERSION}, hash {MAP_HASH:08X}h (registers 768 and 770).
Generated from the register map: pneuforce map --format node-red.
"""


def render() -> str:
    """Return the flow without a dashboard."""
    return nodes.render_nodes(flow())


def flow(
    reading_to: Sequence[str] = (), notes_to: Sequence[str] = (), commands_from: Sequence[str] = ()
) -> list[Node]:
    """Return all nodes of the flow. The arguments are names of link nodes on other tabs."""
    return [
        nodes.tab(_TAB, _HELP),
        nodes.client(),
        *_reading(reading_to),
        *_commands(commands_from),
        *_writing(notes_to),
    ]


def _reading(reading_to: Sequence[str]) -> list[Node]:
    seconds = f"{tables.TICK_MS / 1000:g}"
    wires = (("Read registers",), ("Reading", "Control", "Show reading"))
    return [
        nodes.inject("Tick", "tick", (110, 100), (*_TARGETS, "Read"), _TAB, repeat=seconds, once=True),
        nodes.function("Read", (290, 100), wires, _TAB, tables.read_tables(), tables.READ_STATE),
        nodes.modbus("modbus-flex-getter", "Read registers", (290, 40), "Read", _TAB),
        nodes.link_out("Reading", (455, 80), reading_to, _TAB),
        nodes.debug("Show reading", (520, 120), _TAB, active=False),
    ]


def _commands(commands_from: Sequence[str]) -> list[Node]:
    return [
        nodes.link_in("Command", (155, 220), commands_from, _TARGETS, _TAB),
        nodes.inject("Vent now", "vent", (110, 280), _TARGETS, _TAB),
        nodes.inject("Hold", "hold", (110, 340), _TARGETS, _TAB),
        nodes.inject("Setpoint 6 kPa", "setpoint", (120, 380), _TARGETS, _TAB, 6),
        nodes.inject("Force limit 5 N", "force_limit", (120, 420), _TARGETS, _TAB, 5),
        nodes.inject("Clear faults", "clear", (110, 460), _TARGETS, _TAB),
    ]


def _writing(notes_to: Sequence[str]) -> list[Node]:
    notes = ("Note", "Show notes")
    vent_wires = (("Write vent",), ("Control", *notes))
    control_wires = (("Write registers",), ("Vent",), notes)
    return [
        nodes.function("Vent", (350, 280), vent_wires, _TAB, tables.vent_tables(), tables.VENT_STATE),
        nodes.modbus("modbus-flex-write", "Write vent", (350, 220), "Vent", _TAB),
        nodes.function(
            "Control", (350, 380), control_wires, _TAB, tables.control_tables(), tables.CONTROL_STATE
        ),
        nodes.modbus("modbus-flex-write", "Write registers", (350, 460), "Control", _TAB),
        nodes.link_out("Note", (535, 340), notes_to, _TAB),
        nodes.debug("Show notes", (590, 380), _TAB, active=True),
    ]
