"""Log of the causes of maintenance, each with its remedy, when a cause begins and when it ends."""

from __future__ import annotations

import logging
from collections.abc import Mapping

from pneuforce.instrument.core.maintenance import maintenance_causes
from pneuforce.instrument.core.state import InstrumentState
from pneuforce.registers.advice import MAINTENANCE_ADVICE

log = logging.getLogger("pneuforce")

#: Line at the end of each cause that is logged here. The lines about the CAN bus and about the firmware
#: contain their remedies already.
_ENDS: Mapping[str, str] = {
    "leak": "maintenance: no leak was found in the last minute, or the balloon was replaced",
    "tube_unproven": "maintenance: a proof test has passed, or the balloon was replaced",
    "ambient_missing": "maintenance: the ambient pressure was written",
    "clock_inaccurate": "maintenance: the clock of the board is within its tolerance again",
    "event_log_failed": "maintenance: the event log can be written again",
    "recording_failed": "maintenance: a new recording has started",
    "certificate_expiring": "maintenance: the certificate, or the list of revoked certificates, was replaced",
}


class MaintenanceLog:
    """Output channel that logs when a cause begins and ends."""

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
