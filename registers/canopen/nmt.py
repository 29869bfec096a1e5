"""Network management (CiA 301, 7.3.2): the node's states, what moves between them, what each lets through."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto

#: Names as in the heartbeat.
PRE_OPERATIONAL, OPERATIONAL, STOPPED = "pre_operational", "operational", "stopped"

NMT_ID = 0x000
RESETS = frozenset((129, 130))  #: of the node, of its communication; both are the same here
#: Where each command leads, from whatever state.
COMMANDS: Mapping[int, str] = {1: OPERATIONAL, 2: STOPPED, 128: PRE_OPERATIONAL}
#: Where 1029h leads when the master is lost; 1 is no change, and a node that is not operational stays.
ON_ERROR: Mapping[int, str] = {0: PRE_OPERATIONAL, 2: STOPPED}


class Service(Enum):
    """What a state lets through; heartbeat, network management and a vent pass in every one."""

    SDO = auto()
    PDO = auto()
    EMERGENCY = auto()


ADMITTED: Mapping[str, frozenset[Service]] = {
    PRE_OPERATIONAL: frozenset((Service.SDO, Service.EMERGENCY)),
    OPERATIONAL: frozenset((Service.SDO, Service.EMERGENCY, Service.PDO)),
    STOPPED: frozenset(),
}


def command_for(data: bytes, node_id: int) -> int | None:
    """The command in an NMT message for this node or for all; None for what is malformed or unknown."""
    known = len(data) == 2 and (data[0] in COMMANDS or data[0] in RESETS)
    return data[0] if known and data[1] in (0, node_id) else None


def is_for_another(data: bytes, node_id: int) -> bool:
    """Whether an NMT message is well formed, and another node's."""
    return len(data) == 2 and data[1] not in (0, node_id)
