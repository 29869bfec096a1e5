"""Calibration to which a step adds its part: the file to write, otherwise the configured calibration."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration import file
from pneuforce.instrument.calibration.file import Calibration
from pneuforce.instrument.config import Configuration, read, resolve_path
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.support.atomic_file import check_writable


class CalibrationTarget(NamedTuple):
    """Calibration file to write, and configuration of the instrument."""

    out: Path | None
    config: Path | None


class PreviousCalibration(NamedTuple):
    """Configuration and calibration of the instrument before the new part is added."""

    configuration: Configuration
    calibration: Calibration
    source: Path | None  #: file that the calibration was read from; None if the calibration is empty
    notes: tuple[str, ...]  #: messages for the user: which of the calibration files is used

    @classmethod
    def of(cls, target: CalibrationTarget) -> PreviousCalibration:
        """Read the files. Raises ConfigurationError if a file is invalid or `target.out` is not writable."""
        if target.out is not None:
            check_writable(target.out)
        configuration = read(target.config) if target.config else Configuration()
        configured = None if target.config is None else _configured_file(target.config, configuration)
        name = f"{configured}, which {target.config} names"
        if target.out is not None and target.out.exists():
            other = configured is not None and configured.resolve() != target.out.resolve()
            notes = (f"the parts in {name}, are not used, because {target.out} exists",) if other else ()
            return cls(configuration, _load(target.out, configuration), target.out, notes)
        if configured is None:
            return cls(configuration, file.empty(configuration.balloon.id), None, ())
        notes = (f"all other parts are those in {name}",)
        return cls(configuration, _load(configured, configuration), configured, notes)

    @property
    def chain(self) -> ChainSettings:
        """Return the settings of the measuring chain without a force calibration.

        A new force calibration is fitted to the uncorrected force. The other parts do not depend on it.
        """
        calibration = self.calibration.model_copy(update={"force": None})
        return self.configuration.with_calibration(calibration).chain

    @property
    def for_grip(self) -> ChainSettings:
        """Return the settings with method "membrane", without a calibrated grip."""
        measurement = self.configuration.measurement.model_copy(update={"method": "membrane"})
        configuration = self.configuration.model_copy(update={"measurement": measurement})
        calibration = self.calibration.model_copy(update={"force": None, "grip": None})
        return configuration.with_calibration(calibration).chain


def _load(path: Path, configuration: Configuration) -> Calibration:
    """Return the calibration in a file. Raises ConfigurationError if it belongs to another balloon."""
    calibration = file.load(path)
    if calibration.balloon_id != configuration.balloon.id:
        raise ConfigurationError(
            f"{path} belongs to balloon {calibration.balloon_id}, but the configuration has balloon.id = "
            f"{configuration.balloon.id}: correct the number, or write to another file with --out"
        )
    return calibration


def _configured_file(config: Path, configuration: Configuration) -> Path | None:
    """Return the calibration file that the configuration names; None if there is no such file.

    A configuration can name its calibration file before the first step of the calibration has written it.
    """
    path = resolve_path(config, configuration.measurement.calibration)
    return path if path is not None and path.exists() else None
