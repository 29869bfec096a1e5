"""Errors of a vent that failed, or that was not verified in time."""

from __future__ import annotations

from pneuforce.client.details import VENT_FAULTS, Details, fault_of
from pneuforce.client.measurement import Measurement, Status
from pneuforce.errors import Tripped, VentFailed, VentNotConfirmed
from pneuforce.registers.advice import STATUS_ADVICE

#: Faults that set the status bit `sensor_fault` or `link_lost`: the pressure proves no vent while one of them
#: is latched.
PREVENTING_FAULTS = frozenset(
    {"sensor", "sensor_frozen", "supply_voltage", "sensor_limit", "board_unresponsive", "link_lost"}
)


def failed_vent(first_out_fault: int, pressure_kpa: float | None) -> VentFailed:
    """Return the error of a failed vent. The first-out fault is named only if it is the cause."""
    fault, advice = fault_of(first_out_fault), STATUS_ADVICE["vent_fault"]
    if fault is None or fault.name not in VENT_FAULTS:
        return VentFailed("vent_fault", advice.what, advice.do, pressure_kpa)
    return VentFailed(fault.name, advice.what, fault.remedy, pressure_kpa)


def unconfirmed_vent(waited_s: float, measurement: Measurement, details: Details) -> VentNotConfirmed:
    """Return the error of a vent that was not verified in time, with the cause that prevents this.

    Without a zero adjustment, each latched fault prevents the verification: a tripped rig takes no zero.
    """
    not_zeroed = Status.NOT_ZEROED in measurement.status
    latched = details.latched_faults or filter(None, [details.first_out_fault])
    fault = next((each for each in latched if not_zeroed or each.name in PREVENTING_FAULTS), None)
    trip = fault and Tripped(fault.name, fault.cause, fault.remedy)
    return VentNotConfirmed(waited_s, measurement.pressure_kpa, trip, not_zeroed=not_zeroed)
