"""The configuration: every key, its default and its span, in one table; files and examples derive from it."""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from instrument.calibration.applied import calibrated
from instrument.calibration.file import Calibration
from instrument.calibration.file import load as load_calibration
from instrument.chain import ChainSettings
from instrument.config.sections import (
    BalloonSection,
    Can,
    CircuitSection,
    Events,
    IdentitySection,
    Local,
    MeasurementSection,
    Modbus,
    ModbusRtu,
    Page,
    Rig,
    Safety,
)
from instrument.errors import ConfigurationError
from instrument.model import Balloon, Circuit, Law
from instrument.model.uncertainty import ModelErrors
from instrument.settings import Identity, Settings
from instrument.tables import Section, checked, span_of, tables_of, toml_of

__all__ = [
    "Can",
    "Configuration",
    "MeasurementSection",
    "Page",
    "Safety",
    "example",
    "load",
    "parse",
    "read",
]


class Configuration(Section):
    """A whole instrument.toml."""

    rig: Rig = Rig()
    balloon: BalloonSection = BalloonSection()
    circuit: CircuitSection = CircuitSection()
    measurement: MeasurementSection = MeasurementSection()
    safety: Safety = Safety()
    modbus: Modbus = Modbus()
    modbus_rtu: ModbusRtu = ModbusRtu()
    can: Can = Can()
    events: Events = Events()
    local: Local = Local()
    page: Page = Page()
    identity: IdentitySection = IdentitySection()
    _calibration: Calibration | None = None

    @property
    def hash(self) -> int:
        """CRC-32 of all values and the calibration: two instruments with the same hash measure alike."""
        calibration = self._calibration.model_dump_json() if self._calibration else ""
        return zlib.crc32((self.model_dump_json() + calibration).encode())

    @property
    def calibration(self) -> dict[str, Any] | None:
        """The calibration as its file has it, None without."""
        return self._calibration.model_dump(mode="json") if self._calibration else None

    @property
    def doubt(self) -> str:
        """What an instrument that is of use would not have, empty for nothing."""
        served = self.modbus.enabled or self.modbus_rtu.enabled or self.can.enabled
        return "" if served else "no bus is enabled (modbus, modbus_rtu, can): nobody can see or ask anything"

    @property
    def calibration_date(self) -> int:
        """Date of the calibration as yyyymmdd, 0 where never."""
        return self._calibration.date_code if self._calibration else self.identity.calibration_date

    def calibrated_by(self, calibration: Calibration) -> Configuration:
        """The same with a calibration. Raises ConfigurationError where it is another balloon's or law's."""
        if calibration.balloon_id != self.balloon.id:
            raise ConfigurationError(
                f"balloon.id = {self.balloon.id}, and the calibration is of balloon {calibration.balloon_id}"
            )
        calibrated(self._chain, calibration)
        configuration = self.model_copy()
        configuration._calibration = calibration
        return configuration

    @property
    def chain(self) -> ChainSettings:
        """What turns counts into newtons, the calibration applied."""
        return calibrated(self._chain, self._calibration) if self._calibration else self._chain

    @property
    def _chain(self) -> ChainSettings:
        return ChainSettings(
            balloon=Balloon(**self.balloon.model_dump(exclude={"id"})),
            circuit=Circuit(**self.circuit.model_dump()),
            law=Law(**self.measurement.model_dump(include={"method", "switch", "low"})),
            model=ModelErrors.of(self.measurement.method),
            **self.measurement.model_dump(include={"filter_s", "tube_s"}),
        )

    def settings(self) -> Settings:
        """What the core needs."""
        return Settings(
            chain=self.chain,
            identity=Identity(
                serial_number=self.identity.serial_number,
                calibration_date=self.calibration_date,
                configuration_hash=self.hash,
                balloon_id=self.balloon.id,
            ),
            **self.safety.model_dump(),
        )


def beside(path: Path, name: str) -> Path | None:
    """The file that a configuration at `path` names, None for an empty name.

    One that comes through a pipe lies nowhere: then it is the current folder's.
    """
    folder = Path() if path.is_relative_to("/dev") else path.parent
    return folder / name if name else None


def load(path: Path) -> Configuration:
    """Configuration of a TOML file, with the calibration that it names.

    Raises ConfigurationError with file, key and allowed span.
    """
    configuration = read(path)
    if not configuration.measurement.calibration:
        return configuration
    file = path.parent / configuration.measurement.calibration
    try:
        return configuration.calibrated_by(load_calibration(file))
    except ConfigurationError as error:
        raise ConfigurationError(f"{path}: measurement.calibration: {error}") from None


def read(path: Path) -> Configuration:
    """Configuration of a TOML file as it stands, without its calibration. Raises ConfigurationError."""
    remedy = f"pneuforce config --example > {path} writes one"
    tables = tables_of(path, remedy)
    if not tables:
        raise ConfigurationError(f"{path}: no table in it, as in a file that was never written out; {remedy}")
    return parse(tables, str(path))


def parse(tables: dict[str, Any], name: str) -> Configuration:
    """Configuration of the tables of a file called `name`."""
    return checked(Configuration, tables, name)


def example() -> str:
    """An instrument.toml with every key, its default, its meaning and its span."""
    lines = ["# instrument.toml: every key with its default. Delete what you do not change.", ""]
    for name, field in Configuration.model_fields.items():
        section = field.annotation
        assert isinstance(section, type)
        assert issubclass(section, BaseModel)
        lines += [f"# {section.__doc__}", f"[{name}]"]
        for key, schema in section.model_json_schema()["properties"].items():
            lines += [
                f"# {schema['description']}; {span_of(schema)}",
                f"{key} = {toml_of(schema['default'])}",
            ]
        lines.append("")
    return "\n".join(lines)
