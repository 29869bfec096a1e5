"""Status: names of the conditions that are true now. The register map assigns a bit to each name."""

from __future__ import annotations

import math

from pneuforce.instrument.core.maintenance import maintenance_causes
from pneuforce.instrument.core.state import InstrumentState
from pneuforce.instrument.measurement.measurement import Measurement, Quality
from pneuforce.instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA
from pneuforce.protocol.frames import BoardKind, BoardState
from pneuforce.protocol.limits import HELD

STALE_S = 0.1
OLD_BASELINE_S = 60.0
MAX_DRIFT_KPA_PER_S = 0.02
_NO_FORCE_AT_PRESSURE = Quality.OUT_OF_RANGE | Quality.NO_SOLUTION | Quality.FLAT


def status_of(state: InstrumentState, m: Measurement, now_s: float) -> frozenset[str]:
    """Return the names of the conditions that are true at `now_s`.

    `m` is the measurement that the buses show. It has no values if it is stale.
    """
    names = {name for name, is_true in _conditions(state, m, now_s) if is_true}
    names |= state.faults.status
    if "vent_fault" in names:
        names.discard("vented")  # behind a blocked tube, the sensor does not measure the balloon
    if state.faults or "stale_or_lost" in names:
        names |= {"failure", "any_failure"}
    if "out_of_range" in names:
        names.add("out_of_specification")
    if maintenance_causes(state, now_s):
        names.add("maintenance_required")
    if Quality.TESTING in m.quality or not names & {"holding", "failure"}:
        names.add("function_check")
    return frozenset(names)


def _conditions(state: InstrumentState, m: Measurement, now_s: float) -> tuple[tuple[str, bool], ...]:
    stale, lost = not state.age_s(now_s) <= STALE_S, state.link_lost(now_s)
    shown = state.sample is not None and not stale and not state.tripped
    board_state = state.sample.state if state.sample and shown else None
    tracker = state.chain.tracker
    holding = board_state in HELD
    baseline_kpa = m.baseline_kpa - state.chain.reference_kpa
    testing = Quality.TESTING in m.quality  # a proof test has no baseline, because it moves the pressure
    outside = holding and not testing and not VALID_LOW_KPA <= baseline_kpa <= VALID_HIGH_KPA
    drifting = holding and not abs(tracker.drift_kpa_per_s) <= MAX_DRIFT_KPA_PER_S
    old = tracker.baseline_unknown or tracker.baseline_age_s > OLD_BASELINE_S
    return (
        ("in_contact", m.in_contact),
        ("inflating", board_state in (BoardState.INFLATING, BoardState.SETTLING)),
        ("holding", holding),
        ("proof_test_overdue", holding and state.proof_tests.overdue(state.settings.proof_test_s)),
        ("vented", state.vented(now_s) and not stale),
        ("interpolated", Quality.INTERPOLATED in m.quality and math.isfinite(m.force_n)),
        ("out_of_range", outside or bool(m.quality & _NO_FORCE_AT_PRESSURE)),
        ("force_high_alarm", state.force_limit_exceeded and not stale),
        ("force_high_alarm_2", state.alarm_2.active and not (stale and state.tripped)),
        ("stale", stale),
        ("link_lost", lost),
        ("stale_or_lost", stale or lost),
        ("simulated", state.hello is not None and state.hello.board != BoardKind.REAL),
        ("not_zeroed", not state.chain.zero.taken),
        ("calibrated", state.chain.settings.correction is not None),
        ("write_protect", state.settings.write_protect),
        ("can_down", state.can_down),
        ("baseline_old", holding and (drifting or old or not state.reference_known(now_s))),
        ("force_valid", math.isfinite(m.force_n + m.force_std_n) and not stale),
    )
