"""Scenarios: TOML files with the properties of a simulated rig, its contacts and its faults."""

from __future__ import annotations

import math
import tomllib
from dataclasses import fields
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    InstanceOf,
    PlainValidator,
    TypeAdapter,
    ValidationError,
    WithJsonSchema,
    model_validator,
)

from pneuforce.protocol.limits import SETPOINT_PA
from pneuforce.sim.contacts.contact import Contact, Phase
from pneuforce.sim.contacts.kinds import ContactTable
from pneuforce.sim.contacts.scenario_table import NumberList, ScenarioTable, format_location, is_number
from pneuforce.sim.contacts.tool import MovedTool, ToolTable
from pneuforce.sim.faults.injection import validate_arguments
from pneuforce.sim.pneumatics import PneumaticSettings
from pneuforce.sim.sensor import SensorSettings
from pneuforce.support.atomic_file import read_file
from pneuforce.support.toml_sections import decode_text, parse_tables
from pneuforce.support.validation_errors import format_errors, format_input

TOO_LARGE = "a whole number may have at most 64 bits"
#: Folder of the scenarios that are installed with the program.
LIBRARY = Path(__file__).with_name("scenarios")
Setpoint = Annotated[float, Field(ge=SETPOINT_PA[0] * 1e-3, le=SETPOINT_PA[1] * 1e-3)]


class ScenarioError(ValueError):
    """Invalid scenario. The message names the file, the key and the allowed range."""


def _contact(value: Any) -> Any:
    """Return the contact of a membrane with a plate. Raises ValueError if the value is not allowed."""
    if value in ("slide", "stick") or (is_number(value) and 0 <= value <= 1):
        return value
    raise ValueError("slide, stick or a number from 0 (slide) to 1 (stick) is expected")


class PlantTable(ScenarioTable):
    """Simulated balloon.

    `low` is used by `published`. `material`, `sides` and `contact` are used by `membrane`.
    """

    kind: Literal["published", "membrane"] = "published"
    low: Literal["line", "smooth"] = "line"
    material: Literal["mooney-rivlin", "neo-hookean", "gent", "ogden"] = "mooney-rivlin"
    sides: Literal[1, 2] = 1
    contact: Annotated[Literal["slide", "stick"] | float, PlainValidator(_contact)] = "slide"


class FaultTable(ScenarioTable):
    """Fault of the catalogue, injected at a given time. All other keys are arguments of the fault."""

    model_config = ConfigDict(extra="allow")

    name: str
    at_s: float = Field(ge=0, le=1e6)  # time since the start of the simulator
    for_s: float = Field(math.inf, ge=0, le=1e6)

    @model_validator(mode="after")
    def _valid_arguments(self) -> FaultTable:
        validate_arguments(self.name, self.model_extra or {})
        return self


class PhaseTable(ScenarioTable):
    """Phase of a scenario: contacts that are played at each of the setpoints."""

    setpoint_kpa: Annotated[tuple[Setpoint, ...], NumberList, Field(min_length=1)]
    repeat: int = Field(1, ge=1, le=1000)
    contact: list[ContactTable] = Field(min_length=1)


def _settings(settings_type: type) -> BeforeValidator:
    """Return a validator that converts a table to a settings dataclass. Missing keys get their defaults."""

    def converted(table: Any) -> Any:
        known = {field.name: field for field in fields(settings_type)}
        if not isinstance(table, dict):
            raise ValueError("must be a table")
        for name, value in table.items():
            if name not in known:
                raise ValueError(f"{name}: unknown key; known here: {', '.join(known)}")
            if not is_number(value):
                raise ValueError(f"{name} = {format_input(value)}: a number is expected")
        return settings_type(**{name: float(value) for name, value in table.items()})

    return BeforeValidator(converted)


_ANY_TABLE = WithJsonSchema({"type": "object"})


class Scenario(ScenarioTable):
    """Content of a scenario file."""

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
        """Return the phases in the order in which they are played."""
        return tuple(
            Phase(setpoint_kpa, table.repeat * contacts)
            for table in self.phase
            for contacts in [tuple(contact for row in table.contact for contact in row.contacts())]
            for setpoint_kpa in table.setpoint_kpa
        )


def library() -> dict[str, str]:
    """Return the description of each scenario of the library, by name."""
    files = sorted(LIBRARY.glob("*.toml"))
    return {file.stem: tomllib.loads(file.read_text(encoding="utf-8"))["doc"] for file in files}


def load(name: str) -> Scenario:
    """Return a scenario of the library, or of a TOML file if `name` is a path. Raises ScenarioError."""
    if "/" in name or name.endswith(".toml"):
        return _read(Path(name))
    if not (LIBRARY / f"{name}.toml").is_file():
        raise ScenarioError(
            f"{name!r} is an unknown scenario; use one of {', '.join(library())}, or the path of a TOML file"
        )
    return _read(LIBRARY / f"{name}.toml")


def _read(path: Path) -> Scenario:
    tables = _tables(path)
    try:
        return Scenario.model_validate(tables, context={"folder": path.parent})
    except ValidationError as error:
        lines = [f"{path}: {sentence}" for sentence in format_errors(error, Scenario, format_location)]
        raise ScenarioError("\n".join(lines)) from None


def _tables(path: Path) -> dict[str, Any]:
    try:
        tables = parse_tables(decode_text(read_file(path), str(path)), str(path))
    except ValueError as error:
        raise ScenarioError(str(error)) from None
    if not _fits(tables):
        raise ScenarioError(f"{path}: not TOML: {TOO_LARGE}")
    return tables


def _fits(value: Any) -> bool:
    """Return True if every integer in a value has at most 64 bits, the limit of TOML."""
    if isinstance(value, dict):
        return all(map(_fits, value.values()))
    if isinstance(value, list):
        return all(map(_fits, value))
    return not isinstance(value, int) or -(2**63) <= value < 2**63


_CONTACT_TABLE: TypeAdapter[Any] = TypeAdapter(ContactTable)


def tool_of(table: Any) -> MovedTool:
    """Return the tool of a table that has the keys of `ToolTable`. Raises ScenarioError."""
    try:
        return ToolTable.model_validate(table).tool()
    except ValidationError as error:
        raise ScenarioError("; ".join(format_errors(error, ToolTable, format_location))) from None


def contacts_of(table: Any) -> tuple[Contact, ...]:
    """Return the contacts of a table that has the same keys as in a scenario file. Raises ScenarioError."""
    try:
        return tuple(_CONTACT_TABLE.validate_python(table).contacts())
    except ValidationError as error:
        raise ScenarioError("; ".join(format_errors(error, ContactTable, format_location))) from None
