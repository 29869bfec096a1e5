"""Scenarios of the simulator on the command line."""

from __future__ import annotations

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.terminal.output import done_json, hanging
from pneuforce.sim.scenario import ScenarioError, library, load
from pneuforce.support.counted import counted


def check_scenario(name: str) -> str:
    """Return the name of a valid scenario. Raises ConfigurationError."""
    try:
        load(name)
    except ScenarioError as error:
        raise ConfigurationError(str(error)) from None
    return name


def list_scenarios(as_json: bool) -> str:
    """Return the names and descriptions of the scenarios: one line each, or one JSON object."""
    known = library()
    if as_json:
        return done_json(counted(len(known), "scenario"), scenarios=known)
    width = max(map(len, known))
    return "\n".join(
        f"{name:<{width}}  {hanging(description, width + 2)}" for name, description in known.items()
    )
