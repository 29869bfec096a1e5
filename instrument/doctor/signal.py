"""Checks of the samples that the board sends while no valve moves."""

from __future__ import annotations

import math
from itertools import pairwise
from statistics import fmean, pstdev

from pneuforce.instrument.core.faults import name_of
from pneuforce.instrument.doctor.causes import NOT_EMPTIED, SENSOR, SUPPLY, causes_of
from pneuforce.instrument.doctor.check import RUN_AGAIN, Check, CheckResult, graded, unchecked
from pneuforce.instrument.doctor.examination import Examination, ExaminationStage, ExaminedSample
from pneuforce.instrument.rig.board_clock import CLOCK_FAULT_ERROR, RESONATOR_TOLERANCE
from pneuforce.instrument.rig.firmware import REMEDY, Firmware, FirmwareOrigin
from pneuforce.protocol.frames import SAMPLES_PER_S, BoardKind, BoardState, Hello
from pneuforce.protocol.limits import SUPPLY_MV, ZERO_SPAN_KPA
from pneuforce.support.counted import counted

#: Pairs of limits for the noise and for a gap: the first limit for PASS, the second for WARNING.
NOISE_KPA = (0.03, 0.1)
GAP_S = (0.05, 0.25)
SUPPLY_SPREAD_MV = 50.0
MAX_LOST_SHARE = 0.01

SLOW_CLOCK = (
    "reduce the load of the machine, or use another board: no sample was lost, but the board's clock is "
    "inaccurate, the machine is overloaded, or an emulated board is slower than a real board"
)
CABLE = "check cable, plug and earth; keep the cable away from motors; use another USB port, and no hub"


def board_checks(hello: Hello, firmware: Firmware, since_opened_s: float) -> list[Check]:
    """Return the checks of the board's identification, which arrived `since_opened_s` after the opening."""
    known = hello.board in tuple(BoardKind)
    kind = BoardKind(hello.board).name.lower() if known else f"kind {hello.board}"
    finding = f"{kind}, serial {hello.serial}"
    advice = "flash the firmware of this release, which names its board: pneuforce flash"
    up_s = hello.uptime_ms * 1e-3
    reset = "yes" if up_s < since_opened_s else "no"
    return [
        graded("board", finding, advice, passed=known, usable=True),
        graded(
            "firmware", str(firmware), REMEDY, passed=firmware.origin is FirmwareOrigin.CURRENT, usable=True
        ),
        graded(
            "reset by opening",
            f"{reset}: up for {up_s:.1f} s, {since_opened_s:.1f} s after the port was opened",
            "cut RESET-EN, or fit 10 µF from RESET to GND: any program that opens the port vents the balloon",
            passed=up_s >= since_opened_s,
            usable=True,
        ),
    ]


def signal_checks(examination: Examination) -> list[Check]:
    """Return the checks of the samples that were observed while no valve moved."""
    samples = examination.samples_of(ExaminationStage.OBSERVING)
    if len(samples) < SAMPLES_PER_S // 10:
        missing = Check("samples", CheckResult.FAIL, counted(len(samples), "sample"), CABLE)
        return [missing, _faults(examination)]
    return [
        _rate(samples, examination),
        _gaps(examination.samples, examination.until_s),
        _clock(examination),
        _supply(samples),
        *_sensor(samples),
        _faults(examination),
    ]


def _rate(samples: list[ExaminedSample], examination: Examination) -> Check:
    lost, rejected = examination.losses
    span_s = samples[-1].t_s - samples[0].t_s
    per_s = (len(samples) - 1) / span_s if span_s > 0 else math.nan
    finding = f"{per_s:.1f} per s of {SAMPLES_PER_S}; {lost} lost, {rejected} damaged"
    passed = not lost + rejected and abs(per_s / SAMPLES_PER_S - 1) <= CLOCK_FAULT_ERROR
    advice = CABLE if lost + rejected else SLOW_CLOCK
    usable = lost + rejected <= MAX_LOST_SHARE * len(samples)
    return graded("samples", finding, advice, passed=passed, usable=usable)


def _gaps(samples: list[ExaminedSample], until_s: float) -> Check:
    times_s = [*(sample.received_s for sample in samples), until_s]
    longest_s = max(b - a for a, b in pairwise(times_s))
    advice = (
        "stop other programs on this machine, and see the row USB latency: after 250 ms without a command "
        "the board closes its inlet"
    )
    finding = f"longest {longest_s * 1e3:.0f} ms"
    return graded("gaps", finding, advice, passed=longest_s <= GAP_S[0], usable=longest_s <= GAP_S[1])


def _clock(examination: Examination) -> Check:
    error = examination.link.clock.rate_error
    if math.isnan(error):
        return unchecked("board clock", "the observed time was too short", RUN_AGAIN)
    advice = (
        "reduce the load of this computer, and run again; if the error stays, use another board: its "
        "resonator is inaccurate, so its times and limits are wrong"
    )
    passed, usable = (abs(error) <= limit for limit in (RESONATOR_TOLERANCE, CLOCK_FAULT_ERROR))
    return graded("board clock", f"{error * 100:+.3f} %", advice, passed=passed, usable=usable)


def _supply(samples: list[ExaminedSample]) -> Check:
    low, high = min(sample.supply_mv for sample in samples), max(sample.supply_mv for sample in samples)
    in_range = SUPPLY_MV[0] <= low and high <= SUPPLY_MV[1]
    finding = f"{low / 1e3:.3f} to {high / 1e3:.3f} V"
    steady = high - low <= SUPPLY_SPREAD_MV
    return graded("supply", finding, SUPPLY, passed=in_range and steady, usable=in_range)


def _sensor(samples: list[ExaminedSample]) -> list[Check]:
    vented = [sample for sample in samples if sample.state == BoardState.VENTED]
    invalid = sum(sample.clock_invalid or not math.isfinite(sample.nominal_kpa) for sample in samples)
    if invalid:
        finding = (
            f"{invalid} of {len(samples)} samples are invalid: the sensor is open or short, or the clock of "
            "the board is wrong"
        )
        return [Check("sensor", CheckResult.FAIL, finding, SENSOR)]
    if len(vented) < len(samples) / 2:
        return [_zero_of_unvented_rig(samples)]
    readings_kpa = [sample.nominal_kpa for sample in vented]
    zero_kpa, noise_kpa = fmean(readings_kpa), pstdev(readings_kpa)
    zero_advice = (
        f"open the tube to the air, or use another sensor: the data sheet allows ±{ZERO_SPAN_KPA} kPa"
    )
    zero_passed = abs(zero_kpa) <= ZERO_SPAN_KPA
    quiet, usable = (0.0 < noise_kpa <= limit_kpa for limit_kpa in NOISE_KPA)
    noise_advice = (
        "check 5 V, earth, the sensor's 1 µF and 10 nF; if there is no noise at all, replace the sensor: its "
        "signal is frozen"
    )
    noise = f"{noise_kpa * 1e3:.1f} Pa rms"
    return [
        graded("sensor zero", f"{zero_kpa:+.3f} kPa", zero_advice, passed=zero_passed, usable=False),
        graded("sensor noise", noise, noise_advice, passed=quiet, usable=usable),
    ]


def _zero_of_unvented_rig(samples: list[ExaminedSample]) -> Check:
    mean_kpa = fmean(sample.nominal_kpa for sample in samples)
    finding = f"{mean_kpa:+.3f} kPa, and the board does not report that it is vented"
    if samples[-1].state == BoardState.TRIPPED and abs(mean_kpa) <= ZERO_SPAN_KPA:
        return unchecked("sensor zero", f"{finding}: it has tripped, see faults")
    advice = "look at the balloon, which may be inflated, open the tube to the air, and check the vent valve"
    return Check("sensor zero", CheckResult.FAIL, finding, advice)


def _faults(examination: Examination) -> Check:
    """Check the faults that are present, and the faults that were latched before and could be cleared.

    After a fault of the vent, the balloon may be inflated although the samples show no fault.
    """
    before, present = examination.faults_before, tuple(examination.instrument.faults)
    gone = [fault for fault in before if fault not in present]
    findings = [name_of(fault) + _since_when(fault, examination) for fault in present]
    findings += [f"{name_of(fault)} (latched before, cleared now, not present)" for fault in gone]
    vent_failed = not NOT_EMPTIED.isdisjoint(gone)
    again = f"; then {RUN_AGAIN}" if vent_failed else ""
    return graded(
        "faults",
        ", ".join(findings) or "none",
        causes_of([*present, *gone]) + again,
        passed=not findings,
        usable=not (present or vent_failed),
    )


def _since_when(fault: int, examination: Examination) -> str:
    """Return since when a fault that is latched at the end of the examination has been latched."""
    if fault not in examination.faults_before:
        return " (occurred now)"
    return " (occurred again)" if examination.cleared else " (cannot be cleared: a cause is present)"


def inflation_obstacle(examination: Examination) -> str:
    """Return which checks of the signal have failed, so that the rig must not be inflated; "" if none."""
    failed = [check.name for check in signal_checks(examination) if check.result is CheckResult.FAIL]
    return f"failed: {', '.join(failed)}" if failed else ""
