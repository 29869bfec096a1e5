"""Tables for the kinds of contact in a scenario file: keys, defaults, ranges, and the resulting contacts."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    Field,
    InstanceOf,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)

from pneuforce.sim.contacts.contact import Contact
from pneuforce.sim.contacts.recorded_force import read_recorded_force
from pneuforce.sim.contacts.scenario_table import NumberList, ScenarioTable
from pneuforce.sim.contacts.tissue import Rigid
from pneuforce.sim.contacts.tissue_tables import TissueTable
from pneuforce.sim.contacts.trajectory import (
    MAX_RATE_PER_S,
    LinearChange,
    Oscillation,
    Polyline,
    Segment,
    Trajectory,
    constant,
    smooth_change,
)
from pneuforce.sim.plants.plant import MAX_PUSH_N

Force = Annotated[float, Field(ge=0, le=MAX_PUSH_N)]
Travel = Annotated[float, Field(ge=0, le=50)]
Forces = Annotated[tuple[Force, ...], NumberList, Field(min_length=1)]
Travels = Annotated[tuple[Travel, ...], NumberList, Field(min_length=1)]
Time = Annotated[float, Field(ge=0, le=3600)]
RiseTime = Annotated[float, Field(ge=0.01, le=3600)]
Frequency = Annotated[float, Field(ge=0.01, le=50)]
EasedFraction = Annotated[float, Field(ge=0, le=0.95)]


class _ContactTable(ScenarioTable, ABC):
    pause_s: Time = 1.0  # time without contact, after each contact
    angle_deg: float = Field(0.0, ge=0, le=80)

    @abstractmethod
    def trajectories(self) -> Iterator[tuple[Segment, ...]]:
        """Yield the segments of each contact, in order."""

    def contacts(self) -> Iterator[Contact]:
        """Yield the contacts of this table, in order."""
        for segments in self.trajectories():
            yield Contact(Trajectory.of(*segments), self.angle_deg, pause_s=self.pause_s)


class _PlateauTable(_ContactTable):
    """Contacts with a constant force, or with a constant travel against tissue (by default a rigid wall)."""

    force_n: Forces | None = None
    travel_mm: Travels | None = None
    tissue: TissueTable | None = None
    rise_s: RiseTime | None = None
    hold_s: Time

    @model_validator(mode="after")
    def _force_or_travel(self) -> _PlateauTable:
        if (self.force_n is None) == (self.travel_mm is None):
            raise ValueError("either force_n or travel_mm is required, not both")
        if self.travel_mm is None and self.tissue is not None:
            raise ValueError("tissue requires travel_mm: a given force does not depend on the tissue")
        if self.travel_mm is not None and self.angle_deg:
            raise ValueError("angle_deg requires force_n: a travel is always along the axis")
        return self

    def trajectories(self) -> Iterator[tuple[Segment, ...]]:
        for peak in self.force_n or self.travel_mm or ():
            rise, fall = smooth_change(0.0, peak, self.rise_s), smooth_change(peak, 0.0, self.rise_s)
            yield rise, constant(peak, self.hold_s), fall

    def contacts(self) -> Iterator[Contact]:
        """Yield the contacts of this table, in order."""
        if self.travel_mm is None:
            yield from super().contacts()
            return
        tissue = self.tissue.tissue() if self.tissue else Rigid()
        for contact in super().contacts():
            yield contact._replace(tissue=tissue)


class PressTable(_PlateauTable):
    """Press: rise, plateau, and a fall as fast as the rise."""

    kind: Literal["press"]
    hold_s: Time = 1.5


class HoldTable(_PlateauTable):
    """Press with a long plateau."""

    kind: Literal["hold"]
    hold_s: Time = 10.0


class TapTable(_PlateauTable):
    """Press with a very short plateau."""

    kind: Literal["tap"]
    hold_s: Time = 0.05


class FastTable(_ContactTable):
    """Overlapping presses: each starts when the force has fallen to the fraction `eased` of the last peak."""

    kind: Literal["fast"]
    force_n: Forces
    eased: EasedFraction = 0.1
    rise_s: RiseTime | None = None
    hold_s: Time = 0.1

    def trajectories(self) -> Iterator[tuple[Segment, ...]]:
        """Yield one contact, with no pause between its presses."""
        segments: list[Segment] = []
        low_n = 0.0
        for force_n in self.force_n:
            segments += smooth_change(low_n, force_n, self.rise_s), constant(force_n, self.hold_s)
            low_n = self.eased * force_n
            segments.append(smooth_change(force_n, low_n, self.rise_s))
        yield *segments, smooth_change(low_n, 0.0)


class _OscillationTable(_ContactTable):
    """Contacts with a force that oscillates around its mean and never becomes negative."""

    force_n: Forces
    amplitude_n: Force
    rise_s: RiseTime | None = None
    lasts_s: Annotated[float, Field(ge=0.1, le=3600)] = 10.0

    @model_validator(mode="after")
    def _never_pulls(self) -> _OscillationTable:
        if self.amplitude_n > min(self.force_n):
            raise ValueError(
                f"amplitude_n = {self.amplitude_n:g} exceeds force_n, and the balloon cannot be pulled: "
                "use an amplitude of at most force_n"
            )
        return self

    @abstractmethod
    def _band_hz(self) -> tuple[float, float]:
        """Return the frequencies at the start and at the end of the oscillation [Hz]."""

    def trajectories(self) -> Iterator[tuple[Segment, ...]]:
        for mean_n in self.force_n:
            oscillation = Oscillation(mean_n, self.amplitude_n, *self._band_hz(), self.lasts_s)
            yield (
                smooth_change(0.0, mean_n, self.rise_s),
                oscillation,
                smooth_change(mean_n, 0.0, self.rise_s),
            )


class TremorTable(_OscillationTable):
    """Contact held by a trembling hand."""

    kind: Literal["tremor"]
    amplitude_n: Force = 0.1
    frequency_hz: Annotated[float, Field(ge=8, le=12)] = 10.0

    def _band_hz(self) -> tuple[float, float]:
        return self.frequency_hz, self.frequency_hz


class SineTable(_OscillationTable):
    """Force that oscillates at one frequency."""

    kind: Literal["sine"]
    frequency_hz: Frequency

    def _band_hz(self) -> tuple[float, float]:
        return self.frequency_hz, self.frequency_hz


class ChirpTable(_OscillationTable):
    """Force that oscillates at a linearly changing frequency."""

    kind: Literal["chirp"]
    from_hz: Frequency
    to_hz: Frequency

    def _band_hz(self) -> tuple[float, float]:
        return self.from_hz, self.to_hz


class RampTable(_ContactTable):
    """Force that rises and falls at a constant rate."""

    kind: Literal["ramp"]
    force_n: Forces
    rate_n_per_s: float = Field(MAX_RATE_PER_S, ge=0.001, le=1000)
    hold_s: Time = 1.5

    def trajectories(self) -> Iterator[tuple[Segment, ...]]:
        """Yield one contact for each force."""
        for force_n in self.force_n:
            rise_s = max(force_n / self.rate_n_per_s, 1e-3)
            rise, fall = LinearChange(0.0, force_n, rise_s), LinearChange(force_n, 0.0, rise_s)
            yield rise, constant(force_n, self.hold_s), fall


def _read(name: object, info: ValidationInfo) -> Polyline:
    folder: Path | None = (info.context or {}).get("folder")
    if not isinstance(name, str):
        raise ValueError("the name of a CSV file is expected")
    if folder is None:
        raise ValueError("a recorded force is possible in a scenario file only")
    return read_recorded_force(folder / name)


class ProfileTable(_ContactTable):
    """Recorded force, read from a CSV file with the columns t_s and force_n.

    The name of the file is relative to the folder of the scenario file.
    """

    kind: Literal["profile"]
    file: Annotated[InstanceOf[Polyline], BeforeValidator(_read), WithJsonSchema({"type": "string"})]

    def trajectories(self) -> Iterator[tuple[Segment, ...]]:
        """Yield one contact: a rise from 0 N to the first force, all recorded forces, and a fall to 0 N."""
        first_n, last_n = self.file.values[0], self.file.values[-1]
        yield smooth_change(0.0, first_n), self.file, smooth_change(last_n, 0.0)


ContactTable = Annotated[
    PressTable
    | HoldTable
    | TapTable
    | FastTable
    | TremorTable
    | SineTable
    | ChirpTable
    | RampTable
    | ProfileTable,
    Field(discriminator="kind"),
]
#: Table of each kind of contact, by the name of the kind in a scenario file.
CONTACT_TABLES: dict[str, type[Any]] = {
    "press": PressTable,
    "hold": HoldTable,
    "tap": TapTable,
    "fast": FastTable,
    "tremor": TremorTable,
    "sine": SineTable,
    "chirp": ChirpTable,
    "ramp": RampTable,
    "profile": ProfileTable,
}
