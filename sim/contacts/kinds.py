"""The kinds of contact as tables of a scenario file: keys, defaults and spans; each makes contacts."""

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

from sim.contacts.contact import Contact
from sim.contacts.course import (
    STEEPEST_PER_S,
    Course,
    Piece,
    Recorded,
    Straight,
    Wave,
    stay,
    stroke,
)
from sim.contacts.laws import Hertz, Linear
from sim.contacts.recorded import recorded
from sim.contacts.table import Spread, Table
from sim.contacts.tissue import Rigid
from sim.plant import HARDEST_N

Force = Annotated[float, Field(ge=0, le=HARDEST_N)]
Travel = Annotated[float, Field(ge=0, le=50)]
Forces = Annotated[tuple[Force, ...], Spread, Field(min_length=1)]
Travels = Annotated[tuple[Travel, ...], Spread, Field(min_length=1)]
Time = Annotated[float, Field(ge=0, le=3600)]
Rise = Annotated[float, Field(ge=0.01, le=3600)]
Frequency = Annotated[float, Field(ge=0.01, le=50)]
Ease = Annotated[float, Field(ge=0, le=0.95)]


class _Kind(Table, ABC):
    pause_s: Time = 1.0  # without contact, after it
    angle_deg: float = Field(0.0, ge=0, le=80)

    @abstractmethod
    def courses(self) -> Iterator[tuple[Piece, ...]]:
        """The pieces of each contact, in order."""

    def contacts(self) -> Iterator[Contact]:
        """The contacts of this table, in order."""
        for pieces in self.courses():
            yield Contact(Course.of(*pieces), self.angle_deg, pause_s=self.pause_s)


class _Stay(_Kind):
    """Driven by force, or by a travel against tissue; a travel without tissue meets a rigid wall."""

    force_n: Forces | None = None
    travel_mm: Travels | None = None
    tissue: Annotated[Hertz | Linear, Field(discriminator="law")] | None = None
    rise_s: Rise | None = None
    hold_s: Time

    @model_validator(mode="after")
    def _one_drive(self) -> _Stay:
        if (self.force_n is None) == (self.travel_mm is None):
            raise ValueError("either force_n or travel_mm is expected")
        if self.travel_mm is None and self.tissue is not None:
            raise ValueError("tissue goes with travel_mm; a force is the same on any tissue")
        if self.travel_mm is not None and self.angle_deg:
            raise ValueError("angle_deg goes with force_n; a travel is along the axis")
        return self

    def courses(self) -> Iterator[tuple[Piece, ...]]:
        for peak in self.force_n or self.travel_mm or ():
            rise, fall = stroke(0.0, peak, self.rise_s), stroke(peak, 0.0, self.rise_s)
            yield rise, stay(peak, self.hold_s), fall

    def contacts(self) -> Iterator[Contact]:
        """The contacts of this table, in order."""
        if self.travel_mm is None:
            yield from super().contacts()
            return
        tissue = self.tissue.tissue() if self.tissue else Rigid()
        for contact in super().contacts():
            yield contact._replace(tissue=tissue)


class Press(_Stay):
    """Rises, stays for a while, is released as fast as it rose."""

    kind: Literal["press"]
    hold_s: Time = 1.5


class Hold(_Stay):
    """A press that stays long."""

    kind: Literal["hold"]
    hold_s: Time = 10.0


class Tap(_Stay):
    """A press that hardly stays."""

    kind: Literal["tap"]
    hold_s: Time = 0.05


class Fast(_Kind):
    """Presses that overlap: each begins when the one before has eased to `eased` of its force."""

    kind: Literal["fast"]
    force_n: Forces
    eased: Ease = 0.1
    rise_s: Rise | None = None
    hold_s: Time = 0.1

    def courses(self) -> Iterator[tuple[Piece, ...]]:
        """One contact without a pause within."""
        pieces: list[Piece] = []
        low_n = 0.0
        for force_n in self.force_n:
            pieces += stroke(low_n, force_n, self.rise_s), stay(force_n, self.hold_s)
            low_n = self.eased * force_n
            pieces.append(stroke(force_n, low_n, self.rise_s))
        yield *pieces, stroke(low_n, 0.0)


class _Swaying(_Kind):
    """A force that sways around its mean; it never pulls."""

    force_n: Forces
    amplitude_n: Force
    rise_s: Rise | None = None
    lasts_s: Annotated[float, Field(ge=0.1, le=3600)] = 10.0

    @model_validator(mode="after")
    def _pushes(self) -> _Swaying:
        if self.amplitude_n > min(self.force_n):
            raise ValueError(f"amplitude_n = {self.amplitude_n:g} would pull: at most force_n is possible")
        return self

    @abstractmethod
    def _band_hz(self) -> tuple[float, float]:
        """Frequencies at its begin and its end."""

    def courses(self) -> Iterator[tuple[Piece, ...]]:
        for mean_n in self.force_n:
            wave = Wave(mean_n, self.amplitude_n, *self._band_hz(), self.lasts_s)
            yield stroke(0.0, mean_n, self.rise_s), wave, stroke(mean_n, 0.0, self.rise_s)


class Tremor(_Swaying):
    """A hold by a hand that trembles."""

    kind: Literal["tremor"]
    amplitude_n: Force = 0.1
    frequency_hz: Annotated[float, Field(ge=8, le=12)] = 10.0

    def _band_hz(self) -> tuple[float, float]:
        return self.frequency_hz, self.frequency_hz


class Sine(_Swaying):
    """A force that sways at one frequency."""

    kind: Literal["sine"]
    frequency_hz: Frequency

    def _band_hz(self) -> tuple[float, float]:
        return self.frequency_hz, self.frequency_hz


class Chirp(_Swaying):
    """A force that sways at a frequency that goes evenly from one to another."""

    kind: Literal["chirp"]
    from_hz: Frequency
    to_hz: Frequency

    def _band_hz(self) -> tuple[float, float]:
        return self.from_hz, self.to_hz


class Ramp(_Kind):
    """Rises and falls at a constant rate."""

    kind: Literal["ramp"]
    force_n: Forces
    rate_n_per_s: float = Field(STEEPEST_PER_S, ge=0.001, le=1000)
    hold_s: Time = 1.5

    def courses(self) -> Iterator[tuple[Piece, ...]]:
        """One for each force."""
        for force_n in self.force_n:
            lasts_s = max(force_n / self.rate_n_per_s, 1e-3)
            rise, fall = Straight(0.0, force_n, lasts_s), Straight(force_n, 0.0, lasts_s)
            yield rise, stay(force_n, self.hold_s), fall


def _read(name: object, info: ValidationInfo) -> Recorded:
    folder: Path | None = (info.context or {}).get("folder")
    if not isinstance(name, str):
        raise ValueError("the name of a CSV file is expected")
    if folder is None:
        raise ValueError("a recorded course belongs into a scenario file")
    return recorded(folder / name)


class Profile(_Kind):
    """A force that was recorded: a CSV with t_s and force_n, beside the scenario file."""

    kind: Literal["profile"]
    file: Annotated[InstanceOf[Recorded], BeforeValidator(_read), WithJsonSchema({"type": "string"})]

    def courses(self) -> Iterator[tuple[Piece, ...]]:
        """From nothing to the first force, and from the last to nothing."""
        first_n, last_n = self.file.values[0], self.file.values[-1]
        yield stroke(0.0, first_n), self.file, stroke(last_n, 0.0)


Kind = Annotated[
    Press | Hold | Tap | Fast | Tremor | Sine | Chirp | Ramp | Profile, Field(discriminator="kind")
]
#: By the names that a scenario file uses.
KINDS: dict[str, type[Any]] = {
    "press": Press,
    "hold": Hold,
    "tap": Tap,
    "fast": Fast,
    "tremor": Tremor,
    "sine": Sine,
    "chirp": Chirp,
    "ramp": Ramp,
    "profile": Profile,
}
