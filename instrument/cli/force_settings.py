"""Settings of a force estimate: from the options of a command, or from the configuration of an instrument."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration.estimation import Grip, estimation_settings
from pneuforce.instrument.cli.output import progress
from pneuforce.instrument.config import load
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.force_tables import force_table
from pneuforce.instrument.model import ForceLaw
from pneuforce.instrument.model.law import Low, MethodName, Switch


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceOptions:
    """Options that select the force model. An option that is not given is None."""

    config: Path | None = None
    method: MethodName | None = None
    switch: Switch | None = None
    low: Low | None = None
    grip: float | None = None
    grip_std: float | None = None
    pressed_sides: int | None = None
    calibration: Path | None = None

    def settings(self) -> ChainSettings:
        """Return the settings of the measuring chain.

        With a configuration, the settings are those of `pneuforce run` with this configuration. Otherwise,
        the balloon, the circuit and the law are those of the paper. A force calibration for another method is
        not used. Raises ConfigurationError if a file is invalid, or if an option contradicts another option.
        """
        chain = self._settings_of_options() if self.config is None else self._settings_of_config(self.config)
        if chain.law.method == "membrane":
            with progress("force table of the balloon") as report:
                force_table(chain.balloon, chain.circuit, chain.law.sides, report)
        return chain

    def _settings_of_options(self) -> ChainSettings:
        law = ForceLaw(
            method=self.method or "energetic",
            switch=self.switch or "paper",
            low=self.low or "line",
            sides=self.pressed_sides or 1,
        )
        return estimation_settings(law, Grip(self.grip, self.grip_std), self.calibration)

    def _settings_of_config(self, config: Path) -> ChainSettings:
        names = [field.name for field in fields(self) if field.name != "config"]
        given = [f"--{name.replace('_', '-')}" for name in names if getattr(self, name) is not None]
        if given:
            raise ConfigurationError(
                f"{', '.join(given)} cannot be used with --config: {config} determines the force model"
            )
        return load(config).chain
