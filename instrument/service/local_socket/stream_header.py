"""Header of the stream: the first entry that a subscriber receives."""

from __future__ import annotations

import time
from collections.abc import Iterable
from importlib.metadata import version
from typing import Any

from pneuforce.instrument.config import Configuration
from pneuforce.instrument.core.faults import described
from pneuforce.registers.map import MAP_VERSION
from pneuforce.registers.map_hash import MAP_HASH


def stream_header(configuration: Configuration, simulated: bool, faults: Iterable[int]) -> dict[str, Any]:
    """Return the identity and the configuration of the instrument."""
    return {
        "version": version("pneuforce"),
        "map_version": MAP_VERSION,
        "map_hash": f"{MAP_HASH:08x}",
        "configuration": configuration.model_dump(mode="json"),
        "calibration": configuration.calibration,
        "force_range_kpa": configuration.force_range_kpa,
        "tube_time_constant_s": configuration.chain.tube_time_constant_s,
        "configuration_hash": configuration.hash_text,
        "signatures": {name: str(each) for name, each in configuration.signatures._asdict().items()},
        "serial_number": configuration.identity.serial_number,
        "simulated": simulated,
        "faults": [described(code) for code in faults],
        "utc_us": time.time_ns() // 1000,
    }
