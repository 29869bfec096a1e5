"""The simulator's scenarios on the command line."""

from __future__ import annotations

import json

from instrument.errors import ConfigurationError
from sim.scenario import ScenarioError, library, load


def checked(name: str) -> str:
    """The name of a scenario that can be played. Raises ConfigurationError."""
    try:
        load(name)
    except ScenarioError as error:
        raise ConfigurationError(str(error)) from None
    return name


def listed(as_json: bool) -> str:
    """Names and what they are: a line each, or one JSON object."""
    known = library()
    if as_json:
        return json.dumps(known, ensure_ascii=False)
    width = max(map(len, known))
    return "\n".join(f"{name:<{width}}  {doc}" for name, doc in known.items())
