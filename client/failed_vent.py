"""Errors of a vent that failed, or that was not verified in time."""

from __future__ import annotations

from pneuforce.client.details import VENT_FAULTS, Details, fault_of
from pneuforce.client.measurement import INFLATED, Measurement, Status
from pneuforce.errors import ClientError, Tripped, VentFailed, VentNotConfirmed
from pneuforce.registers.advice import MAINTENANCE_ADVICE, STATUS_ADVICE

#: Faults that set the status bit `sensor_fault` or `link_lost`: the pressure proves no vent while one of them
#: is latched.
PREVENTING_FAULTS = frozenset(
    {"sensor", "sensor_frozen", "supply_voltage", "sensor_limit", "board_unresponsive", "link_lost"}
)

#: Cause of `maintenance_required` (register 74) after which the pressure proves no vent.
TUBE_UNPROVEN = "tube_unproven"


class TubeUnproven(VentNotConfirmed):
    """Vent of a rig whose tube was blocked before: a pressure of 0 kPa does not show an empty balloon."""

    def __init__(self, pressure_kpa: float | None) -> None:
        cause, self.remedy = MAINTENANCE_ADVICE[TUBE_UNPROVEN]
        text = f"the vent was sent, but not confirmed ({TUBE_UNPROVEN}): {cause} {self.remedy}"
        ClientError.__init__(self, text)
        self.pressure_kpa = pressure_kpa


class BalloonInflated(VentNotConfirmed):
    """Balloon that is still inflated, because no vent was sent, or another peer has inflated it."""

    def __init__(self, waited_s: float, pressure_kpa: float | None) -> None:
        pressure = "" if pressure_kpa is None else f" at {pressure_kpa:.2f} kPa"
        self.remedy = "Send a vent. If the balloon stays inflated, press the stop switch at the rig."
        text = f"after {waited_s:g} s, the balloon is still inflated{pressure}. {self.remedy}"
        ClientError.__init__(self, text)
        self.pressure_kpa = pressure_kpa


def check_tube_proven(details: Details, pressure_kpa: float | None) -> None:
    """Raise TubeUnproven if the tube was blocked, and no proof test has passed since."""
    if TUBE_UNPROVEN in (details.maintenance_causes or ()):
        raise TubeUnproven(pressure_kpa)


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
    if measurement.state in INFLATED:
        return BalloonInflated(waited_s, measurement.pressure_kpa)
    not_zeroed = Status.NOT_ZEROED in measurement.status
    latched = details.latched_faults or filter(None, [details.first_out_fault])
    fault = next((each for each in latched if not_zeroed or each.name in PREVENTING_FAULTS), None)
    trip = fault and Tripped(fault.name, fault.cause, fault.remedy)
    return VentNotConfirmed(waited_s, measurement.pressure_kpa, trip, not_zeroed=not_zeroed)
