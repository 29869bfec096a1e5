"""Replay: recorded inputs are applied to a session again, and the results are compared with the recording."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from pneuforce.errors import RigError
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.measurement.measurement import Measurement
from pneuforce.instrument.recording.broadcaster import set_health_flags
from pneuforce.instrument.recording.reader import short_text
from pneuforce.instrument.rig.link import RawSample
from pneuforce.instrument.stream.entry import INPUTS, EntryKind, StreamEntry, StreamError
from pneuforce.instrument.stream.sample_record import SampleRecord, pack, unpack

log = logging.getLogger("pneuforce")


_NUMBER = (int, float)
#: Types of each quantity that a bus can write.
WRITABLE_TYPES: Mapping[str, tuple[type, ...]] = {
    "setpoint_requested_kpa": _NUMBER,
    "force_limit_n": _NUMBER,
    "force_limit_2_n": _NUMBER,
    "alarm_hysteresis_n": _NUMBER,
    "alarm_delay_s": _NUMBER,
    "reference_pressure_kpa": _NUMBER,
    "ambient_pressure_kpa": _NUMBER,
    "lease_s": _NUMBER,
    "mode": (str,),
    "proof_test": (str,),
    "command_key": _NUMBER,
    "command_code": (str,),
    "command_argument": _NUMBER,
    "command_sequence": _NUMBER,
}


class ReplayDifference(NamedTuple):
    """First field of a sample in which a replay differs from its recording."""

    number: int  #: number of the sample, counted from 1
    sequence: int  #: sequence number of the frame from the board
    t_s: float  #: time of the recorded sample on the clock of the host process
    field: str
    recorded: float
    replayed: float

    def __str__(self) -> str:
        values = f"{self.field} is {self.recorded!r} in the recording and {self.replayed!r} in the replay"
        return f"sample {self.number} (sequence {self.sequence}): {values}"


class ComparedSample(NamedTuple):
    """Result of the comparison of one recorded sample with its replay."""

    t_s: float  #: time at which the board took the sample, on the clock of the host process
    difference: ReplayDifference | None  #: first difference; None if all fields are equal


class ReplayedSample(NamedTuple):
    """Sample whose measurement was computed again."""

    t_s: float  #: time at which the bytes of the sample arrived, on the clock of the host process
    raw: RawSample
    measurement: Measurement


def check_version(header: Mapping[str, Any], version: str, map_hash: str) -> None:
    """Raise StreamError if this program cannot replay a recording with this header.

    The program and the register map must have the recorded version. With another version, the values may
    differ or a recorded register may be missing.
    """
    remedy = "pneuforce export and pneuforce plot can still read the recording"
    if header.get("version") != version:
        recorded = short_text(header.get("version"))
        raise StreamError(
            f"the recording was made by pneuforce {recorded}, and this is pneuforce {version}: "
            f"only the same version gives the same measurements; {remedy}"
        )
    if header.get("map_hash") != map_hash:
        raise StreamError(
            f"the recording was made with register map {short_text(header.get('map_hash'))}, "
            f"and this program has register map {map_hash}; {remedy}"
        )


def replay_input(session: Session, entry: StreamEntry) -> Iterator[ReplayedSample]:
    """Apply one recorded input to the session. Yields each resulting sample.

    Raises StreamError if the entry is not an input, or if the session raises an exception.
    """
    if entry.kind not in INPUTS:
        raise StreamError(f"an entry of kind {entry.kind.name} is not an input, so it cannot be replayed")
    try:
        if entry.kind is EntryKind.RECEIVED:
            yield from _receive(session, entry)
        else:
            _ACTIONS[entry.kind](session, entry)
    except Exception as error:  # a replay also reproduces programming errors, which helps to find them
        raise StreamError(f"{entry.kind.name} at {entry.t_s:.3f} s cannot be replayed: {error!r}") from error


def _receive(session: Session, entry: StreamEntry) -> Iterator[ReplayedSample]:
    try:
        samples = session.receive(entry.body, entry.t_s)
    except RigError as error:
        log.warning("%s", error)  # the host process then closed the port, as the next entry shows
        return
    session.link.events.clear()  # the host process has logged these events
    for raw in samples:
        yield ReplayedSample(entry.t_s, raw, session.process(raw, entry.t_s))


def _tick(session: Session, entry: StreamEntry) -> None:
    set_health_flags(session.instrument, entry.body[0] if entry.body else 0)
    session.tick(entry.t_s)


def _write(session: Session, entry: StreamEntry) -> None:
    channel, address, values = entry.json_body
    if not isinstance(channel, str) or not isinstance(address, str):
        raise StreamError("the peer of a write is not a text")
    for name, value in values.items():
        if isinstance(value, bool) or not isinstance(value, WRITABLE_TYPES.get(name, ())):
            raise StreamError(f"a write of {short_text(name)} has an invalid value")
    session.write((channel, address), values, entry.t_s)


_ACTIONS: Mapping[int, Callable[[Session, StreamEntry], object]] = {
    EntryKind.ATTACHED: lambda session, entry: session.attach(entry.t_s),
    EntryKind.TICK: _tick,
    EntryKind.COMMAND: lambda session, entry: session.outgoing(entry.t_s),
    EntryKind.DETACHED: lambda session, entry: session.detach(entry.t_s),
    EntryKind.WRITE: _write,
    EntryKind.MASTER_LOST: lambda session, entry: session.master_lost(entry.t_s),
    EntryKind.MASTER_RECOVERED: lambda session, entry: session.master_recovered(entry.t_s),
    EntryKind.SHUTDOWN: lambda session, entry: session.leave(entry.t_s),
}


def compare_samples(
    session: Session, inputs: Iterable[StreamEntry], recorded: Iterable[SampleRecord]
) -> Iterator[ComparedSample]:
    """Replay the inputs and yield the comparison of each recorded sample.

    The comparison ends when the recorded or the replayed samples end. A recording that was cut off may
    contain the last input bytes without their samples. Raises StreamError if an input cannot be replayed.
    """
    replayed = (sample for entry in inputs for sample in replay_input(session, entry))
    for number, (before, sample) in enumerate(zip(recorded, replayed, strict=False), 1):
        now = unpack(pack(sample.raw, sample.measurement))
        yield ComparedSample(before.t_s, first_difference(number, before, now))


def first_difference(number: int, before: SampleRecord, now: SampleRecord) -> ReplayDifference | None:
    """Return the first field that differs, or None.

    NaN equals NaN. Zeros of different sign are equal, because a recording does not store the sign of a zero.
    """
    for field, old, new in zip(SampleRecord._fields, before, now, strict=True):
        both_nan = old != old and new != new
        if old != new and not both_nan:
            return ReplayDifference(number, before.sequence, before.t_s, field, old, new)
    return None
