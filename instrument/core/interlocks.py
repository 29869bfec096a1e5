"""Interlocks: what samples must satisfy for the balloon to stay inflated, whatever the board says.

Each states what is allowed and is negated once, so that a NaN is never allowed. They look at the pressure
as sampled, not filtered and not compensated. The board has the first look, and limits of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from instrument.faults import HostFault
from instrument.measurement import Measurement, Quality
from instrument.rig.limits import HARD_LIMIT_KPA, PRESSURISED, SUPPLY_MV
from instrument.rig.link import RawSample

LOWEST_KPA = -5.0

Allowed = Callable[[RawSample, Measurement, float], bool]


class Interlock(NamedTuple):
    """A condition, and the fault that it raises when as many samples in a row do not meet it."""

    fault: HostFault
    samples: int
    allowed: Allowed


def _board_alive(raw: RawSample, m: Measurement, limit_kpa: float) -> bool:  # noqa: ARG001
    return not raw.frozen


def _sensor_allowed(raw: RawSample, m: Measurement, limit_kpa: float) -> bool:  # noqa: ARG001
    supplied = SUPPLY_MV[0] <= raw.message.supply_mv <= SUPPLY_MV[1]
    return supplied and Quality.SENSOR not in m.quality


def _pressure_allowed(raw: RawSample, m: Measurement, limit_kpa: float) -> bool:
    if raw.message.state not in PRESSURISED or Quality.SENSOR in m.quality:
        return True
    return LOWEST_KPA <= m.unfiltered_kpa <= min(limit_kpa, HARD_LIMIT_KPA)


INTERLOCKS: tuple[Interlock, ...] = (
    Interlock(HostFault.SENSOR_STUCK, 1, _board_alive),
    Interlock(HostFault.SENSOR_LIMIT, 5, _sensor_allowed),
    Interlock(HostFault.PRESSURE_LIMIT, 3, _pressure_allowed),
)


def violated(raw: RawSample, m: Measurement, limit_kpa: float) -> HostFault | None:
    """Fault of the first interlock that does not allow this sample, None where all do.

    `limit_kpa` is the configured pressure limit of the locked balloon.
    """
    return next((i.fault for i in INTERLOCKS if not i.allowed(raw, m, limit_kpa)), None)


class InterlockWatch:
    """Counts samples in a row: one disturbed sample trips nothing."""

    def __init__(self) -> None:
        self._broken = [0] * len(INTERLOCKS)

    def step(self, raw: RawSample, m: Measurement, limit_kpa: float) -> HostFault | None:
        """Fault of the first interlock that has not been met for long enough."""
        for index, interlock in enumerate(INTERLOCKS):
            allowed = interlock.allowed(raw, m, limit_kpa)
            self._broken[index] = 0 if allowed else self._broken[index] + 1
        return next(
            (i.fault for i, broken in zip(INTERLOCKS, self._broken, strict=True) if broken >= i.samples), None
        )
