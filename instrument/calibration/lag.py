"""The lag of the tube between balloon and sensor, from a recorded step of the pressure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from instrument.columns import Numbers, Points

COLUMNS = (("t_s", "pressure_kpa"),)
LEAST_POINTS = 30
LEAST_STEP_KPA = 0.5
MOST_KPA = 50.0  #: the sensor's full scale
LAGS_S = (0.002, 0.5)
#: What a first-order lag may leave over, as a share of the step, and as a multiple of the noise at rest.
MOST_REST, MOST_NOISES = 0.01, 2.0


@dataclass(frozen=True, slots=True)
class Lag:
    """The first-order lag of the tube."""

    tube_s: float
    std_s: float
    step_kpa: float
    residual_kpa: float


def lag_of(points: Points, filter_s: float = 0.0) -> Lag:
    """The lag, where the recorded pressure went through a first-order filter of `filter_s`, or none.

    Raises ConfigurationError where there is no step, or none of first order.
    """
    points.at_least(LEAST_POINTS)
    times, pressures = points["t_s"] - points["t_s"][0], points["pressure_kpa"]
    _check_times(points, times)
    if not np.abs(pressures).max() <= MOST_KPA:
        raise points.refusal(f"pressure_kpa beyond {MOST_KPA:g} kPa: is that hPa or Pa?")
    start = _guess(points, times, pressures)
    found, covariance = _fitted(points, times, pressures, start, filter_s)
    residuals = pressures - _curve(times, *found, filter_s)
    begin_s, tube_s, before, after = found
    lag = Lag(tube_s, _std_s(covariance, times, filter_s), after - before, float(residuals.std()))
    noise_kpa = float(pressures[: _resting(times)].std())
    _check_order(points, lag, residuals[(times >= begin_s) & (times < begin_s + 5 * tube_s)], noise_kpa)
    return lag


def _curve(
    t_s: Numbers, begin_s: float, tube_s: float, before: float, after: float, filter_s: float
) -> Numbers:
    since = np.maximum(t_s - begin_s, 0.0)
    left = np.exp(-since / tube_s)
    if filter_s > 0:
        if abs(filter_s - tube_s) < 1e-6:
            left = left * (1 + since / tube_s)
        else:
            left = (tube_s * left - filter_s * np.exp(-since / filter_s)) / (tube_s - filter_s)
    curve: Numbers = after + (before - after) * left
    return curve


def _check_times(points: Points, times_s: Numbers) -> None:
    steps = np.diff(times_s)
    if not (steps > 0).all():
        raise points.refusal("t_s does not grow", int((steps <= 0).argmax()) + 1)
    if np.median(steps) > 0.05:
        raise points.refusal(
            f"samples {np.median(steps):g} s apart do not show a lag below {LAGS_S[1]:g} s; "
            "is t_s in milliseconds?"
        )


def _resting(times_s: Numbers) -> int:
    """So many samples of the beginning, and of the end, are at rest."""
    return max(len(times_s) // 20, 5)


def _guess(points: Points, times_s: Numbers, pressure_kpa: Numbers) -> tuple[float, float, float, float]:
    part = _resting(times_s)
    before, after = float(np.median(pressure_kpa[:part])), float(np.median(pressure_kpa[-part:]))
    noise = float(pressure_kpa[:part].std())
    if abs(after - before) < max(LEAST_STEP_KPA, 10 * noise):
        raise points.refusal(
            f"no step: {before:.3f} kPa in the beginning, {after:.3f} kPa in the end, "
            f"and a step of at least {max(LEAST_STEP_KPA, 10 * noise):.2f} kPa is needed"
        )
    share = (pressure_kpa - before) / (after - before)
    begin_s = float(times_s[int((share > 0.1).argmax())])
    most_s = float(times_s[int((share > 0.63).argmax())])
    return begin_s, float(np.clip(most_s - begin_s, 2 * LAGS_S[0], LAGS_S[1] / 2)), before, after


def _fitted(
    points: Points,
    times_s: Numbers,
    pressure_kpa: Numbers,
    start: tuple[float, float, float, float],
    filter_s: float,
) -> tuple[tuple[float, float, float, float], Numbers]:
    from scipy.optimize import curve_fit

    low, high = float(pressure_kpa.min()) - 1, float(pressure_kpa.max()) + 1
    bounds = ([0.0, LAGS_S[0], low, low], [float(times_s[-1]), LAGS_S[1], high, high])
    try:
        found, covariance = curve_fit(
            partial(_curve, filter_s=filter_s), times_s, pressure_kpa, start, bounds=bounds
        )
    except RuntimeError:
        raise points.refusal("no first-order lag can be fitted to this recording") from None
    begin_s, tube_s, before, after = (float(value) for value in found)
    return (begin_s, tube_s, before, after), covariance


def _std_s(covariance: Numbers, times_s: Numbers, filter_s: float) -> float:
    """A filter makes neighbours alike: as many fewer points as it correlates them."""
    alike = math.exp(-float(np.median(np.diff(times_s))) / filter_s) if filter_s > 0 else 0.0
    return math.sqrt(covariance[1, 1] * (1 + alike) / (1 - alike))


def _check_order(points: Points, lag: Lag, moving_kpa: Numbers, noise_kpa: float) -> None:
    if len(moving_kpa) < 5:
        raise points.refusal("the step is shown by fewer than 5 samples")
    left_kpa = float(np.sqrt((moving_kpa**2).mean()))
    if left_kpa > max(MOST_NOISES * noise_kpa, MOST_REST * abs(lag.step_kpa)):
        raise points.refusal(
            f"not a step through a first-order lag: the best one ({lag.tube_s:.3f} s) leaves "
            f"{left_kpa:.3f} kPa of a step of {abs(lag.step_kpa):.2f} kPa, "
            f"noise at rest {noise_kpa:.3f} kPa; a slower step, a leak, or a filter (--filter-s)?"
        )
    if not LAGS_S[0] * 1.01 < lag.tube_s < LAGS_S[1] * 0.99:
        raise points.refusal(f"a lag of {lag.tube_s:.3f} s is no tube's ({LAGS_S[0]:g} to {LAGS_S[1]:g} s)")
