"""Fit of the lag of the tube between balloon and sensor, from a recorded pressure step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from pneuforce.support.columns import Numbers, Points

COLUMNS = (("t_s", "pressure_kpa"),)
MIN_POINTS = 30
MIN_STEP_KPA = 0.5
MAX_PRESSURE_KPA = 50.0  #: full scale of the sensor
LAG_RANGE_S = (0.002, 0.5)
MAX_SAMPLE_INTERVAL_S = 0.05
MIN_MOVING_SAMPLES = 5
#: Largest accepted residual of the fit, as a ratio to the step and to the noise at rest. The larger of both
#: limits is used.
MAX_RESIDUAL_STEP_RATIO, MAX_RESIDUAL_NOISE_RATIO = 0.01, 2.0


@dataclass(frozen=True, slots=True)
class LagFit:
    """Fitted first-order lag of the tube."""

    tube_time_constant_s: float
    std_s: float
    step_kpa: float
    residual_kpa: float


class _Step(NamedTuple):
    """Parameters of the response of a first-order lag to a pressure step, in the order of `_curve`."""

    start_s: float
    tube_time_constant_s: float
    before_kpa: float
    after_kpa: float


def fit_lag(points: Points, filter_time_constant_s: float = 0.0) -> LagFit:
    """Return the lag of the tube.

    `filter_time_constant_s` is the time constant of the first-order filter of the recorded pressure, 0 if the
    pressure was not filtered. Raises ConfigurationError if the recording has no step, or if the response to
    the step is not that of a first-order lag.
    """
    points.require_rows(MIN_POINTS)
    times, pressures = points["t_s"] - points["t_s"][0], points["pressure_kpa"]
    _check_times(points, times)
    if not np.abs(pressures).max() <= MAX_PRESSURE_KPA:
        raise points.error(
            f"pressure_kpa is beyond the {MAX_PRESSURE_KPA:g} kPa of the sensor: is the unit hPa or Pa?"
        )
    guess = _guess(points, times, pressures)
    step, covariance = _fit_step(points, times, pressures, guess, filter_time_constant_s)
    residuals = pressures - _curve(times, *step, filter_time_constant_s)
    lag = LagFit(
        step.tube_time_constant_s,
        _std_s(covariance, times, filter_time_constant_s),
        step.after_kpa - step.before_kpa,
        float(residuals.std()),
    )
    noise_kpa = float(pressures[: _resting_samples(times)].std())
    moving = (times >= step.start_s) & (times < step.start_s + 5 * step.tube_time_constant_s)
    _check_first_order(points, lag, residuals[moving], noise_kpa)
    return lag


def _curve(
    t_s: Numbers,
    start_s: float,
    tube_time_constant_s: float,
    before_kpa: float,
    after_kpa: float,
    filter_time_constant_s: float,
) -> Numbers:
    """Return the pressure at each time of a step that passes through the tube and the filter."""
    elapsed_s = np.maximum(t_s - start_s, 0.0)
    remaining = np.exp(-elapsed_s / tube_time_constant_s)
    if filter_time_constant_s > 0:
        difference_s = tube_time_constant_s - filter_time_constant_s
        if abs(difference_s) < 1e-6:  # the general formula would divide by zero
            remaining = remaining * (1 + elapsed_s / tube_time_constant_s)
        else:
            by_filter = np.exp(-elapsed_s / filter_time_constant_s)
            remaining = tube_time_constant_s * remaining - filter_time_constant_s * by_filter
            remaining = remaining / difference_s
    curve: Numbers = after_kpa + (before_kpa - after_kpa) * remaining
    return curve


def _check_times(points: Points, times_s: Numbers) -> None:
    intervals = np.diff(times_s)
    if not (intervals > 0).all():
        raise points.error("t_s does not grow", int((intervals <= 0).argmax()) + 1)
    if np.median(intervals) > MAX_SAMPLE_INTERVAL_S:
        raise points.error(
            f"samples {np.median(intervals):g} s apart do not show a lag below {LAG_RANGE_S[1]:g} s; "
            "is t_s in milliseconds?"
        )


def _resting_samples(times_s: Numbers) -> int:
    """Return the number of first samples, and of last samples, in which the pressure is assumed constant."""
    return max(len(times_s) // 20, 5)


def _guess(points: Points, times_s: Numbers, pressure_kpa: Numbers) -> _Step:
    """Return start values for the fit. Raise ConfigurationError if the recording has no step."""
    resting = _resting_samples(times_s)
    before, after = float(np.median(pressure_kpa[:resting])), float(np.median(pressure_kpa[-resting:]))
    min_step_kpa = max(MIN_STEP_KPA, 10 * float(pressure_kpa[:resting].std()))
    if abs(after - before) < min_step_kpa:
        raise points.error(
            f"no step: {before:.3f} kPa at the beginning, {after:.3f} kPa at the end, "
            f"and a step of at least {min_step_kpa:.2f} kPa is needed"
        )
    progress = (pressure_kpa - before) / (after - before)
    start_s = float(times_s[int((progress > 0.1).argmax())])
    lag_s = float(times_s[int((progress > 0.63).argmax())]) - start_s
    return _Step(start_s, float(np.clip(lag_s, 2 * LAG_RANGE_S[0], LAG_RANGE_S[1] / 2)), before, after)


def _fit_step(
    points: Points, times_s: Numbers, pressure_kpa: Numbers, guess: _Step, filter_time_constant_s: float
) -> tuple[_Step, Numbers]:
    """Return the parameters that fit the recorded step best, and the covariance of these parameters."""
    from scipy.optimize import curve_fit

    low, high = float(pressure_kpa.min()) - 1, float(pressure_kpa.max()) + 1
    bounds = ([0.0, LAG_RANGE_S[0], low, low], [float(times_s[-1]), LAG_RANGE_S[1], high, high])
    curve = partial(_curve, filter_time_constant_s=filter_time_constant_s)
    try:
        parameters, covariance = curve_fit(curve, times_s, pressure_kpa, guess, bounds=bounds)
    except RuntimeError:
        raise points.error("no first-order lag can be fitted to this recording") from None
    return _Step(*(float(value) for value in parameters)), covariance


def _std_s(covariance: Numbers, times_s: Numbers, filter_time_constant_s: float) -> float:
    """Return the standard uncertainty of the lag [s].

    A filter correlates successive samples. The uncertainty is larger because fewer samples are independent.
    """
    correlation = 0.0
    if filter_time_constant_s > 0:
        correlation = math.exp(-float(np.median(np.diff(times_s))) / filter_time_constant_s)
    return math.sqrt(covariance[1, 1] * (1 + correlation) / (1 - correlation))


def _check_first_order(points: Points, lag: LagFit, moving_kpa: Numbers, noise_kpa: float) -> None:
    """Raise ConfigurationError if a first-order lag does not describe the step.

    `moving_kpa` are the residuals while the pressure moves, `noise_kpa` is the noise at rest.
    """
    if len(moving_kpa) < MIN_MOVING_SAMPLES:
        raise points.error(f"fewer than {MIN_MOVING_SAMPLES} samples show the step")
    residual_kpa = float(np.sqrt((moving_kpa**2).mean()))
    step_kpa = abs(lag.step_kpa)
    if residual_kpa > max(MAX_RESIDUAL_NOISE_RATIO * noise_kpa, MAX_RESIDUAL_STEP_RATIO * step_kpa):
        raise points.error(
            "this is not a step through a first-order lag: the best fit "
            f"({lag.tube_time_constant_s:.3f} s) has a residual of {residual_kpa:.3f} kPa in a step of "
            f"{step_kpa:.2f} kPa, and the noise at rest is {noise_kpa:.3f} kPa; possible causes are a slower "
            "step, a leak, the heat of the gas, or a filter (--filter-time-constant-s)"
        )
    low_s, high_s = LAG_RANGE_S
    if not low_s * 1.01 < lag.tube_time_constant_s < high_s * 0.99:
        raise points.error(
            f"a lag of {lag.tube_time_constant_s:.3f} s is impossible for a tube ({low_s:g} to {high_s:g} s)"
        )
