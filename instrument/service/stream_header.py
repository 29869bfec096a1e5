"""The first entry that a listener gets: which instrument this is, and how it is set."""

from __future__ import annotations

import time
from collections.abc import Iterable
from importlib.metadata import version
from typing import Any

from instrument.config import Configuration
from instrument.faults import name_of
from registers.map import MAP_HASH, MAP_VERSION


def begin_of(configuration: Configuration, simulated: bool, faults: Iterable[int]) -> dict[str, Any]:
    """The facts of a BEGIN entry; an operator's token is masked in them."""
    return {
        "version": version("pneuforce"),
        "map_version": MAP_VERSION,
        "map_hash": f"{MAP_HASH:08x}",
        "configuration": configuration.model_dump(mode="json"),
        "calibration": configuration.calibration,
        "configuration_hash": f"{configuration.hash:08x}",
        "serial_number": configuration.identity.serial_number,
        "simulated": simulated,
        "faults": [name_of(code) for code in faults],
        "utc_us": time.time_ns() // 1000,
    }
