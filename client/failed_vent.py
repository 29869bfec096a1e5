"""Errors of a vent that failed, or that was not verified in time."""

from __future__ import annotations

from pneuforce.client.details import VENT_FAULTS, Details, fault_of
from pneuforce.client.measurement import INFLATED, Measurement, Status
from pneuforce.errors import Tripped, VentFailed, VentNotConfirmed, sentence
from pneuforce.registers.advice import MAINTENANCE_ADVICE, STATUS_ADVICE

#: Faults that set the status bit `sensor_fault` or `link_lost`: the pressure proves no vent while one of them
#: is latched.
PREVENTING_FAULTS = frozenset(
    {"sensor", "sensor_frozen", "supply_voltage", "sensor_limit", "board_unresponsive", "link_lost"}
)

#: Cause of `maintenance_required` (register 74) after which the pressure proves no vent.
TUBE_UNPROVEN = "tube_unproven"


def check_tube_proven(details: Details, pressure_kpa: float | None) -> None:
    """Raise VentNotConfirmed if the tube was blocked, and no proof test has passed since.

    After a blockage, a pressure of 0 kPa does not show an empty balloon.
    """
    if TUBE_UNPROVEN in (details.maintenance_causes or ()):
        cause, remedy = MAINTENANCE_ADVICE[TUBE_UNPROVEN]
        text = f"the vent was sent, but not confirmed ({TUBE_UNPROVEN}): {cause} {remedy}"
        raise VentNotConfirmed(text, pressure_kpa, remedy=remedy)


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
    pressure_kpa = measurement.pressure_kpa
    if measurement.state in INFLATED:
        return _still_inflated(waited_s, pressure_kpa)
    pressure = (
        "no pressure is available" if pressure_kpa is None else f"the pressure is {pressure_kpa:.2f} kPa"
    )
    not_zeroed = Status.NOT_ZEROED in measurement.status
    latched = details.latched_faults or filter(None, [details.first_out_fault])
    fault = next((each for each in latched if not_zeroed or each.name in PREVENTING_FAULTS), None)
    if fault:
        trip = Tripped(fault.name, fault.cause, fault.remedy)
        text = (
            f"the vent was sent, but was not verified, because the fault {fault.name} is latched "
            f"({pressure}). If the balloon is inflated, press the stop switch at the rig. "
            f"{sentence(str(trip))}"
        )
        return VentNotConfirmed(text, pressure_kpa, fault.name, fault.remedy)
    if not_zeroed:
        text = (
            "the vent was sent, but cannot be verified because the sensor has no zero adjustment "
            f"({pressure}). If the balloon is inflated, press the stop switch at the rig. The zero is taken "
            "when the rig is vented and the pressure is steady within ±1.3 kPa"
        )
        return VentNotConfirmed(text, pressure_kpa)
    text = (
        f"the vent was sent, but the instrument did not verify within {waited_s:g} s that the balloon "
        f"is empty ({pressure}): press the stop switch at the rig, then check the vent valve and the tube"
    )
    return VentNotConfirmed(text, pressure_kpa)


def _still_inflated(waited_s: float, pressure_kpa: float | None) -> VentNotConfirmed:
    """Return the error of a balloon that was not vented, or that another peer has inflated."""
    pressure = "" if pressure_kpa is None else f" at {pressure_kpa:.2f} kPa"
    remedy = "Send a vent. If the balloon stays inflated, press the stop switch at the rig."
    text = (
        f"after {waited_s:g} s, the balloon is still inflated{pressure}. {remedy} (A replay ignores vents.)"
    )
    return VentNotConfirmed(text, pressure_kpa, remedy=remedy)
