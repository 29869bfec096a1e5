"""Interlocks: what a sample must satisfy for the balloon to stay inflated, whatever the board says.

Each states what is allowed and is negated once, so that a NaN is never allowed. They look at the pressure
as sampled, not filtered and not compensated.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from instrument.chain import ALIVE
from instrument.faults import HostFault
from instrument.measurement import Measurement
from instrument.rig.frames import COUNTS_LIMIT, BoardState, Sample

HARD_LIMIT_KPA = 25.0
LOWEST_KPA = -5.0
SUPPLY_MV = (4750, 5250)
_FILLED = (BoardState.INFLATING, BoardState.SETTLING, BoardState.HOLDING)


@dataclass(frozen=True, slots=True)
class Limits:
    """What the configuration allows, below the hard limits."""

    contact_kpa: float = 18.0


@dataclass(frozen=True, slots=True)
class Interlock:
    """A condition on one sample, and the fault that it raises where it is not met."""

    fault: HostFault
    allowed: Callable[[Sample, Measurement, Limits], bool]


def _pressure_allowed(sample: Sample, m: Measurement, limits: Limits) -> bool:
    limit_kpa = min(limits.contact_kpa, HARD_LIMIT_KPA)
    return sample.state not in _FILLED or LOWEST_KPA <= m.unfiltered_kpa <= limit_kpa


def _sensor_allowed(sample: Sample, m: Measurement, limits: Limits) -> bool:  # noqa: ARG001
    return (
        ALIVE[0] <= sample.adc_sum / COUNTS_LIMIT <= ALIVE[1]
        and SUPPLY_MV[0] <= sample.supply_mv <= SUPPLY_MV[1]
    )


INTERLOCKS: tuple[Interlock, ...] = (
    Interlock(HostFault.SENSOR_LIMIT, _sensor_allowed),
    Interlock(HostFault.PRESSURE_LIMIT, _pressure_allowed),
)


def violated(sample: Sample, measurement: Measurement, limits: Limits) -> HostFault | None:
    """Fault of the first interlock that does not allow this sample, None where all do."""
    return next((i.fault for i in INTERLOCKS if not i.allowed(sample, measurement, limits)), None)
