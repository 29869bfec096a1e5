"""Instrument on a simulated rig that runs during a `with` statement."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from pneuforce.errors import ConfigurationError
from pneuforce.teststand.rig import LiveRig
from pneuforce.teststand.stack import start


@contextmanager
def simulated_rig(
    scenario: str | None = None,
    *,
    seed: int = 1,
    instrument: Mapping[str, Mapping[str, Any]] | None = None,
) -> Iterator[LiveRig]:
    """Start an instrument on a simulated rig as processes on free ports, and end them at the end.

    `scenario` is the name or the TOML file of a scenario; without a scenario, the simulated hand presses only
    on request. `seed` is the seed of all noise. `instrument` contains tables of the configuration, for
    example {"safety": {"force_limit_n": 2.0}}. Raises ConfigurationError if it is no such mapping, and
    ChildProcessFailed if a process does not start.

    Example:
        with pneuforce.testing.simulated_rig() as rig, pneuforce.connect(rig.url) as sensor:
            with sensor.hold(5.5):
                rig.press(1.5)
                print(sensor.read().force_n)
    """
    tables = instrument_tables(instrument or {})
    with ExitStack() as children:
        folder = Path(children.enter_context(tempfile.TemporaryDirectory(prefix="pneuforce-")))
        stack = start(children, folder / "rig", simulator_arguments(scenario, seed), tables)
        yield LiveRig(stack, tables.get("modbus", {}).get("unit", 1))


def instrument_tables(instrument: Any) -> dict[str, Mapping[str, Any]]:
    """Return the tables of a configuration. Raises ConfigurationError if they are not mappings by name."""
    if not (isinstance(instrument, Mapping) and all(isinstance(t, Mapping) for t in instrument.values())):
        raise ConfigurationError(
            f"instrument = {instrument!r} is invalid: it must contain tables of instrument.toml, for example "
            '{"safety": {"force_limit_n": 2.0}}'
        )
    return dict(instrument)


def simulator_arguments(scenario: str | None, seed: int) -> list[str]:
    """Return the arguments of `pneuforce sim run`."""
    hand = ["--no-hand"] if scenario is None else ["--scenario", str(scenario)]
    return [*hand, "--seed", str(seed)]
