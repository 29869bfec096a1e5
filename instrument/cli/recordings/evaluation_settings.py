"""Configuration and calibration of `pneuforce evaluate`, and the facts that identify them in a report."""

from __future__ import annotations

import hashlib
import json
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration.file import Calibration, remedy
from pneuforce.instrument.calibration.file import parse as parse_calibration
from pneuforce.instrument.config import Configuration, parse, read, resolve_path
from pneuforce.instrument.recording.reader import Recording
from pneuforce.support.atomic_file import read_file

#: Sections of a recorded configuration that determine the force.
EVALUATED_SECTIONS = ("balloon", "circuit", "measurement")


class EvaluationSettings(NamedTuple):
    """Configuration with its calibration, and where the calibration comes from."""

    configuration: Configuration
    calibration: Path | None = None  #: calibration file, or the recording that contains the calibration
    calibration_sha256: str | None = None  #: SHA-256 of the calibration file, None without a file

    @classmethod
    def of(
        cls, recording: Recording, config: Path | None, calibration: Path | None, *, has_reference: bool
    ) -> EvaluationSettings:
        """Return the settings of the files, or else those of the recording. Raises ConfigurationError."""
        if config is None and calibration is None and not has_reference:
            raise ConfigurationError(
                "nothing to evaluate with: give --config or --calibration, or compare with --reference"
            )
        configuration = _recorded(recording) if config is None else read(config)
        if config is not None and calibration is None:
            calibration = resolve_path(config, configuration.measurement.calibration)
        if calibration is not None:
            return _with_file(configuration, calibration)
        return cls(configuration) if config else _with_recorded_calibration(configuration, recording)

    def facts(self) -> dict[str, Any]:
        """Return program version, hash of the configuration, and calibration as JSON data."""
        return {
            "version": version("pneuforce"),
            "configuration_hash": self.configuration.hash_text,
            "calibration": None if self.calibration is None else str(self.calibration),
            "calibration_sha256": self.calibration_sha256,
        }

    def summary(self) -> str:
        """Return the same facts as one line."""
        calibration = f"calibration {self.calibration}" if self.calibration else "no calibration"
        digest = f", SHA-256 {self.calibration_sha256}" if self.calibration_sha256 else ""
        hash_text = self.configuration.hash_text
        return f"pneuforce {version('pneuforce')}, configuration hash {hash_text}, {calibration}{digest}"


def _with_file(configuration: Configuration, file: Path) -> EvaluationSettings:
    content = read_file(file, remedy(file))
    used = configuration.with_calibration(parse_calibration(content, str(file)))
    return EvaluationSettings(used, file, hashlib.sha256(content).hexdigest())


def _recorded(recording: Recording) -> Configuration:
    """Return the configuration in the recording, without its calibration. Raises ConfigurationError.

    If another version of the program has written sections that are now invalid, only the sections that
    determine the force are used.
    """
    tables = recording.metadata.get("configuration")
    if not isinstance(tables, dict):
        raise ConfigurationError(f"{recording.path} contains no configuration: give --config")
    try:
        return parse(tables, str(recording.path))
    except ConfigurationError:
        used = {name: tables[name] for name in EVALUATED_SECTIONS if name in tables}
        return parse(used, str(recording.path))


def _with_recorded_calibration(configuration: Configuration, recording: Recording) -> EvaluationSettings:
    values = recording.metadata.get("calibration")
    if values is None:
        return EvaluationSettings(configuration)
    try:
        calibration = Calibration.model_validate_json(json.dumps(values))
    except ValidationError:
        raise ConfigurationError(
            f"{recording.path}: the recorded calibration is invalid: give --calibration"
        ) from None
    return EvaluationSettings(configuration.with_calibration(calibration), recording.path)
