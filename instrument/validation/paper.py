"""What the paper prints of its validation (Sections IV-B and V), and how it divides its contacts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from instrument.fifths import COUNT, EDGES_KPA, fifths_of
from instrument.model.balloon import Balloon
from instrument.validation.trial import Bools, Floats

CONTACTS = 324
#: The board locks the circuit within this of its setpoint: a ΔP_i may lie as far outside the range.
HYSTERESIS_KPA = 0.1
SMALL_VOLUME_CHANGE = 0.2
#: With room for a filter, which never quite reaches a plateau.
FORCES_N = (0.99, 3.51)
RMSE_N, SHIFT_S = 0.578, 0.12
#: ΔV/V_i above 8.85 kPa: least, most, mean.
VOLUME_CHANGE = (0.01, 0.18, 0.095)
#: Mean errors [%] of the trials in Figs. 6a (slow) and 6b (fast).
SLOW_PERCENT, FAST_PERCENT = 2.88, 6.19

#: Of ΔP_i [kPa], ΔV/V_i and the true force [N]; true where a contact belongs.
Selection = Callable[[Floats, Floats, Floats], Bools]


class Group(NamedTuple):
    """Contacts that are averaged over, and the mean absolute errors [%] printed for them, by method."""

    name: str
    selects: Selection
    printed: Mapping[str, float]


def _fifth(n: int) -> Group:
    low_kpa, high_kpa = EDGES_KPA[n : n + 2]
    return Group(
        f"{low_kpa:.2f}–{high_kpa:.2f} kPa",
        lambda initial_kpa, _change, _force_n: fifths_of(initial_kpa) == n,
        {},
    )


#: The subsets of Fig. 7, whose errors are a chart only.
FIFTHS = tuple(_fifth(n) for n in range(COUNT))
ALL = Group("all contacts", lambda initial_kpa, _change, _force_n: initial_kpa > 0, {"energetic": 9.14})
#: Section VI: the same error again, "in the range [1-3.5] N".
USUAL = Group(
    "of them 1 to 3.5 N",
    lambda _initial_kpa, _change, force_n: (force_n >= FORCES_N[0]) & (force_n <= FORCES_N[1]),
    {"energetic": 9.14},
)
STIFF = Group(
    f"above {Balloon().switch_kpa} kPa",
    lambda initial_kpa, _change, _force_n: initial_kpa > Balloon().switch_kpa,
    {"energetic": 6.77, "lulevich": 14.15, "shanahan": 14.12},
)
SMALL = Group(
    f"ΔV/V_i < {SMALL_VOLUME_CHANGE}",
    lambda _initial_kpa, change, _force_n: change < SMALL_VOLUME_CHANGE,
    {"lulevich": 43.88, "shanahan": 52.27},
)
GROUPS = (ALL, USUAL, *FIFTHS, STIFF, SMALL)
