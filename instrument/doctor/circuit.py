"""Checks of the circuit, from an inflation that was asked for: ramp, leak, vent."""

from __future__ import annotations

import math
from itertools import pairwise

from instrument.doctor.causes import INFLATED, causes_of
from instrument.doctor.check import AGAIN, Check, Verdict, graded, unchecked
from instrument.doctor.examination import Examination, Row, Stage
from instrument.faults import HostFault, name_of
from instrument.refusal import Refusal
from instrument.rig.frames import BoardState, Fault
from instrument.rig.limits import FILL_KPA_PER_S, HALVED_KPA, HALVING_S

NAMES = ("filling", "settling", "leak", "venting")
#: What a commissioned time may change by before it is another circuit.
SHARE = (0.4, 0.6)
SETTLE_S, BAND_KPA, MOST_ACTIONS = 8.0, 0.1, 20
#: Fall in 20 s: the creep of a fresh latex balloon and the gas that cools are in it.
FALL_KPA = (0.1, 0.5)
FALL_OVER_S = 20.0
FALLS = "soap water on the joints; the first minute of a new balloon creeps: let it rest inflated"
RISES = "an inlet valve that does not shut; or the balloon was touched"
NOT_EMPTIED = {Fault.VENT_SHUT, Fault.OCCLUSION, HostFault.NOT_VENTED}


def circuit_checks(examination: Examination) -> list[Check]:
    """Ramp, leak and vent against what was commissioned (`instrument.rig.limits`)."""
    if examination.inflate_kpa is None:
        return [unchecked(name, "--inflate 5.0 inflates the balloon for it") for name in NAMES]
    if not examination.done:
        return [unchecked(name, "interrupted", AGAIN) for name in NAMES]
    filling = examination.rows_of(Stage.FILLING)
    if not filling:
        why = "there is no zero" if examination.refusal is Refusal.NONE else f"refused: {examination.refusal}"
        return [Check(NAMES[0], Verdict.BAD, why, "see the checks above"), *_without(NAMES[1:])]
    leaking = examination.rows_of(Stage.LEAKING)
    if not leaking:
        found = f"{examination.inflate_kpa:g} kPa were not reached{_because(examination)}"
        advice = causes_of(examination.instrument.faults)
        return [Check(NAMES[0], Verdict.BAD, found, advice), *_without(NAMES[1:])]
    return [
        _filling(filling),
        _settling(filling, leaking, examination.inflate_kpa),
        _leak(leaking, examination, examination.inflate_kpa),
        _venting(examination.rows_of(Stage.VENTING), examination, examination.inflate_kpa),
    ]


def _because(examination: Examination) -> str:
    return "".join(f": {name_of(fault)}" for fault in list(examination.instrument.faults)[:1])


def _without(names: tuple[str, ...]) -> list[Check]:
    return [unchecked(name, "not reached") for name in names]


def _filling(rows: list[Row]) -> Check:
    """The first half of the way: there the inlet is open, and the pressure's lag is over."""
    top_kpa = max(row.pressure_kpa for row in rows)
    took_s = _first_s(rows, 0.6 * top_kpa) - _first_s(rows, 0.2 * top_kpa)
    rate = 0.4 * top_kpa / took_s if took_s > 0 else math.nan
    share = rate / FILL_KPA_PER_S
    found = f"{rate:.2f} kPa/s, commissioned {FILL_KPA_PER_S:g}"
    return _compared(NAMES[0], found, share, "regulator, orifice, V_c; far too fast: the tube is kinked")


def _first_s(rows: list[Row], above_kpa: float) -> float:
    return next((row.t_s for row in rows if row.pressure_kpa >= above_kpa), math.nan)


def _compared(name: str, found: str, share: float, advice: str) -> Check:
    off = abs(share - 1)
    return graded(name, found, advice, good=off <= SHARE[0], usable=off <= SHARE[1])


def _settling(filling: list[Row], leaking: list[Row], setpoint_kpa: float) -> Check:
    settling = [row.t_s for row in filling if row.state == BoardState.SETTLING]
    took_s = settling[-1] - settling[0] if settling else 0.0
    actions = sum(a.valves != b.valves for a, b in pairwise([*filling, leaking[0]]))
    beginning = [row.pressure_kpa for row in leaking if row.t_s <= leaking[0].t_s + 0.5]
    off_kpa = math.fsum(beginning) / len(beginning) - setpoint_kpa
    if leaking[0].pressed:
        return _pressed(NAMES[1], off_kpa)
    found = f"{took_s:.1f} s, {actions} changes of the valves, {off_kpa:+.3f} kPa off"
    good = took_s <= SETTLE_S and actions <= MOST_ACTIONS and abs(off_kpa) <= BAND_KPA
    advice = "a larger orifice or a slower valve than commissioned overshoots"
    return graded(NAMES[1], found, advice, good=good, usable=abs(off_kpa) <= 2 * BAND_KPA)


def _pressed(name: str, above_kpa: float) -> Check:
    advice = f"let go and {AGAIN}; if nobody touched it, the inlet valve does not shut"
    return unchecked(name, f"the balloon was pressed ({above_kpa:+.2f} kPa)", advice)


def _leak(rows: list[Row], examination: Examination, setpoint_kpa: float) -> Check:
    lasted_s = rows[-1].t_s - rows[0].t_s
    if not lasted_s >= 0.9 * examination.leak_s:
        found = f"was not held for {examination.leak_s:g} s{_because(examination)}"
        return Check(NAMES[2], Verdict.BAD, found, causes_of(examination.instrument.faults))
    if any(row.pressed for row in rows):
        return _pressed(NAMES[2], max(row.pressure_kpa for row in rows) - setpoint_kpa)
    change_kpa = _slope(rows) * FALL_OVER_S
    how, advice = ("rises", RISES) if change_kpa > 0 else ("falls", FALLS)
    found = f"{how} by {abs(change_kpa):.3f} kPa in {FALL_OVER_S:g} s"
    good, usable = (abs(change_kpa) <= most_kpa for most_kpa in FALL_KPA)
    return graded(NAMES[2], found, advice, good=good, usable=usable)


def _slope(rows: list[Row]) -> float:
    """Least squares slope of the pressure [kPa/s]; a NaN in it stays one."""
    count = len(rows)
    mean_s = math.fsum(row.t_s for row in rows) / count
    mean_kpa = math.fsum(row.pressure_kpa for row in rows) / count
    spread = math.fsum((row.t_s - mean_s) ** 2 for row in rows)
    return math.fsum((row.t_s - mean_s) * (row.pressure_kpa - mean_kpa) for row in rows) / spread


def _venting(rows: list[Row], examination: Examination, setpoint_kpa: float) -> Check:
    """From p the vent takes √(p / 8 kPa) times as long to halve it as from 8 kPa."""
    advice = f"{INFLATED}vent valve, its relay, a kinked tube; do not use the rig"
    told = [name_of(fault) for fault in examination.instrument.faults if fault in NOT_EMPTIED]
    if told or not rows:
        return Check(NAMES[3], Verdict.BAD, ", ".join(told) or "no sample came", advice)
    from_kpa = max(row.pressure_kpa for row in rows[:50])
    halved_s = next((row.t_s for row in rows if row.pressure_kpa <= from_kpa / 2), math.inf) - rows[0].t_s
    if from_kpa > setpoint_kpa + BAND_KPA and halved_s < math.inf:
        return _pressed(NAMES[3], from_kpa - setpoint_kpa)
    expected_s = HALVING_S * math.sqrt(from_kpa / HALVED_KPA) if from_kpa > 0 else math.nan
    found = f"{from_kpa:.2f} kPa halved in {halved_s:.2f} s, commissioned {expected_s:.2f} s"
    return _compared(NAMES[3], found, halved_s / expected_s, advice)
