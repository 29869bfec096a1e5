"""Error of a vent that the instrument reports as failed."""

from __future__ import annotations

from pneuforce.client.details import VENT_FAULTS, fault_of
from pneuforce.errors import VentFailed
from pneuforce.registers.advice import STATUS_ADVICE


def failed_vent(first_out_fault: int, pressure_kpa: float | None) -> VentFailed:
    """Return the error of a failed vent. The first-out fault is named only if it is the cause."""
    fault, advice = fault_of(first_out_fault), STATUS_ADVICE["vent_fault"]
    if fault is None or fault.name not in VENT_FAULTS:
        return VentFailed("vent_fault", advice.what, advice.do, pressure_kpa)
    return VentFailed(fault.name, advice.what, fault.remedy, pressure_kpa)
