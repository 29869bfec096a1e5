"""Errors of a vent that failed, or that was not verified in time."""

from __future__ import annotations

from collections.abc import Callable

from pneuforce.client.details import VENT_FAULTS, fault_of, trip_of
from pneuforce.client.measurement import Measurement, State
from pneuforce.errors import VentFailed, VentNotConfirmed
from pneuforce.registers.advice import STATUS_ADVICE


def failed_vent(first_out_fault: int, pressure_kpa: float | None) -> VentFailed:
    """Return the error of a failed vent. The first-out fault is named only if it is the cause."""
    fault, advice = fault_of(first_out_fault), STATUS_ADVICE["vent_fault"]
    if fault is None or fault.name not in VENT_FAULTS:
        return VentFailed("vent_fault", advice.what, advice.do, pressure_kpa)
    return VentFailed(fault.name, advice.what, fault.remedy, pressure_kpa)


def unconfirmed_vent(
    waited_s: float, measurement: Measurement, first_out_fault: Callable[[], int]
) -> VentNotConfirmed:
    """Return the error of a vent that was not verified in time. After a trip, the error names the fault."""
    trip = trip_of(first_out_fault()) if measurement.state is State.TRIPPED else None
    return VentNotConfirmed(waited_s, measurement.pressure_kpa, trip)
