"""Log of the causes of maintenance that no other part of the host logs: leak, ambient pressure, tube."""

from __future__ import annotations

import logging
from collections.abc import Mapping

from pneuforce.instrument.core.maintenance import maintenance_causes
from pneuforce.instrument.core.state import InstrumentState
from pneuforce.registers.advice import MAINTENANCE_ADVICE

log = logging.getLogger("pneuforce")

#: Line at the end of each cause that is logged here.
_ENDS: Mapping[str, str] = {
    "leak": "maintenance: no leak was found in the last minute, or the balloon was replaced",
    "tube_unproven": "maintenance: a proof test has passed, or the balloon was replaced",
    "ambient_missing": "maintenance: the ambient pressure was written",
}


class MaintenanceLog:
    """Output channel that logs when a cause begins and ends. Other parts of the host log all other causes."""

    def __init__(self, state: InstrumentState) -> None:
        self._state = state
        self._present: frozenset[str] = frozenset()

    def on_sample(self, now_s: float) -> None:
        """Do nothing: the time of a sample does not matter."""

    def tick(self, now_s: float) -> None:
        """Log each cause that has begun or ended since the last tick."""
        present = maintenance_causes(self._state, now_s) & _ENDS.keys()
        for name in present - self._present:
            log.warning("maintenance required: %s %s", *MAINTENANCE_ADVICE[name])
        for name in self._present - present:
            log.info("%s", _ENDS[name])
        self._present = present
