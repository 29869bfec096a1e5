"""Force of a contact from the pressures before and during the contact, for floats and arrays."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar, get_args, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pneuforce.client.value_checks import check_bool, is_number
from pneuforce.errors import ConfigurationError, InvalidForce
from pneuforce.instrument.calibration.estimation import (
    MAX_PRESSURE_KPA,
    Grip,
    LawChoice,
    estimation_settings,
    pressure_problem,
)
from pneuforce.instrument.calibration.file import load
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA
from pneuforce.instrument.model.law import Low, MethodName, Switch
from pneuforce.instrument.model.uncertainty_budget import CONTACT_S
from pneuforce.instrument.validation.accuracy import estimate_forces, largest_rises_kpa

Scalar = float | np.floating[Any] | np.integer[Any]
Number = TypeVar("Number", float, NDArray[np.float64])


class ForceEstimate(NamedTuple, Generic[Number]):
    """Force and its standard uncertainty [N]: two floats, or two arrays of equal shape."""

    force_n: Number  #: contact force
    force_std_n: Number  #: standard uncertainty of the force


@overload
def force(
    dpi_kpa: Scalar,
    dpf_kpa: Scalar,
    *,
    method: MethodName | None = ...,
    calibration: str | os.PathLike[str] | None = ...,
    switch: Switch | None = ...,
    low: Low | None = ...,
    grip: float | None = ...,
    grip_std: float | None = ...,
    pressed_sides: int | None = ...,
    contact_s: float = ...,
    extrapolate: bool = ...,
) -> ForceEstimate[float]: ...
@overload
def force(
    dpi_kpa: ArrayLike,
    dpf_kpa: ArrayLike,
    *,
    method: MethodName | None = ...,
    calibration: str | os.PathLike[str] | None = ...,
    switch: Switch | None = ...,
    low: Low | None = ...,
    grip: float | None = ...,
    grip_std: float | None = ...,
    pressed_sides: int | None = ...,
    contact_s: float = ...,
    extrapolate: bool = ...,
) -> ForceEstimate[NDArray[np.float64]]: ...
def force(
    dpi_kpa: ArrayLike,
    dpf_kpa: ArrayLike,
    *,
    method: MethodName | None = None,
    calibration: str | os.PathLike[str] | None = None,
    switch: Switch | None = None,
    low: Low | None = None,
    grip: float | None = None,
    grip_std: float | None = None,
    pressed_sides: int | None = None,
    contact_s: float = CONTACT_S,
    extrapolate: bool = False,
) -> ForceEstimate[Any]:
    """Return the force of a contact and its standard uncertainty [N].

    `dpi_kpa` is the gauge pressure before the contact, ΔP_i, and `dpf_kpa` the gauge pressure during the
    contact, ΔP_f [kPa]. Two floats, numpy scalars or arrays without a dimension give two floats. Other
    arrays are broadcast; each different ΔP_i takes 2 ms.

    By default, the force is that of the published model. For the force of an instrument, give its calibration
    or, for its default settings, `switch="blend"`: from 7.85 to 9.85 kPa, this force differs by up to 16 %.

    `calibration` is the path of a calibration file (`pneuforce calibrate`). `method` is "energetic",
    "lulevich", "shanahan" or "membrane". `switch` ("paper", "blend") and `low` ("line", "smooth") are
    variants of the law. By default, these three are those of the force calibration, otherwise those of the
    paper. `grip`, `grip_std` and `pressed_sides` are valid only with the method "membrane". `contact_s` is
    the time since the contact began [s]: until about 1 s, heat of the gas adds to the uncertainty.

    The first call with the method "membrane" computes a table in about 15 s of processor time, and stores
    it in ~/.cache/pneuforce for later programs.

    The instrument shows no force if ΔP_i is outside 4.95–11.45 kPa, or if the balloon may be pressed flat,
    and so does this function. `extrapolate=True` computes these forces with the uncertainty NaN. Without a
    valid force, two floats raise InvalidForce, and the element of an array is NaN, also if it is masked, NaN
    or no contact (ΔP_f not above ΔP_i). Raises ConfigurationError for another invalid argument.

    Example:
        estimate = pneuforce.force(8.0, 9.2)
        print(f"{estimate.force_n:.3f} N ± {estimate.force_std_n:.3f} N")

    Example:
        force_n, force_std_n = pneuforce.force(8.0, [8.2, 8.6, 9.0, 9.4], method="lulevich")
    """
    settings = _settings(method, calibration, switch, low, Grip(grip, grip_std), pressed_sides)
    baseline_kpa, final_kpa = _pressures(dpi_kpa, dpf_kpa)
    _check_options(contact_s, extrapolate)
    if baseline_kpa.ndim == 0:
        return _scalar_force(float(baseline_kpa), float(final_kpa), settings, contact_s, extrapolate)
    return _array_force(baseline_kpa, final_kpa, settings, contact_s, extrapolate)


def _check_options(contact_s: float, extrapolate: bool) -> None:
    check_bool("extrapolate", extrapolate)
    if not (is_number(contact_s) and 0 <= contact_s < math.inf):
        raise ConfigurationError(
            f"contact_s = {contact_s!r} is invalid: it must be a finite time of at least 0 s"
        )


def _pressures(dpi_kpa: ArrayLike, dpf_kpa: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return both pressures as arrays of equal shape. Raises ConfigurationError."""
    try:
        baseline_kpa, final_kpa = np.broadcast_arrays(_numbers(dpi_kpa), _numbers(dpf_kpa))
    except (TypeError, ValueError, OverflowError) as error:
        raise ConfigurationError(f"dpi_kpa and dpf_kpa must be numbers or arrays: {error}") from None
    return baseline_kpa, final_kpa


def _numbers(values: ArrayLike) -> NDArray[np.float64]:
    """Return the values as floats, NaN for a masked element. Raises TypeError for values of other types."""
    if isinstance(values, np.ma.MaskedArray):
        return np.where(np.ma.getmaskarray(values), math.nan, np.asarray(values.data, float))
    array = np.asarray(values)
    parts = values if isinstance(values, list | tuple) else _objects(array)
    if array.dtype.kind in "USmMcb" or any(isinstance(part, str | bool) for part in parts):
        raise TypeError("a text, a truth value, a complex number, a time and a date are no pressures")
    return np.asarray(array, float)


def _objects(array: NDArray[Any]) -> Iterable[object]:
    """Return the elements of an array of Python objects, no elements of another array."""
    return array.flat if array.dtype.kind == "O" else ()


def _settings(
    method: MethodName | None,
    path: str | os.PathLike[str] | None,
    switch: Switch | None,
    low: Low | None,
    grip: Grip,
    sides: int | None,
) -> ChainSettings:
    """Return the settings of the estimate. Raises ConfigurationError."""
    for name, choice, choices in (
        ("method", method, MethodName),
        ("switch", switch, Switch),
        ("low", low, Low),
    ):
        if choice is not None and choice not in get_args(choices):
            allowed = ", ".join(get_args(choices))
            raise ConfigurationError(f"{name} = {choice!r} is invalid: it must be one of {allowed}")
    for name, value in (("grip", grip.value), ("grip_std", grip.std)):
        if value is not None and not (is_number(value) and 0 <= value <= 1):
            raise ConfigurationError(f"{name} = {value!r} is invalid: it must be 0 to 1")
    if isinstance(sides, bool | float) or sides not in (None, 1, 2):
        raise ConfigurationError(f"pressed_sides = {sides!r} is invalid: it must be 1 or 2")
    if not isinstance(path, str | os.PathLike | None) or str(path) == "" or "\0" in str(path):
        raise ConfigurationError(f"calibration = {path!r} is invalid: it must be the path of a file")
    content = None if path is None else load(Path(path))
    return estimation_settings(LawChoice(method, switch, low, sides), grip, content)


def _scalar_force(
    baseline_kpa: float, final_kpa: float, settings: ChainSettings, contact_s: float, extrapolate: bool
) -> ForceEstimate[float]:
    problem = pressure_problem(baseline_kpa, final_kpa, ("dpi_kpa", "dpf_kpa"))
    if problem:
        raise InvalidForce(("out_of_range",), problem)
    in_range = VALID_LOW_KPA <= baseline_kpa <= VALID_HIGH_KPA
    if not (extrapolate or in_range):
        raise InvalidForce(
            ("out_of_range",),
            f"dpi_kpa {baseline_kpa:g} is outside the validated {VALID_LOW_KPA}–{VALID_HIGH_KPA} kPa; with "
            "extrapolate=True, the force is computed without an uncertainty",
        )
    pair = [(baseline_kpa, final_kpa)]
    largest_rise_kpa = float(largest_rises_kpa(pair, settings)[0]) if in_range else 0.0
    is_extrapolated = final_kpa - baseline_kpa > largest_rise_kpa
    if is_extrapolated and not extrapolate:
        raise InvalidForce(
            ("out_of_range",),
            f"the rise is above {largest_rise_kpa:.2f} kPa, so the balloon may be pressed flat; with "
            "extrapolate=True, the force is computed without an uncertainty",
        )
    force_n, std_n = estimate_forces(pair, settings, contact_s)
    if not (math.isfinite(force_n[0]) and math.isfinite(std_n[0])):
        raise InvalidForce(
            ("out_of_range",), "the model has no plausible solution for these pressures; check both pressures"
        )
    return ForceEstimate(float(force_n[0]), math.nan if is_extrapolated else float(std_n[0]))


def _array_force(
    baseline_kpa: NDArray[np.float64],
    final_kpa: NDArray[np.float64],
    settings: ChainSettings,
    contact_s: float,
    extrapolate: bool,
) -> ForceEstimate[NDArray[np.float64]]:
    usable = (baseline_kpa > 0) & (final_kpa > baseline_kpa) & (final_kpa <= MAX_PRESSURE_KPA)
    in_range = usable & (baseline_kpa >= VALID_LOW_KPA) & (baseline_kpa <= VALID_HIGH_KPA)
    if not extrapolate:
        usable = in_range
    force_n, std_n = np.full(usable.shape, np.nan), np.full(usable.shape, np.nan)
    pairs = list(zip(baseline_kpa[usable], final_kpa[usable], strict=True))
    force_n[usable], std_n[usable] = estimate_forces(pairs, settings, contact_s)
    invalid = ~(np.isfinite(force_n) & np.isfinite(std_n))
    pairs = list(zip(baseline_kpa[in_range], final_kpa[in_range], strict=True))
    extrapolated = ~in_range
    extrapolated[in_range] = (final_kpa - baseline_kpa)[in_range] > largest_rises_kpa(pairs, settings)
    force_n[invalid | (extrapolated & (not extrapolate))] = np.nan
    std_n[invalid | extrapolated] = np.nan
    return ForceEstimate(force_n, std_n)
