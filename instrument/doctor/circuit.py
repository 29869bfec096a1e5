"""Checks of the pneumatic circuit by a test inflation: filling, settling, leak, inlet valve, venting."""

from __future__ import annotations

import math
from itertools import groupby, pairwise

from pneuforce.instrument.core.faults import name_of
from pneuforce.instrument.core.reject_reason import REMEDIES, RejectReason
from pneuforce.instrument.doctor.causes import CAUSES, INFLATED, NOT_EMPTIED, causes_of
from pneuforce.instrument.doctor.check import RUN_AGAIN, Check, CheckResult, graded, unchecked
from pneuforce.instrument.doctor.examination import Examination, ExaminationStage, ExaminedSample
from pneuforce.protocol.frames import BoardState, Fault
from pneuforce.protocol.limits import FILL_KPA_PER_S, HALVING_FROM_KPA, HALVING_TIME_S
from pneuforce.support.counted import counted

NAMES = ("filling", "settling", "leak", "inlet valve", "venting")
FILLING, SETTLING, LEAK, INLET, VENTING = NAMES
#: Allowed relative deviation from the rate or time at commissioning: limits for PASS and for WARNING. A
#: larger deviation means that the circuit was changed.
DEVIATION = (0.4, 0.6)
SETTLE_S, BAND_KPA, MAX_VALVE_ACTIONS = 8.0, 0.1, 20
#: Allowed pressure change in 20 s: limits for PASS and for WARNING. The limits include the creep of a new
#: latex balloon and the cooling of the gas.
CHANGE_KPA = (0.1, 0.5)
CHANGE_TIME_S = 20.0
#: Allowed steady rise in 20 s while both valves are closed: limits for PASS and for WARNING. Gas that warms
#: up by a few kelvins causes less than 0.2 kPa.
RISE_KPA = (0.1, 0.2)
FALLING_ADVICE = (
    "check the joints with soapy water; a new balloon creeps in its first minute: let it rest inflated"
)
INLET_ADVICE = (
    "clean or replace the valve: the closed inlet valve leaks; if the balloon was touched or warmed, let it "
    f"rest and {RUN_AGAIN}"
)


def circuit_checks(examination: Examination) -> list[Check]:
    """Return the checks of filling, settling, leak, inlet valve and venting.

    The rate of filling and the time of venting are compared with their values at commissioning, which are in
    `pneuforce.protocol.limits`.
    """
    if examination.inflate_kpa is None:
        return [
            unchecked(name, "this check needs --inflate 5.0, which inflates the balloon") for name in NAMES
        ]
    if not examination.done:
        return [unchecked(name, "interrupted", RUN_AGAIN) for name in NAMES]
    if examination.obstacle:
        advice = f"follow the advice of the failed checks, then {RUN_AGAIN}"
        return [unchecked(name, f"not inflated: {examination.obstacle}", advice) for name in NAMES]
    filling = examination.samples_of(ExaminationStage.FILLING)
    if not filling:
        reason = examination.reject_reason
        if reason is RejectReason.NONE:
            return _failed_filling("the sensor has no zero", REMEDIES[RejectReason.NOT_ZEROED])
        return _failed_filling(f"rejected: {reason}", REMEDIES[reason])
    held = examination.samples_of(ExaminationStage.LEAK_TEST)
    if not held:
        finding = f"{examination.inflate_kpa:g} kPa were not reached{_first_fault(examination)}"
        return _failed_filling(finding, causes_of(examination.instrument.faults) or CAUSES[Fault.NO_RISE])
    return [
        _filling(filling),
        _settling(filling, held, examination.inflate_kpa),
        _leak(held, examination, examination.inflate_kpa),
        _inlet(held, examination, examination.inflate_kpa),
        _venting(examination.samples_of(ExaminationStage.VENTING), held, examination),
    ]


def _failed_filling(finding: str, advice: str) -> list[Check]:
    """Return the check of the filling as failed, and mark all later checks as not reached."""
    failed = Check(FILLING, CheckResult.FAIL, finding, advice)
    return [failed, *(unchecked(name, "not reached") for name in NAMES[1:])]


def _first_fault(examination: Examination) -> str:
    return "".join(f": {name_of(fault)}" for fault in list(examination.instrument.faults)[:1])


def _filling(samples: list[ExaminedSample]) -> Check:
    """Check the rate of rise from 20 % to 60 % of the highest pressure.

    In this range the inlet is open and the lag of the pressure has settled.
    """
    top_kpa = max(sample.pressure_kpa for sample in samples)
    took_s = _first_time_s(samples, 0.6 * top_kpa) - _first_time_s(samples, 0.2 * top_kpa)
    rate = 0.4 * top_kpa / took_s if took_s > 0 else math.nan
    finding = f"{rate:.2f} kPa/s, commissioned {FILL_KPA_PER_S:g}"
    advice = "check regulator, orifice and V_c; if far too fast, the tube is kinked"
    return _compared(FILLING, finding, rate / FILL_KPA_PER_S, advice)


def _first_time_s(samples: list[ExaminedSample], threshold_kpa: float) -> float:
    """Return the time of the first sample at or above a pressure, NaN if there is none."""
    return next((sample.t_s for sample in samples if sample.pressure_kpa >= threshold_kpa), math.nan)


def _compared(name: str, finding: str, ratio: float, advice: str) -> Check:
    """Return a check of `ratio`, a measured value relative to its value at commissioning."""
    deviation = abs(ratio - 1)
    passed, usable = (deviation <= limit for limit in DEVIATION)
    return graded(name, finding, advice, passed=passed, usable=usable)


def _settling(filling: list[ExaminedSample], held: list[ExaminedSample], setpoint_kpa: float) -> Check:
    settling_s = [sample.t_s for sample in filling if sample.state == BoardState.SETTLING]
    took_s = settling_s[-1] - settling_s[0] if settling_s else 0.0
    actions = sum(a.valves != b.valves for a, b in pairwise([*filling, held[0]]))
    start_kpa = [sample.pressure_kpa for sample in held if sample.t_s <= held[0].t_s + 0.5]
    deviation_kpa = math.fsum(start_kpa) / len(start_kpa) - setpoint_kpa
    if held[0].in_contact:
        return _touched(SETTLING, deviation_kpa)
    changes = counted(actions, "change")
    finding = f"{took_s:.1f} s, {changes} of the valves, deviation {deviation_kpa:+.3f} kPa"
    passed = took_s <= SETTLE_S and actions <= MAX_VALVE_ACTIONS and abs(deviation_kpa) <= BAND_KPA
    advice = (
        "check the orifice and the inlet valve: a larger orifice or a slower valve than commissioned causes "
        "an overshoot"
    )
    return graded(SETTLING, finding, advice, passed=passed, usable=abs(deviation_kpa) <= 2 * BAND_KPA)


def _touched(name: str, above_kpa: float) -> Check:
    """Return a check that a contact has made impossible. `above_kpa` is the rise above the setpoint."""
    advice = (
        f"remove the contact and {RUN_AGAIN}; if nothing touched the balloon, the closed inlet valve leaks"
    )
    return unchecked(name, f"the balloon was pressed ({above_kpa:+.2f} kPa)", advice)


def _leak(samples: list[ExaminedSample], examination: Examination, setpoint_kpa: float) -> Check:
    if not _held_long_enough(samples, examination):
        finding = f"was not held for {examination.leak_test_s:g} s{_first_fault(examination)}"
        return Check(LEAK, CheckResult.FAIL, finding, causes_of(examination.instrument.faults) or RUN_AGAIN)
    if any(sample.in_contact for sample in samples):
        return _touched(LEAK, max(sample.pressure_kpa for sample in samples) - setpoint_kpa)
    change_kpa = _closed_slope_kpa_per_s(samples) * CHANGE_TIME_S
    if change_kpa > RISE_KPA[0]:
        return unchecked(LEAK, f"the pressure rises by {change_kpa:.3f} kPa, which hides a leak", RUN_AGAIN)
    top_ups = sum(b.state == BoardState.SETTLING != a.state for a, b in pairwise(samples))
    without = f" without the gas of {counted(top_ups, 'top-up')}" if top_ups else ""
    rises_or_falls = "rises" if change_kpa > 0 else "falls"
    finding = f"{rises_or_falls} by {abs(change_kpa):.3f} kPa in {CHANGE_TIME_S:g} s{without}"
    passed, usable = (abs(change_kpa) <= limit_kpa for limit_kpa in CHANGE_KPA)
    return graded(LEAK, finding, FALLING_ADVICE, passed=passed, usable=usable)


def _held_long_enough(samples: list[ExaminedSample], examination: Examination) -> bool:
    return samples[-1].t_s - samples[0].t_s >= 0.9 * examination.leak_test_s


def _inlet(samples: list[ExaminedSample], examination: Examination, setpoint_kpa: float) -> Check:
    """Check that the pressure does not rise steadily while both valves are closed.

    A leak of the inlet raises the pressure in both halves of the leak test. A short contact does not.
    """
    if not _held_long_enough(samples, examination):
        return unchecked(INLET, "the balloon was not held long enough", "see the row leak")
    middle = len(samples) // 2
    halves = samples[:middle], samples[middle:]
    rises_kpa = [_closed_slope_kpa_per_s(half) * CHANGE_TIME_S for half in halves]
    passed, usable = (any(rise_kpa <= limit_kpa for rise_kpa in rises_kpa) for limit_kpa in RISE_KPA)
    if passed and any(sample.in_contact for sample in samples):
        return _touched(INLET, max(sample.pressure_kpa for sample in samples) - setpoint_kpa)
    finding = f"closed: rises steadily by {max(0.0, min(rises_kpa)):.3f} kPa in {CHANGE_TIME_S:g} s"
    return graded(INLET, finding, INLET_ADVICE, passed=passed, usable=usable)


def _closed_periods(samples: list[ExaminedSample]) -> list[list[ExaminedSample]]:
    """Return the samples of each period without a top-up or a proof test: both valves are closed."""
    by_state = groupby(samples, lambda sample: sample.state == BoardState.HOLDING)
    return [list(period) for is_holding, period in by_state if is_holding]


def _closed_slope_kpa_per_s(samples: list[ExaminedSample]) -> float:
    """Return the slope [kPa/s] of the pressure in the periods in which both valves are closed.

    A line through all samples would hide a leak, because top-ups replace the lost gas. All periods have the
    same slope and different offsets (least squares). The result is NaN if a pressure is NaN.
    """
    covariance = spread = 0.0
    for period in _closed_periods(samples):
        mean_s = math.fsum(sample.t_s for sample in period) / len(period)
        mean_kpa = math.fsum(sample.pressure_kpa for sample in period) / len(period)
        spread += math.fsum((sample.t_s - mean_s) ** 2 for sample in period)
        covariance += math.fsum((sample.t_s - mean_s) * (sample.pressure_kpa - mean_kpa) for sample in period)
    return covariance / spread if spread else math.nan


def _venting(samples: list[ExaminedSample], held: list[ExaminedSample], examination: Examination) -> Check:
    """Check the time that the vent needs to halve the pressure.

    A pressed balloon empties faster, so its time is not compared. From a pressure p the vent takes
    √(p / 8 kPa) times as long as from 8 kPa.
    """
    advice = f"{INFLATED}check the vent valve, its relay and the tube; do not use the rig"
    faults = [name_of(fault) for fault in examination.instrument.faults if fault in NOT_EMPTIED]
    if faults or not samples:
        return Check(VENTING, CheckResult.FAIL, ", ".join(faults) or "no samples", advice)
    start_kpa = max(sample.pressure_kpa for sample in samples[:50])
    halved_at_s = next((sample.t_s for sample in samples if sample.pressure_kpa <= start_kpa / 2), math.inf)
    took_s = halved_at_s - samples[0].t_s
    if held[-1].in_contact and took_s < math.inf:
        return _touched(VENTING, start_kpa - held[0].pressure_kpa)
    expected_s = HALVING_TIME_S * math.sqrt(start_kpa / HALVING_FROM_KPA) if start_kpa > 0 else math.nan
    finding = f"{start_kpa:.2f} kPa halved in {took_s:.2f} s, commissioned {expected_s:.2f} s"
    return _compared(VENTING, finding, took_s / expected_s, advice)
