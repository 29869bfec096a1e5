"""Causes of the status bit `maintenance_required` (NAMUR NE 107): the instrument works, but needs a check."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from pneuforce.instrument.core.state import InstrumentState

#: Condition of each cause at a time [s]. `registers/codes.py` assigns a bit to each name.
_CONDITIONS: Mapping[str, Callable[[InstrumentState, float], bool]] = {
    "leak": lambda state, _: state.chain.leak.detected or "leak" in state.faults.status,
    "can_down": lambda state, _: state.can_down,
    "clock_inaccurate": lambda state, _: state.raw is not None and state.raw.clock_off,
    "event_log_failed": lambda state, _: state.log_down,
    "recording_failed": lambda state, _: state.recording_down,
    "certificate_expiring": lambda state, _: state.certificate_expiring,
    "ambient_missing": lambda state, now_s: _misses_ambient(state, now_s),
    "firmware_unknown": lambda state, _: state.firmware is not None and not state.firmware.is_released,
    "tube_unproven": lambda state, _: state.proof_tests.tube_unproven,
}


def maintenance_causes(state: InstrumentState, now_s: float) -> frozenset[str]:
    """Return the names of the causes that are present at `now_s` [s]; empty if no maintenance is required."""
    return frozenset(name for name, is_present in _CONDITIONS.items() if is_present(state, now_s))


def _misses_ambient(state: InstrumentState, now_s: float) -> bool:
    return state.settings.ambient_required and math.isnan(state.recent_ambient_kpa(now_s))
