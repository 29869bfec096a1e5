"""Status: the set of named conditions that hold now. The register map gives each name its bit."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from instrument.measurement import Measurement, Quality
from instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA
from instrument.rig.frames import BoardKind, BoardState

if TYPE_CHECKING:
    from instrument.core import Instrument

STALE_S = 0.1
OLD_BASELINE_S = 60.0
DRIFTING_KPA_PER_S = 0.02


def status_of(instrument: Instrument, m: Measurement, now_s: float) -> frozenset[str]:
    """Names of the conditions that hold; `m` is the measurement as shown, empty where it is stale."""
    names = {name for name, holds in _conditions(instrument, m, now_s) if holds}
    names |= instrument.faults.status
    if instrument.faults or "stale_or_lost" in names:
        names |= {"failure", "any_failure"}
    if "out_of_range" in names:
        names.add("out_of_specification")
    if "leak" in names or _wants_maintenance(instrument):
        names.add("maintenance")
    if not names & {"holding", "failure"}:
        names.add("function_check")
    return frozenset(names)


def _wants_maintenance(instrument: Instrument) -> bool:
    clock_off = instrument.raw is not None and instrument.raw.clock_off
    neighbours = instrument.can_down or instrument.log_down or instrument.recording_down
    return neighbours or clock_off or instrument.chain.leak.seen


def _conditions(instrument: Instrument, m: Measurement, now_s: float) -> tuple[tuple[str, bool], ...]:
    stale, lost = not instrument.age_s(now_s) <= STALE_S, instrument.link_lost(now_s)
    shown = instrument.sample is not None and not stale and not instrument.tripped
    state = instrument.sample.state if instrument.sample and shown else None
    tracker = instrument.chain.tracker
    holding = state == BoardState.HOLDING
    unsuited = (
        holding and not VALID_LOW_KPA <= m.initial_kpa - instrument.chain.reference_kpa <= VALID_HIGH_KPA
    )
    drifting = holding and not abs(tracker.drift_kpa_per_s) <= DRIFTING_KPA_PER_S
    return (
        ("in_contact", m.in_contact),
        ("inflating", state in (BoardState.INFLATING, BoardState.SETTLING)),
        ("holding", holding),
        ("vented", instrument.vented(now_s) and not stale),
        ("interpolated", Quality.INTERPOLATED in m.quality),
        ("out_of_range", unsuited or Quality.NO_SOLUTION in m.quality),
        ("force_limit", instrument.force_limit_passed and not stale),
        ("stale", stale),
        ("link_lost", lost),
        ("stale_or_lost", stale or lost),
        ("simulated", instrument.hello is not None and instrument.hello.board != BoardKind.REAL),
        ("not_zeroed", not instrument.chain.zero.taken),
        ("calibrated", instrument.chain.settings.correction is not None),
        ("write_lock", instrument.settings.write_lock),
        ("can_down", instrument.can_down),
        ("baseline_old", holding and (drifting or tracker.lost or tracker.baseline_age_s > OLD_BASELINE_S)),
        ("force_valid", math.isfinite(m.force_n + m.force_std_n) and not stale),
    )
