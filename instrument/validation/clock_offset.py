"""Offset between the clocks of a recording and of a reference sensor, from the course of both signals."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.validation.trial import Floats

STEP_S = 0.02
#: Longest signal whose offset is estimated. A longer signal needs too much memory.
MAX_DURATION_S = 12 * 3600.0
#: Smallest share of the shorter signal that both signals must have in common.
MIN_OVERLAP = 0.5
#: Smallest accepted correlation, and smallest difference to the correlation at any other offset. Equal
#: presses at equal intervals fit at several offsets.
MIN_CORRELATION, MIN_DIFFERENCE = 0.7, 0.05
#: Offsets within this time around the best offset belong to the same maximum of the correlation.
SAME_MAXIMUM_S = 1.0
#: Largest error of a clock offset that is known from the times of two computers.
MAX_CLOCK_ERROR_S = 2.0


class Signal(NamedTuple):
    """Signal over time. The times rise."""

    t_s: Floats
    value: Floats


class ClockOffset(NamedTuple):
    """Offset between two clocks, and the correlation of the signals at this offset."""

    offset_s: float  #: is added to a time of the reference, and gives the time of the recording
    correlation: float  #: NaN if the signals have too little in common


def estimate_offset(recorded: Signal, reference: Signal, expected_s: float = math.nan) -> ClockOffset:
    """Return the offset at which the pressure rise and the reference force have the highest correlation.

    If the signals resemble each other at an offset within 2 s of `expected_s`, only these offsets count.

    Raises ConfigurationError if the signals do not resemble each other, if several offsets fit, or if a
    signal is too long.
    """
    if any(signal.t_s[-1] - signal.t_s[0] > MAX_DURATION_S for signal in (recorded, reference)):
        raise ConfigurationError(
            f"the clock offset cannot be estimated: recording or reference is longer than "
            f"{MAX_DURATION_S / 3600:g} h; check that the times are in s, or give --offset"
        )
    pressure, force = _on_grid(recorded), _on_grid(reference)
    correlation = _correlations(pressure, force)
    first_s = float(recorded.t_s[0] - reference.t_s[0]) - (len(force) - 1) * STEP_S
    is_near = np.abs(first_s + np.arange(len(correlation)) * STEP_S - expected_s) <= MAX_CLOCK_ERROR_S
    if _greatest(correlation[is_near]) >= MIN_CORRELATION:
        correlation[~is_near] = np.nan
    best = int(np.nanargmax(correlation)) if np.isfinite(correlation).any() else 0
    highest = float(correlation[best])
    if not highest >= MIN_CORRELATION and _greatest(-correlation) >= MIN_CORRELATION:
        raise ConfigurationError(
            "the reference force falls when the pressure rises, so its sign is opposite: use --invert, "
            "or leave it out if it is given"
        )
    if math.isnan(highest):
        raise ConfigurationError(
            f"the clock offset cannot be estimated, because {unknown_reason(reference)}: check the files"
        )
    if not highest >= MIN_CORRELATION:
        raise ConfigurationError(
            "the clock offset cannot be estimated: the course of the reference force does not resemble "
            f"that of the pressure (correlation {highest:.2f}); check the files, or give --offset"
        )
    near = round(SAME_MAXIMUM_S / STEP_S)
    others = np.concatenate([correlation[: max(best - near, 0)], correlation[best + near + 1 :]])
    second = _greatest(others)
    if not highest - second >= MIN_DIFFERENCE:
        raise ConfigurationError(
            f"the clock offset is ambiguous: several offsets fit (correlations {highest:.2f} and "
            f"{second:.2f}), because the presses are very regular, or the reference is short "
            f"({reference.t_s[-1] - reference.t_s[0]:.3g} s): give --offset, or a longer reference"
        )
    return ClockOffset(first_s + (best + _vertex(correlation[best - 1 : best + 2])) * STEP_S, highest)


def correlation_at(offset_s: float, recorded: Signal, reference: Signal) -> float:
    """Return the correlation of the pressure rise and the reference force at a given clock offset.

    The result is NaN if a signal is constant, or if both signals have less than two steps in common.
    """
    first_s = max(recorded.t_s[0], reference.t_s[0] + offset_s)
    last_s = min(recorded.t_s[-1], reference.t_s[-1] + offset_s, first_s + MAX_DURATION_S)
    t_s = np.arange(first_s, last_s, STEP_S)
    rise = np.interp(t_s, recorded.t_s, recorded.value)
    force = np.interp(t_s - offset_s, reference.t_s, reference.value)
    if len(t_s) < 2 or not (np.ptp(rise) > 0.0 and np.ptp(force) > 0.0):
        return math.nan
    return float(np.corrcoef(rise, force)[0, 1])


def unknown_reason(reference: Signal) -> str:
    """Return the probable reason why a correlation with this reference is NaN."""
    if not np.ptp(reference.value) > 0.0:
        return f"the reference force is constant ({reference.value[0]:g} N)"
    return "recording and reference have too little in common"


def _greatest(values: Floats) -> float:
    """Return the greatest finite correlation, −1 if there is none."""
    return float(np.nanmax(values)) if np.isfinite(values).any() else -1.0


def _on_grid(signal: Signal) -> Floats:
    """Return the signal at equal steps from its first time on."""
    return np.interp(np.arange(signal.t_s[0], signal.t_s[-1], STEP_S), signal.t_s, signal.value)


def _correlations(a: Floats, b: Floats) -> Floats:
    """Return the correlation coefficient for each shift of `b`, NaN if too little of the signals overlaps.

    Element k belongs to the shift k − (len(b) − 1): b[i] then coincides with a[i + shift].
    """
    length = len(a) + len(b) - 1
    ones_a, ones_b = np.ones_like(a), np.ones_like(b)

    def sums(x: Floats, y: Floats) -> Floats:
        size = 1 << (length - 1).bit_length()
        product = np.fft.rfft(x, size) * np.fft.rfft(y[::-1], size)
        return np.asarray(np.fft.irfft(product, size)[:length])

    count = np.round(sums(ones_a, ones_b))
    with np.errstate(all="ignore"):  # extreme values give NaN
        a, b = a - a.mean(), b - b.mean()
        sum_a, sum_b = sums(a, ones_b), sums(ones_a, b)
        covariance = sums(a, b) - sum_a * sum_b / count
        variance_a = sums(a * a, ones_b) - sum_a**2 / count
        variance_b = sums(ones_a, b * b) - sum_b**2 / count
        correlation = covariance / np.sqrt(variance_a * variance_b)
    enough = count >= MIN_OVERLAP * min(len(a), len(b))
    # Rounding errors make the correlation of a constant signal arbitrary.
    varied = (variance_a > 1e-6 * (a @ a)) & (variance_b > 1e-6 * (b @ b))
    return np.where(enough & varied & np.isfinite(correlation), correlation, np.nan)


def _vertex(values: Floats) -> float:
    """Return the position of the vertex of the parabola through the values at −1, 0 and 1."""
    if len(values) < 3 or not np.isfinite(values).all():
        return 0.0
    left, middle, right = values
    curvature = left - 2 * middle + right
    return float(0.5 * (left - right) / curvature) if curvature < 0 else 0.0
