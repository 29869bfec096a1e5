"""Interlocks of the host: conditions that each sample must meet; a violation trips the rig.

Every comparison with NaN is false, so an interlock never allows NaN. Interlocks use the pressure as sampled,
without filter and lag compensation. The pressure limits apply only while the balloon is inflated. The board
has limits of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from pneuforce.instrument.core.faults import HostFault
from pneuforce.instrument.measurement.measurement import Measurement, Quality
from pneuforce.instrument.rig.link import RawSample
from pneuforce.protocol.limits import HARD_LIMIT_KPA, PRESSURISED, SUPPLY_MV

MIN_KPA = -5.0

Allowed = Callable[[RawSample, Measurement, float], bool]


class Interlock(NamedTuple):
    """Condition for an allowed sample. `samples` consecutive violations raise `fault`."""

    fault: HostFault
    samples: int
    allowed: Allowed


def _board_alive(raw: RawSample, m: Measurement, limit_kpa: float) -> bool:  # noqa: ARG001
    return not raw.clock_invalid


def _sensor_allowed(raw: RawSample, m: Measurement, limit_kpa: float) -> bool:  # noqa: ARG001
    supplied = SUPPLY_MV[0] <= raw.message.supply_mv <= SUPPLY_MV[1]
    return supplied and Quality.SENSOR_FAULT not in m.quality


def _pressure_allowed(raw: RawSample, m: Measurement, limit_kpa: float) -> bool:
    if raw.message.state not in PRESSURISED or Quality.SENSOR_FAULT in m.quality:
        return True
    return MIN_KPA <= m.unfiltered_kpa <= min(limit_kpa, HARD_LIMIT_KPA)


INTERLOCKS: tuple[Interlock, ...] = (
    Interlock(HostFault.BOARD_UNRESPONSIVE, 1, _board_alive),
    Interlock(HostFault.SENSOR_LIMIT, 5, _sensor_allowed),
    Interlock(HostFault.PRESSURE_LIMIT, 3, _pressure_allowed),
)


def violated(raw: RawSample, m: Measurement, limit_kpa: float) -> HostFault | None:
    """Return the fault of the first interlock that does not allow this sample, or None.

    `limit_kpa` is the configured pressure limit of the locked balloon [kPa].
    """
    return next((i.fault for i in INTERLOCKS if not i.allowed(raw, m, limit_kpa)), None)


@dataclass(slots=True)
class InterlockMonitor:
    """Counter of consecutive violations, so that one disturbed sample does not trip the rig."""

    _violations: list[int] = field(default_factory=lambda: [0] * len(INTERLOCKS))

    def step(self, raw: RawSample, m: Measurement, limit_kpa: float) -> HostFault | None:
        """Return the fault of the first interlock with enough consecutive violations, or None."""
        for index, interlock in enumerate(INTERLOCKS):
            allowed = interlock.allowed(raw, m, limit_kpa)
            self._violations[index] = 0 if allowed else self._violations[index] + 1
        return next(
            (i.fault for i, count in zip(INTERLOCKS, self._violations, strict=True) if count >= i.samples),
            None,
        )
