"""The replay: recorded inputs go into a coupling once more, and what comes of them is compared."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from instrument.coupling import Coupling
from instrument.errors import RigError
from instrument.measurement import Measurement
from instrument.rig.link import RawSample
from instrument.tape.entry import INPUTS, Entry, Kind, TapeError
from instrument.tape.feed import set_troubles
from instrument.tape.measured import Measured, pack, unpack

log = logging.getLogger("pneuforce")


class Difference(NamedTuple):
    """Where a replay differs from its recording first."""

    number: int  #: of the sample, from 1
    sequence: int  #: of the board's frame
    t_s: float  #: when it was recorded, by the host's clock
    field: str
    recorded: float
    replayed: float

    def __str__(self) -> str:
        told = f"{self.field} was {self.recorded!r} and is now {self.replayed!r}"
        return f"sample {self.number} (sequence {self.sequence}): {told}"


class Compared(NamedTuple):
    """A recorded sample beside what came of it again."""

    t_s: float  #: when the board took it, by the host's clock
    difference: Difference | None  #: None where it is the same to the last bit


class Replayed(NamedTuple):
    """One sample that was measured again."""

    t_s: float  #: when its bytes came, by the host's clock
    raw: RawSample
    measurement: Measurement


def check_version(facts: Mapping[str, Any], version: str, map_hash: str) -> None:
    """Raise TapeError where a recording that BEGINs with these facts is another program's to replay.

    Another version may measure otherwise, which is no error of either; another map shows other registers.
    """
    remedy = "pneuforce export and pneuforce plot read it all the same"
    if facts.get("version") != version:
        raise TapeError(
            f"recorded by pneuforce {facts.get('version')}, and this is {version}: "
            f"only the same version measures the same; {remedy}"
        )
    if facts.get("map_hash") != map_hash:
        raise TapeError(
            f"recorded with register map {facts.get('map_hash')}, and this program's is {map_hash}; {remedy}"
        )


def feed(coupling: Coupling, entry: Entry) -> Iterator[Replayed]:
    """Do once more what an input did; yields each sample as it is measured.

    Raises TapeError where that cannot be done, or the entry is no input.
    """
    if entry.kind not in INPUTS:
        raise TapeError(f"{entry.kind.name} is no input, and cannot be replayed")
    try:
        if entry.kind is Kind.RECEIVED:
            yield from _receive(coupling, entry)
        else:
            _DO[entry.kind](coupling, entry)
    except Exception as error:  # an error of ours comes again, and is what the replay was made for
        raise TapeError(f"{entry.kind.name} at {entry.t_s:.3f} s cannot be replayed: {error!r}") from error


def _receive(coupling: Coupling, entry: Entry) -> Iterator[Replayed]:
    try:
        samples = coupling.receive(entry.body, entry.t_s)
    except RigError as error:
        log.warning("%s", error)  # the port was closed then, as the next entry says
        return
    for raw in samples:
        yield Replayed(entry.t_s, raw, coupling.take(raw, entry.t_s))


def _beat(coupling: Coupling, entry: Entry) -> None:
    set_troubles(coupling.instrument, entry.body[0] if entry.body else 0)
    coupling.beat(entry.t_s)


def _write(coupling: Coupling, entry: Entry) -> None:
    channel, address, values = entry.facts
    coupling.write((channel, address), values, entry.t_s)


_DO: Mapping[int, Callable[[Coupling, Entry], object]] = {
    Kind.ATTACHED: lambda coupling, entry: coupling.attach(entry.t_s),
    Kind.BEAT: _beat,
    Kind.ASKED: lambda coupling, entry: coupling.orders(entry.t_s),
    Kind.DETACHED: lambda coupling, entry: coupling.detach(entry.t_s),
    Kind.WRITE: _write,
    Kind.MASTER_LOST: lambda coupling, entry: coupling.master_lost(entry.t_s),
    Kind.MASTER_BACK: lambda coupling, entry: coupling.master_back(entry.t_s),
    Kind.LEAVING: lambda coupling, entry: coupling.leave(entry.t_s),
}


def compared(coupling: Coupling, inputs: Iterable[Entry], recorded: Iterable[Measured]) -> Iterator[Compared]:
    """Each recorded sample beside what comes of the inputs now. Raises TapeError.

    It ends with the first of both: a recording that was cut off may hold the last bytes without what was made
    of them. Where no input brings a recorded sample about, there is nothing to compare it with.
    """
    again = (sample for entry in inputs for sample in feed(coupling, entry))
    for number, (was, sample) in enumerate(zip(recorded, again, strict=False), 1):
        now = unpack(pack(sample.raw, sample.measurement))
        yield Compared(was.t_s, difference(number, was, now))


def difference(number: int, was: Measured, now: Measured) -> Difference | None:
    """The first field that differs; NaN is NaN, and the sign of a zero is not kept in a recording."""
    for field, before, after in zip(Measured._fields, was, now, strict=True):
        if before != after and not (before != before and after != after):
            return Difference(number, was.sequence, was.t_s, field, before, after)
    return None
