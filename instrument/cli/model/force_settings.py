"""Settings of a force estimate: from the options of a command, or from the configuration of an instrument."""

from __future__ import annotations

from pathlib import Path

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration.estimation import Grip, LawChoice, estimation_settings
from pneuforce.instrument.calibration.file import load as load_calibration
from pneuforce.instrument.cli.model.force_options import ForceOptions
from pneuforce.instrument.cli.terminal.option_groups import given_options
from pneuforce.instrument.cli.terminal.output import progress
from pneuforce.instrument.config import load
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.force_tables import force_table


def force_settings(options: ForceOptions) -> ChainSettings:
    """Return the settings of the measuring chain.

    With a configuration, the settings are those of `pneuforce run` with this configuration. Otherwise, the
    balloon and the circuit are those of the calibration or of the paper. Raises ConfigurationError if a file
    is invalid, or if an option contradicts another option or the calibration.
    """
    chain = (
        _settings_of_options(options)
        if options.config is None
        else _settings_of_config(options.config, options)
    )
    if chain.law.method == "membrane":
        with progress("force table of the balloon") as report:
            force_table(chain.balloon, chain.circuit, chain.law.sides, report)
    return chain


def _settings_of_options(options: ForceOptions) -> ChainSettings:
    choice = LawChoice(options.method, options.switch, options.low, options.pressed_sides)
    calibration = None if options.calibration is None else load_calibration(options.calibration)
    return estimation_settings(choice, Grip(options.grip, options.grip_std), calibration)


def _settings_of_config(config: Path, options: ForceOptions) -> ChainSettings:
    given = given_options(options._replace(config=None))
    if given:
        raise ConfigurationError(
            f"{', '.join(given)} cannot be used with --config: {config} determines the force model"
        )
    return load(config).chain
