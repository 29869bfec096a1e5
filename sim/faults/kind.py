"""What a fault is: what happens, how it is put in, and who must see it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from instrument.rig.frames import Fault


class Argument(NamedTuple):
    """How much of a fault; the name ends in the unit."""

    name: str
    unit: str
    usual: float
    low: float
    high: float
    whole: bool = False  #: only whole numbers, others are rounded


class Given(NamedTuple):
    """Stands in `FaultKind.sets` for the value of an argument."""

    argument: str


@dataclass(frozen=True, slots=True)
class FaultKind:
    """A fault that can be put in.

    `sets` names attributes of the rig, as paths, and the value that each has while the fault is in; taken
    out, they have the values that they had in the healthy rig. `does` and `undoes` name a call instead; one
    that is done and not undone is over at once.
    """

    name: str
    what: str  #: what it is physically
    rule: str  #: what the instrument promises
    sets: Mapping[str, Any] = field(default_factory=dict)
    does: str = ""
    undoes: str = ""
    arguments: tuple[Argument, ...] = ()
    board: Fault | None = None  #: what the board must latch
    shows: str = ""  #: where the board sees nothing: the status bit of the instrument, "drift" or "losses"
    where: str = "holding"  #: when it is put in so that it shows: vented, inflating, holding, venting

    @property
    def lasts(self) -> bool:
        """Whether it is in until it is taken out."""
        return bool(self.sets or self.undoes)
