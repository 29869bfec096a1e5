"""Network management (CiA 301, 7.3.2): NMT states, NMT commands, and the objects allowed in each state."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto

#: NMT states, with the same names as in the Heartbeat frame.
PRE_OPERATIONAL, OPERATIONAL, STOPPED = "pre_operational", "operational", "stopped"

NMT_ID = 0x000
RESET_COMMANDS = frozenset((129, 130))  #: reset node and reset communication; both have the same effect
#: NMT command → state after the command. The state before the command is irrelevant.
STATE_AFTER_COMMAND: Mapping[int, str] = {1: OPERATIONAL, 2: STOPPED, 128: PRE_OPERATIONAL}
#: Value of 1029h → state of an operational node after the master is lost. Value 1 means no change.
STATE_AFTER_ERROR: Mapping[int, str] = {0: PRE_OPERATIONAL, 2: STOPPED}


class CommunicationObject(Enum):
    """Communication object that only some states allow.

    Heartbeat, network management and a vent by Command frame are allowed in every state.
    """

    SDO = auto()
    PDO = auto()
    EMERGENCY = auto()


ALLOWED_OBJECTS: Mapping[str, frozenset[CommunicationObject]] = {
    PRE_OPERATIONAL: frozenset((CommunicationObject.SDO, CommunicationObject.EMERGENCY)),
    OPERATIONAL: frozenset((CommunicationObject.SDO, CommunicationObject.EMERGENCY, CommunicationObject.PDO)),
    STOPPED: frozenset(),
}


def command_for(data: bytes, node_id: int) -> int | None:
    """Return the NMT command for this node or for all nodes; None if it is malformed or unknown."""
    known = len(data) == 2 and (data[0] in STATE_AFTER_COMMAND or data[0] in RESET_COMMANDS)
    return data[0] if known and data[1] in (0, node_id) else None


def is_for_another_node(data: bytes, node_id: int) -> bool:
    """Return True if an NMT message is well formed and addressed to another node."""
    return len(data) == 2 and data[1] not in (0, node_id)
