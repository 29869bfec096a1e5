"""Validation results of the paper (Sections IV-B and V), and its groups of contacts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from pneuforce.instrument.model.balloon import Balloon
from pneuforce.instrument.model.pressure_bins import BIN_COUNT, BIN_EDGES_KPA, pressure_bin_indices
from pneuforce.instrument.validation.trial import Bools, Floats

CONTACT_COUNT = 324
#: The board locks the circuit within this difference from the setpoint. ΔP_i may therefore lie outside the
#: validated range by this much.
HYSTERESIS_KPA = 0.1
SMALL_VOLUME_CHANGE = 0.2
#: Range of the true force: 1 to 3.5 N, with a margin of 0.01 N at both limits. The margin is necessary,
#: because the filtered force never completely reaches its final value.
FORCE_RANGE_N = (0.99, 3.51)
#: Root mean square error [N] of the continuous force, and its time shift [s].
RMSE_N, SHIFT_S = 0.578, 0.12
#: ΔV/V_i above 8.85 kPa: minimum, maximum, mean.
VOLUME_CHANGE = (0.01, 0.18, 0.095)
#: Mean errors [%] of the trials in Figs. 6a (slow) and 6b (fast).
SLOW_PERCENT, FAST_PERCENT = 2.88, 6.19

#: Function of ΔP_i [kPa], ΔV/V_i and the true force [N]. It returns a mask of the contacts in the group.
Selection = Callable[[Floats, Floats, Floats], Bools]


class ContactGroup(NamedTuple):
    """Group of contacts, and its mean absolute error [%] in the paper for each method."""

    name: str
    selects: Selection
    published_percent: Mapping[str, float]


def _pressure_bin(index: int) -> ContactGroup:
    low_kpa, high_kpa = BIN_EDGES_KPA[index : index + 2]
    return ContactGroup(
        f"{low_kpa:.2f}–{high_kpa:.2f} kPa",
        lambda baseline_kpa, _change, _force_n: pressure_bin_indices(baseline_kpa) == index,
        {},
    )


#: Groups of contacts in Fig. 7. This figure shows their errors as a chart, and the paper states no numbers.
PRESSURE_BINS = tuple(_pressure_bin(index) for index in range(BIN_COUNT))
ALL_CONTACTS = ContactGroup(
    "all contacts", lambda baseline_kpa, _change, _force_n: baseline_kpa > 0, {"energetic": 9.14}
)
#: Section VI of the paper states the error of all contacts again, but "in the range [1-3.5] N".
STATED_RANGE = ContactGroup(
    "of them 1 to 3.5 N",
    lambda _baseline_kpa, _change, force_n: (force_n >= FORCE_RANGE_N[0]) & (force_n <= FORCE_RANGE_N[1]),
    {"energetic": 9.14},
)
ABOVE_SWITCH = ContactGroup(
    f"above {Balloon().switch_kpa} kPa",
    lambda baseline_kpa, _change, _force_n: baseline_kpa > Balloon().switch_kpa,
    {"energetic": 6.77, "lulevich": 14.15, "shanahan": 14.12},
)
SMALL_CHANGE = ContactGroup(
    f"ΔV/V_i < {SMALL_VOLUME_CHANGE}",
    lambda _baseline_kpa, change, _force_n: change < SMALL_VOLUME_CHANGE,
    {"lulevich": 43.88, "shanahan": 52.27},
)
GROUPS = (ALL_CONTACTS, STATED_RANGE, *PRESSURE_BINS, ABOVE_SWITCH, SMALL_CHANGE)
