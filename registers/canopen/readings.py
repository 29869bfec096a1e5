"""What the node itself gives its dictionary: names, errors, status of the channels, what it sent last."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from registers.can.command import Reply
from registers.can.frames import ANSWER, COMMAND, FORCE, RESULTS, Frame
from registers.canopen.abort import Abort, Why
from registers.canopen.communication import ERROR_FIELD, ERRORS_KEPT, RECORDS
from registers.canopen.dictionary import AI_STATUS
from registers.canopen.emergency import Emergencies
from registers.canopen.entry import Code
from registers.canopen.parameters import Place

#: Value of an entry in one snapshot. Raises Abort.
Reading = Callable[[Any], Code]

_NOT_VALID, _ABOVE = 1, 2


class Identity(NamedTuple):
    """Texts of 1008h, 1009h and 100Ah."""

    device: str = "pneumatic force sensor"
    hardware: str = "PF-1"
    software: str = ""


@dataclass(slots=True)
class Told:
    """What the node sent and heard last, as the records of its frames show it."""

    counter: int = 0
    reply: Reply = field(default_factory=lambda: Reply(0, "accepted"))
    command: bytes = bytes(COMMAND.length)

    def own(self, frame: Frame) -> dict[str, Any]:
        """The fields of a TPDO that are no quantity of the source."""
        if frame is FORCE:
            return {"counter": self.counter}
        return self.reply._asdict() if frame is ANSWER else {}


def readings(
    identity: Identity, told: Told, emergencies: Callable[[], Emergencies]
) -> Mapping[Place, Reading]:
    """How each such value is read, by its index and sub-index."""
    return {
        (0x1001, 0): lambda _: emergencies().register,
        ERROR_FIELD: lambda _: len(emergencies().history),
        **{(ERROR_FIELD[0], sub): _past_error(emergencies, sub) for sub in range(1, ERRORS_KEPT + 1)},
        (0x1008, 0): lambda _: identity.device,
        (0x1009, 0): lambda _: identity.hardware,
        (0x100A, 0): lambda _: identity.software,
        _of(FORCE, "counter"): lambda _: told.counter,
        _of(ANSWER, "sequence"): lambda _: told.reply.sequence,
        _of(ANSWER, "result"): lambda _: RESULTS.codes[told.reply.result],
        **{_of(COMMAND, own.name): _commanded(told, own.name) for own in COMMAND.fields},
        (AI_STATUS, 1): lambda s: _status("force_valid" in s.status, "force_limit" in s.status),
        (AI_STATUS, 2): lambda s: _status(math.isfinite(s.pressure_kpa), "overpressure" in s.status),
    }


def _of(frame: Frame, name: str) -> Place:
    return RECORDS[frame.name], 1 + [own.name for own in frame.fields].index(name)


def _past_error(emergencies: Callable[[], Emergencies], sub: int) -> Reading:
    def read(_: Any) -> Code:
        history = emergencies().history
        if sub > len(history):
            raise Abort(Why.NO_DATA)
        return history[sub - 1]

    return read


def _commanded(told: Told, name: str) -> Reading:
    return lambda _: COMMAND.codes(told.command)[name]


def _status(valid: bool, above: bool) -> int:
    return (0 if valid else _NOT_VALID) | (_ABOVE if above else 0)
