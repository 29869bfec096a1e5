"""Values of the entries that the node itself supplies: names, errors, channel status, last frames."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from pneuforce.registers.can.command import CommandResult
from pneuforce.registers.can.frames import ANSWER, COMMAND, FORCE, RESULTS, FrameDefinition
from pneuforce.registers.canopen.abort import AbortCode, SdoAbort
from pneuforce.registers.canopen.communication import (
    ERROR_FIELD,
    ERROR_HISTORY_LENGTH,
    RECORDS,
    REVISION,
    revision_number,
)
from pneuforce.registers.canopen.emergency import EmergencyProducer
from pneuforce.registers.canopen.entry import EntryAddress, EntryValue
from pneuforce.registers.canopen.measuring_device import AI_STATUS, FORCE_SPAN, PRESSURE_SPAN
from pneuforce.registers.canopen.parameter_storage import ParameterStorage
from pneuforce.registers.canopen.storage_objects import STORAGE_ENTRIES
from pneuforce.registers.field import Field

#: Function that returns the value of an entry for a snapshot. Raises SdoAbort if there is no value.
ValueReader = Callable[[Any], EntryValue]

#: Bits of the status of a channel (6150h).
_NOT_VALID, _POSITIVE_OVERLOAD, _NEGATIVE_OVERLOAD = 1, 2, 4


class CanopenIdentity(NamedTuple):
    """Texts of the objects 1008h, 1009h and 100Ah."""

    device: str = "pneumatic force sensor"
    hardware: str = "PF-1"
    software: str = ""


@dataclass(slots=True)
class LastFrames:
    """Values of the last frames that the node sent and received. SDO clients read them in records."""

    counter: int = 0
    answer: CommandResult = field(default_factory=lambda: CommandResult(0, "accepted"))
    command: bytes = bytes(COMMAND.length)

    def node_values(self, frame: FrameDefinition) -> dict[str, Any]:
        """Return the values of those fields of a TPDO that the node itself supplies, by field name."""
        if frame is FORCE:
            return {"counter": self.counter}
        return self.answer._asdict() if frame is ANSWER else {}


def value_readers(
    identity: CanopenIdentity,
    last_frames: LastFrames,
    emergencies: Callable[[], EmergencyProducer],
    storage: ParameterStorage,
) -> Mapping[EntryAddress, ValueReader]:
    """Return the reader of each entry whose value the node supplies, by index and sub-index."""
    return {
        (0x1001, 0): lambda _: emergencies().error_register,
        ERROR_FIELD: lambda _: len(emergencies().history),
        **{
            (ERROR_FIELD[0], subindex): _error_reader(emergencies, subindex)
            for subindex in range(1, ERROR_HISTORY_LENGTH + 1)
        },
        (0x1008, 0): lambda _: identity.device,
        (0x1009, 0): lambda _: identity.hardware,
        (0x100A, 0): lambda _: identity.software,
        **dict.fromkeys(STORAGE_ENTRIES, lambda _: int(storage.can_store)),
        REVISION: lambda s: revision_number(s.map_hash),
        field_address(FORCE, "counter"): lambda _: last_frames.counter,
        field_address(ANSWER, "sequence"): lambda _: last_frames.answer.sequence,
        field_address(ANSWER, "result"): lambda _: RESULTS.codes[last_frames.answer.result],
        **{field_address(COMMAND, f.name): _command_reader(last_frames, f.name) for f in COMMAND.fields},
        (AI_STATUS, 1): lambda s: _channel_status("force_valid" in s.status, s.force_n, FORCE_SPAN),
        (AI_STATUS, 2): lambda s: _channel_status(
            math.isfinite(s.pressure_kpa), s.pressure_kpa, PRESSURE_SPAN
        ),
    }


def field_address(frame: FrameDefinition, name: str) -> EntryAddress:
    """Return the index and sub-index of a field in the record of its frame."""
    return RECORDS[frame.name], 1 + [field.name for field in frame.fields].index(name)


def _error_reader(emergencies: Callable[[], EmergencyProducer], subindex: int) -> ValueReader:
    def read(_: Any) -> EntryValue:
        history = emergencies().history
        if subindex > len(history):
            raise SdoAbort(AbortCode.NO_DATA)
        return history[subindex - 1]

    return read


def _command_reader(last_frames: LastFrames, name: str) -> ValueReader:
    return lambda _: COMMAND.codes(last_frames.command)[name]


def _channel_status(valid: bool, value: float, span: Field) -> int:
    """Return the status bits of a channel. A value of NaN sets no overload bit."""
    assert span.low is not None
    assert span.high is not None
    overload = _POSITIVE_OVERLOAD if value > span.high else _NEGATIVE_OVERLOAD if value < span.low else 0
    return overload | (0 if valid else _NOT_VALID)
