"""Log of the causes of maintenance that no other part of the host logs: leak, missing ambient pressure."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

from pneuforce.instrument.core.state import InstrumentState

log = logging.getLogger("pneuforce")


class _Cause(NamedTuple):
    is_present: Callable[[InstrumentState, float], bool]
    begins: str
    ends: str


def _misses_ambient(state: InstrumentState, now_s: float) -> bool:
    return state.settings.ambient_required and math.isnan(state.recent_ambient_kpa(now_s))


_CAUSES: Mapping[str, _Cause] = {
    "leak": _Cause(
        lambda state, _: state.chain.leak.detected,
        "maintenance required: the locked balloon leaks slowly: end the measurement soon, and examine the "
        "circuit with pneuforce doctor --inflate",
        "the locked balloon does not leak any more",
    ),
    "ambient": _Cause(
        _misses_ambient,
        "maintenance required: the configuration requires a measured ambient pressure, and none was written "
        "recently: write register 556 periodically, or set ambient_required = false",
        "the ambient pressure was written",
    ),
}


class MaintenanceLog:
    """Output channel that logs when a cause begins and ends. Other parts of the host log all other causes."""

    def __init__(self, state: InstrumentState) -> None:
        self._state = state
        self._present: set[str] = set()

    def on_sample(self, now_s: float) -> None:
        """Do nothing: the time of a sample does not matter."""

    def tick(self, now_s: float) -> None:
        """Log each cause that has begun or ended since the last tick."""
        present = {name for name, cause in _CAUSES.items() if cause.is_present(self._state, now_s)}
        for name in present - self._present:
            log.warning("%s", _CAUSES[name].begins)
        for name in self._present - present:
            log.info("%s", _CAUSES[name].ends)
        self._present = present
