"""Scenarios: a TOML file that says what a simulated rig is like and what happens to it. A library of them."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import fields
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    InstanceOf,
    TypeAdapter,
    ValidationError,
    WithJsonSchema,
    model_validator,
)

from instrument.rig.limits import SETPOINT_PA
from sim.contacts.contact import Contact, Phase
from sim.contacts.kinds import KINDS, Kind
from sim.contacts.laws import Hertz, Linear
from sim.contacts.table import Spread, Table, is_number, sentences, shown
from sim.faults.injection import checked
from sim.pneumatics import PneumaticSettings
from sim.sensor import SensorSettings

TOO_LONG = "a whole number has at most 64 bits"
LIBRARY = Path(__file__).with_name("scenarios")
Setpoint = Annotated[float, Field(ge=SETPOINT_PA[0] * 1e-3, le=SETPOINT_PA[1] * 1e-3)]


class ScenarioError(ValueError):
    """A scenario that cannot be played, in sentences with file, key and allowed span."""


class PlantTable(Table):
    """The balloon; `low` is the published one's, material and sides are the membrane's."""

    kind: Literal["published", "membrane"] = "published"
    low: Literal["line", "smooth"] = "line"
    material: Literal["mooney-rivlin", "neo-hookean"] = "mooney-rivlin"
    sides: Literal[1, 2] = 1


class FaultTable(Table):
    """A fault of the catalogue at its time; its arguments are the keys that are not named here."""

    model_config = ConfigDict(extra="allow")

    name: str
    at_s: float = Field(ge=0, le=1e6)  # since the board booted
    for_s: float = Field(math.inf, ge=0, le=1e6)

    @model_validator(mode="after")
    def _in_the_catalogue(self) -> FaultTable:
        checked(self.name, self.model_extra or {})
        return self


class PhaseTable(Table):
    """Contacts at one setpoint, or the same at each of several."""

    setpoint_kpa: Annotated[tuple[Setpoint, ...], Spread, Field(min_length=1)]
    repeat: int = Field(1, ge=1, le=1000)
    contact: list[Kind] = Field(min_length=1)


def _settings(kind: type) -> BeforeValidator:
    """Makes a settings dataclass of a table with some of its fields."""

    def made(table: Any) -> Any:
        known = {field.name: field for field in fields(kind)}
        if not isinstance(table, dict):
            raise ValueError("must be a table")
        for name, value in table.items():
            if name not in known:
                raise ValueError(f"{name}: unknown key; known here: {', '.join(known)}")
            if not is_number(value):
                raise ValueError(f"{name} = {shown(value)}: a number is expected")
        return kind(**{name: float(value) for name, value in table.items()})

    return BeforeValidator(made)


_ANY_TABLE = WithJsonSchema({"type": "object"})


class Scenario(Table):
    """A whole scenario."""

    doc: str = Field(min_length=1, max_length=200)
    seed: int = Field(1, ge=0, le=0xFFFF_FFFF)
    plant: PlantTable = PlantTable()
    pneumatics: Annotated[InstanceOf[PneumaticSettings], _settings(PneumaticSettings), _ANY_TABLE] = (
        PneumaticSettings()
    )
    sensor: Annotated[InstanceOf[SensorSettings], _settings(SensorSettings), _ANY_TABLE] = SensorSettings()
    fault: list[FaultTable] = Field(default_factory=list)
    phase: list[PhaseTable] = Field(min_length=1)

    @cached_property
    def phases(self) -> tuple[Phase, ...]:
        """The phases in the order in which they are played."""
        return tuple(
            Phase(setpoint_kpa, table.repeat * contacts)
            for table in self.phase
            for contacts in [tuple(contact for kind in table.contact for contact in kind.contacts())]
            for setpoint_kpa in table.setpoint_kpa
        )


TABLES: Mapping[str, type[Table]] = {
    "": Scenario,
    "plant": PlantTable,
    "fault": FaultTable,
    "phase": PhaseTable,
    "hertz": Hertz,
    "linear": Linear,
    **KINDS,
}


def library() -> dict[str, str]:
    """What each scenario of the library is, by name."""
    files = sorted(LIBRARY.glob("*.toml"))
    return {file.stem: tomllib.loads(file.read_text(encoding="utf-8"))["doc"] for file in files}


def load(name: str) -> Scenario:
    """The scenario of the library, or in a file. Raises ScenarioError."""
    if "/" in name or name.endswith(".toml"):
        return _read(Path(name))
    if not (LIBRARY / f"{name}.toml").is_file():
        raise ScenarioError(f"there is no scenario {name!r}, only {', '.join(library())}, or a file .toml")
    return _read(LIBRARY / f"{name}.toml")


def _read(path: Path) -> Scenario:
    tables = _tables(path)
    try:
        return Scenario.model_validate(tables, context={"folder": path.parent})
    except ValidationError as error:
        raise ScenarioError("\n".join(f"{path}: {told}" for told in sentences(error, TABLES))) from None


def _tables(path: Path) -> dict[str, Any]:
    try:
        if path.exists() and not path.is_file():
            raise OSError("not a regular file")
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ScenarioError(f"{path}: no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{path}: cannot be read: {error}") from None
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{path}: not TOML: {error}") from None
    except RecursionError:
        raise ScenarioError(f"{path}: not TOML: brackets within brackets, too deep") from None
    except ValueError:  # Python reads no number of more than 4300 digits
        raise ScenarioError(f"{path}: not TOML: {TOO_LONG}") from None
    if not _fits(tables):
        raise ScenarioError(f"{path}: not TOML: {TOO_LONG}")
    return tables


def _fits(value: Any) -> bool:
    """Whether TOML allows every whole number in a value."""
    if isinstance(value, dict):
        return all(map(_fits, value.values()))
    if isinstance(value, list):
        return all(map(_fits, value))
    return not isinstance(value, int) or -(2**63) <= value < 2**63


_KIND: TypeAdapter[Any] = TypeAdapter(Kind)


def contacts_of(table: Any) -> tuple[Contact, ...]:
    """The contacts that a table like those of a scenario asks for. Raises ScenarioError."""
    try:
        return tuple(_KIND.validate_python(table).contacts())
    except ValidationError as error:
        raise ScenarioError("; ".join(sentences(error, TABLES))) from None
