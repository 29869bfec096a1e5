"""Configuration of an instrument: the file instrument.toml with its sections, keys, defaults and limits."""

from __future__ import annotations

import zlib
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from pneuforce.errors import ConfigurationError, ConfigurationFileError
from pneuforce.instrument.calibration.apply import apply_calibration
from pneuforce.instrument.calibration.file import Calibration
from pneuforce.instrument.calibration.file import parse as parse_calibration
from pneuforce.instrument.calibration.file import remedy as calibration_remedy
from pneuforce.instrument.config.mqtt_section import MqttSection
from pneuforce.instrument.config.network_sections import (
    CanSection,
    ModbusRtuSection,
    ModbusSection,
    ModbusSecuritySection,
    RdtSection,
    WebSection,
)
from pneuforce.instrument.config.paths import absolute_paths, resolve_path
from pneuforce.instrument.config.sections import (
    BalloonSection,
    CircuitSection,
    EventsSection,
    IdentitySection,
    LocalSection,
    MeasurementSection,
    RigSection,
    SafetySection,
)
from pneuforce.instrument.config.unused_settings import unused_settings
from pneuforce.instrument.core.settings import Identity, Settings
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import Balloon, Circuit, ForceLaw
from pneuforce.instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA
from pneuforce.instrument.signing.signed_file import FileSignatures, read_signed
from pneuforce.instrument.signing.trusted_keys import NO_TRUSTED_KEYS, TrustedKeys
from pneuforce.support.atomic_file import read_file
from pneuforce.support.toml_sections import (
    Section,
    decode_text,
    format_value,
    parse_tables,
    validate_tables,
)
from pneuforce.support.validation_errors import allowed_values

__all__ = [
    "CanSection",
    "Configuration",
    "MeasurementSection",
    "ModbusSection",
    "ModbusSecuritySection",
    "MqttSection",
    "RdtSection",
    "SafetySection",
    "WebSection",
    "absolute_paths",
    "example",
    "load",
    "load_with_problem",
    "parse",
    "read",
    "resolve_path",
]


class Configuration(Section):
    """Content of an instrument.toml."""

    rig: RigSection = RigSection()
    balloon: BalloonSection = BalloonSection()
    circuit: CircuitSection = CircuitSection()
    measurement: MeasurementSection = MeasurementSection()
    safety: SafetySection = SafetySection()
    modbus: ModbusSection = ModbusSection()
    modbus_security: ModbusSecuritySection = ModbusSecuritySection()
    modbus_rtu: ModbusRtuSection = ModbusRtuSection()
    can: CanSection = CanSection()
    rdt: RdtSection = RdtSection()
    events: EventsSection = EventsSection()
    local: LocalSection = LocalSection()
    web: WebSection = WebSection()
    mqtt: MqttSection = MqttSection()
    identity: IdentitySection = IdentitySection()
    _calibration: Calibration | None = None
    _file_warnings: tuple[str, ...] = ()
    _signatures: FileSignatures = FileSignatures()

    @property
    def hash(self) -> int:
        """Return the CRC-32 of all values and the calibration. Equal hashes mean equal settings."""
        calibration = self._calibration.model_dump_json() if self._calibration else ""
        return zlib.crc32((self.model_dump_json() + calibration).encode())

    @property
    def hash_text(self) -> str:
        """Return the hash as 8 hexadecimal digits, as in all texts and files."""
        return f"{self.hash:08x}"

    @property
    def calibration(self) -> dict[str, Any] | None:
        """Return the content of the calibration file; None if there is no calibration."""
        return self._calibration.model_dump(mode="json") if self._calibration else None

    @property
    def signatures(self) -> FileSignatures:
        """Return the signatures of the configuration file and of the calibration file."""
        return self._signatures

    @property
    def warning(self) -> str:
        """Return a warning about valid settings that are probably a mistake; empty if there is none."""
        buses = (self.modbus, self.modbus_security, self.modbus_rtu, self.can, self.rdt)
        served = any(bus.enabled for bus in buses)
        unserved = (
            "no bus is enabled (modbus, modbus_security, modbus_rtu, can, rdt): "
            "no master can read the instrument"
        )
        canopen = self.can.enabled and self.can.mode == "canopen"
        unnumbered = (
            "identity.serial_number is 0: give each CANopen node its own number, because LSS distinguishes "
            "the nodes by this number"
        )
        remarks = (
            (not served, unserved),
            (canopen and not self.identity.serial_number, unnumbered),
            (self.mqtt.sends_password_openly, "mqtt: the password is sent without encryption: use mqtts://"),
        )
        texts = [text for applies, text in remarks if applies]
        return "; ".join([*texts, *self.unused_settings, *self._file_warnings])

    @property
    def unused_settings(self) -> list[str]:
        """Return a sentence for each setting of the force that the force model does not use."""
        return unused_settings(self.measurement, self._calibration)

    @property
    def calibration_date(self) -> int:
        """Return the date of the calibration as yyyymmdd; 0 if there is none."""
        return self._calibration.date_code if self._calibration else self.identity.calibration_date

    def with_calibration(self, calibration: Calibration) -> Configuration:
        """Return a copy with a calibration.

        Raises ConfigurationError if the calibration belongs to another balloon or another force law.
        """
        if calibration.balloon_id != self.balloon.id:
            raise ConfigurationError(
                f"balloon.id = {self.balloon.id}, but the calibration belongs to balloon "
                f"{calibration.balloon_id}: correct the number, or use a calibration of this balloon"
            )
        apply_calibration(self._chain, calibration)
        configuration = self.model_copy()
        configuration._calibration = calibration
        return configuration

    @property
    def chain(self) -> ChainSettings:
        """Return the settings of the measuring chain, with the calibration."""
        return apply_calibration(self._chain, self._calibration) if self._calibration else self._chain

    @property
    def _chain(self) -> ChainSettings:
        measurement = self.measurement
        law = ForceLaw(
            sides=measurement.pressed_sides,
            **measurement.model_dump(include={"method", "switch", "low", "grip"}),
        )
        chain = ChainSettings.of(
            law, Balloon(**self.balloon.model_dump(exclude={"id"})), Circuit(**self.circuit.model_dump())
        )
        return replace(
            chain,
            input_uncertainties=replace(chain.input_uncertainties, grip=measurement.grip_std),
            **measurement.model_dump(
                include={"filter_time_constant_s", "tube_time_constant_s", "ambient_std_kpa"}
            ),
        )

    @property
    def force_range_kpa(self) -> tuple[float, float]:
        """Return the range of ΔP_i in which the instrument shows a force [kPa]."""
        return VALID_LOW_KPA, VALID_HIGH_KPA

    def settings(self, map_hash: int = 0) -> Settings:
        """Return the settings of the instrument core. The buses show `map_hash` to their peers."""
        return Settings(
            chain=self.chain,
            identity=Identity(
                serial_number=self.identity.serial_number,
                calibration_date=self.calibration_date,
                configuration_hash=self.hash,
                map_hash=map_hash,
                balloon_id=self.balloon.id,
                configuration_signature=self._signatures.configuration.state,
                calibration_signature=self._signatures.calibration.state,
            ),
            **self.measurement.model_dump(
                include={"reference_timeout_s", "ambient_timeout_s", "ambient_required"}
            ),
            require_released_firmware=self.rig.require_released_firmware,
            **self.safety.model_dump(),
        )


def load(path: Path, trusted: TrustedKeys = NO_TRUSTED_KEYS) -> Configuration:
    """Return the configuration of a TOML file, with the calibration that the file names.

    Raises ConfigurationFileError with file, key and allowed values.
    """
    configuration, problem = load_with_problem(path, trusted)
    if problem:
        raise ConfigurationFileError(f"{path}: {problem}")
    return configuration


def load_with_problem(path: Path, trusted: TrustedKeys = NO_TRUSTED_KEYS) -> tuple[Configuration, str]:
    """Return the configuration of a TOML file, and why its calibration cannot be used; "" if it can.

    The signatures of both files are checked with the trusted keys, before a file is parsed. Each file is read
    once. Raises ConfigurationFileError if the configuration file itself is invalid.
    """
    try:
        content, signature = read_signed(path, trusted, _remedy(path))
    except ConfigurationError as error:
        raise ConfigurationFileError(str(error)) from None
    configuration = _parse(content, path)
    signatures, warnings = FileSignatures(signature), []
    if file := resolve_path(path, configuration.measurement.calibration):
        from pneuforce.instrument.calibration.plausibility import warnings_about  # imports numpy

        try:
            content, signature = read_signed(file, trusted, calibration_remedy(file))
            calibration = parse_calibration(content, str(file))
        except ConfigurationError as error:
            return configuration, f"measurement.calibration: {error}"
        try:
            configuration = configuration.with_calibration(calibration)
        except ConfigurationError as error:
            return configuration, f"measurement.calibration: {file}: {error}"
        signatures = signatures._replace(calibration=signature)
        warnings = warnings_about(calibration, configuration.chain, date.today())
    configuration._signatures = signatures
    configuration._file_warnings = (*warnings, *signatures.warnings(trusted))
    return configuration, ""


def read(path: Path) -> Configuration:
    """Return the configuration of a TOML file without its calibration. Raises ConfigurationFileError."""
    try:
        content = read_file(path, _remedy(path))
    except ConfigurationError as error:
        raise ConfigurationFileError(str(error)) from None
    return _parse(content, path)


def _remedy(path: Path) -> str:
    return f"pneuforce config --example > {path} writes an example"


def _parse(content: bytes, path: Path) -> Configuration:
    """Return the configuration in the content of a file. Raises ConfigurationFileError with its cause."""
    try:
        tables = parse_tables(decode_text(content, str(path)), str(path))
        if not tables:
            raise ConfigurationError(f"{path}: the file contains no table; {_remedy(path)}")
        return parse(tables, str(path))
    except ConfigurationError as error:
        raise ConfigurationFileError(str(error)) from error


def parse(tables: dict[str, Any], name: str) -> Configuration:
    """Return the configuration of the tables of the file `name`. Raises ConfigurationError."""
    return validate_tables(Configuration, tables, name)


def example() -> str:
    """Return an instrument.toml with every key, its default, its meaning and its allowed values."""
    lines = ["# instrument.toml: every key with its default. Delete the keys that you do not change.", ""]
    for name, field in Configuration.model_fields.items():
        section = field.annotation
        assert isinstance(section, type)
        assert issubclass(section, BaseModel)
        lines += [f"# {section.__doc__}", f"[{name}]"]
        for key, schema in section.model_json_schema()["properties"].items():
            lines += [
                f"# {schema['description']}; {allowed_values(schema)}",
                f"{key} = {format_value(schema['default'])}",
            ]
        lines.append("")
    return "\n".join(lines)
