"""Plausible ranges of values that follow from several keys of the calibration file.

The range of a single key is declared with the key in `file`. docs/calibration.md gives the reasons.
"""

from __future__ import annotations

#: Plausible ratio of the radius at 11.45 kPa to the radius at rest (1.17 in the paper). A smaller ratio means
#: a wrong unit of the pressure. A balloon with a larger ratio is beyond its limit point (1.38).
STRETCH_RANGE = (1.02, 1.4)
#: Plausible growth of the radius between 4.95 and 11.45 kPa [mm/kPa]. 0.10 to 0.18 in the paper.
SLOPE_RANGE_MM_PER_KPA = (0.001, 0.6)
#: Plausible grips. A grip outside means a wrong mass, radius or volume.
GRIP_RANGE = (-0.6, 1.6)
MIN_RADIUS_SPAN_KPA = 3.0
#: Plausible relative standard uncertainty of V_c. The tolerance of a syringe alone gives 0.024.
VOLUME_RELATIVE_STD_RANGE = (0.02, 0.2)
#: Plausible relative standard uncertainty of the lag, size of the pressure step [kPa], and residual as a
#: share of the step.
LAG_RELATIVE_STD_RANGE, STEP_RANGE_KPA, LAG_RESIDUAL_RANGE = (0.0, 0.5), (0.5, 50.0), (0.0, 0.2)
#: Plausible standard deviation of a force of 1 N [N]. Contacts with smaller errors do not exist.
STD_AT_1_N_RANGE_N = (0.0002, 1.2)

#: A smaller balloon cannot measure 1 N. In a larger balloon, the force at a rise of 0.5 kPa exceeds 3.5 N.
REST_RADIUS_RANGE_MM = (4.5, 12.0)


def require_range(name: str, value: float, allowed: tuple[float, float]) -> None:
    """Raise ValueError if a value that follows from several keys is outside its range, or is NaN."""
    low, high = allowed
    if not low <= value <= high:
        raise ValueError(f"{name} is {value:.4g}; allowed: {low:g} to {high:g}")
