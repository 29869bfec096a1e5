"""Checks of what the board sends while nothing is moved."""

from __future__ import annotations

import math
from itertools import pairwise
from statistics import fmean, pstdev

from instrument.doctor.causes import SENSOR, SUPPLY, causes_of
from instrument.doctor.check import Check, Verdict, graded, unchecked
from instrument.doctor.examination import Examination, Row, Stage
from instrument.faults import name_of
from instrument.rig.clock import OFF_ERROR, RESONATOR_ERROR
from instrument.rig.frames import SAMPLES_PER_S, BoardKind, BoardState, Hello
from instrument.rig.limits import SUPPLY_MV, ZERO_SPAN_KPA

NOISE_KPA = (0.03, 0.1)
SUPPLY_SPREAD_MV = 50.0
GAP_S = (0.05, 0.25)
LOST_SHARE = 0.01

LATE = (
    "nothing was lost: the board's clock, a busy machine, or an emulated board that is slower than a real one"
)
CABLE = "look at cable, plug and earth; keep the cable away from motors; another USB port, no hub"


def board_checks(hello: Hello, since_opened_s: float) -> list[Check]:
    """Who answered, `since_opened_s` after the port was opened."""
    kind = BoardKind(hello.board).name.lower() if hello.board in tuple(BoardKind) else f"kind {hello.board}"
    found = f"{kind}, firmware {hello.firmware >> 8}.{hello.firmware & 0xFF}, serial {hello.serial}"
    known = hello.board in tuple(BoardKind)
    advice = "a simulated or emulated board has no balloon; flash the firmware that came with this release"
    up_s = hello.uptime_ms * 1e-3
    reset = "yes" if up_s < since_opened_s else "no"
    return [
        graded("board", found, advice, good=known, usable=True),
        graded(
            "reset by opening",
            f"{reset}: up for {up_s:.1f} s, {since_opened_s:.1f} s after the port was opened",
            "any program that opens the port vents the balloon: cut RESET-EN, or 10 µF from RESET to ground",
            good=up_s >= since_opened_s,
            usable=True,
        ),
    ]


def signal_checks(examination: Examination) -> list[Check]:
    """What came while the rig was listened to."""
    rows = examination.rows_of(Stage.LISTENING)
    if len(rows) < SAMPLES_PER_S // 10:
        return [Check("samples", Verdict.BAD, f"{len(rows)} samples", CABLE), _latched(examination)]
    return [
        _rate(rows, examination),
        _gaps(examination.rows, examination.until_s),
        _clock(examination),
        _supply(rows),
        *_sensor(rows),
        _latched(examination),
    ]


def _rate(rows: list[Row], examination: Examination) -> Check:
    lost, refused = examination.losses
    per_s = (len(rows) - 1) / (rows[-1].t_s - rows[0].t_s) if rows[-1].t_s > rows[0].t_s else math.nan
    found = f"{per_s:.1f} per s of {SAMPLES_PER_S}; {lost} lost, {refused} damaged"
    good = not lost + refused and abs(per_s / SAMPLES_PER_S - 1) <= OFF_ERROR
    advice = CABLE if lost + refused else LATE
    return graded("samples", found, advice, good=good, usable=lost + refused <= LOST_SHARE * len(rows))


def _gaps(rows: list[Row], until_s: float) -> Check:
    longest_s = max(b - a for a, b in pairwise([*(row.heard_s for row in rows), until_s]))
    advice = "USB latency timer, or a busy machine: after 250 ms the board closes its inlet"
    found = f"longest {longest_s * 1e3:.0f} ms"
    return graded("gaps", found, advice, good=longest_s <= GAP_S[0], usable=longest_s <= GAP_S[1])


def _clock(examination: Examination) -> Check:
    error = examination.link.clock.rate_error
    if math.isnan(error):
        return unchecked("board clock", "too short a look")
    advice = "the board's resonator is off, and its times and limits with it; use another board"
    good, usable = (abs(error) <= most for most in (RESONATOR_ERROR, OFF_ERROR))
    return graded("board clock", f"{error * 100:+.3f} %", advice, good=good, usable=usable)


def _supply(rows: list[Row]) -> Check:
    low, high = min(row.supply_mv for row in rows), max(row.supply_mv for row in rows)
    within = SUPPLY_MV[0] <= low and high <= SUPPLY_MV[1]
    found = f"{low / 1e3:.3f} to {high / 1e3:.3f} V"
    return graded("supply", found, SUPPLY, good=within and high - low <= SUPPLY_SPREAD_MV, usable=within)


def _sensor(rows: list[Row]) -> list[Check]:
    vented = [row for row in rows if row.state == BoardState.VENTED]
    broken = sum(row.frozen or not math.isfinite(row.nominal_kpa) for row in rows)
    if broken:
        found = f"{broken} of {len(rows)} samples tell nothing: open, short or stuck"
        return [Check("sensor", Verdict.BAD, found, SENSOR)]
    if len(vented) < len(rows) / 2:
        return [_zero_of_an_unvented(rows)]
    readings = [row.nominal_kpa for row in vented]
    zero_kpa, noise_kpa = fmean(readings), pstdev(readings)
    advice = f"the data sheet allows ±{ZERO_SPAN_KPA} kPa: is the tube open to the air? another sensor"
    good = abs(zero_kpa) <= ZERO_SPAN_KPA
    quiet, usable = (0.0 < noise_kpa <= most for most in NOISE_KPA)
    noisy = "none at all: stuck; much: 5 V, earth, the sensor's 1 µF and 10 nF"
    return [
        graded("sensor zero", f"{zero_kpa:+.3f} kPa", advice, good=good, usable=False),
        graded("sensor noise", f"{noise_kpa * 1e3:.1f} Pa rms", noisy, good=quiet, usable=usable),
    ]


def _zero_of_an_unvented(rows: list[Row]) -> Check:
    mean_kpa = fmean(row.nominal_kpa for row in rows)
    found = f"{mean_kpa:+.3f} kPa, and the board does not say that it is vented"
    if rows[-1].state == BoardState.TRIPPED and abs(mean_kpa) <= ZERO_SPAN_KPA:
        return unchecked("sensor zero", f"{found}: it has tripped, see faults")
    return Check("sensor zero", Verdict.BAD, found, "is the balloon inflated? open the tube to the air")


def _latched(examination: Examination) -> Check:
    faults = examination.instrument.faults
    found = ", ".join(name_of(fault) for fault in faults) or "none"
    return graded("faults", found, causes_of(faults), good=not faults, usable=False)
