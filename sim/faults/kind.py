"""Definition of a fault: effect on the rig, method of injection, and expected response."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from pneuforce.protocol.frames import Fault


class FaultArgument(NamedTuple):
    """Argument that sets the size of a fault. If it has a physical unit, its name ends with this unit."""

    name: str
    unit: str
    default: float
    minimum: float
    maximum: float
    integer: bool = False  #: values are rounded to integers


class FromArgument(NamedTuple):
    """Placeholder in `FaultKind.attributes` for the value of an argument."""

    argument: str


def format_active(name: str, **arguments: float) -> str:
    """Return an active fault with its arguments, for example `leak kpa_per_s=0.05`."""
    return " ".join([name, *(f"{argument}={value:g}" for argument, value in arguments.items())])


@dataclass(frozen=True, slots=True)
class FaultKind:
    """Fault that can be injected into the rig.

    `attributes` maps paths of attributes of the rig to the values that they have during the fault. Removal of
    the fault restores the values of the healthy rig. A fault with `call` calls a method instead. A call
    without `undo_call` happens once: the fault does not persist.
    """

    name: str
    description: str  #: what happens physically
    expected: str  #: how the instrument must respond
    attributes: Mapping[str, Any] = field(default_factory=dict)
    call: str = ""
    undo_call: str = ""
    arguments: tuple[FaultArgument, ...] = ()
    board_fault: Fault | None = None  #: fault that the board must latch, None if the board cannot detect it
    #: Response if the board latches no fault: the name of a status bit of the instrument, "drift" (drift
    #: without a contact), "losses" (lost frames are counted) or "" (no response).
    effect: str = ""
    phase: str = "holding"  #: phase in which the fault has an effect: vented, inflating, holding or venting

    @property
    def is_persistent(self) -> bool:
        """Return True if the fault stays until it is removed."""
        return bool(self.attributes or self.undo_call)
