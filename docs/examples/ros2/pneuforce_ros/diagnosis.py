"""Diagnosis of the instrument as a ROS diagnostic status: level, message and values. Needs no ROS."""

from __future__ import annotations

from typing import NamedTuple

from pneuforce import Measurement, State, Status
from pneuforce.registers.advice import STATE_DESCRIPTIONS, STATUS_ADVICE

OK, WARN, ERROR = range(3)  # the levels of diagnostic_msgs/DiagnosticStatus
#: Conditions of normal operation. Any other condition is at least a warning.
NORMAL = frozenset(
    {
        Status.CALIBRATED,
        Status.FUNCTION_CHECK,
        Status.HOLDING,
        Status.IN_CONTACT,
        Status.INFLATING,
        Status.INTERPOLATED,
        Status.VENTED,
        Status.WRITE_PROTECT,
    }
)
#: Conditions in which a machine must stop.
ERRORS = frozenset({Status.ANY_FAILURE, Status.FAILURE, Status.LINK_LOST, Status.STALE})
#: Conditions that only summarize others. Their advice is shown if there is no other.
SUMMARIES = frozenset(
    {
        Status.ANY_FAILURE,
        Status.FAILURE,
        Status.MAINTENANCE_REQUIRED,
        Status.OUT_OF_SPECIFICATION,
        Status.SIMULATED,
    }
)
#: Conditions that change too often to publish each change at once.
FREQUENT = frozenset({Status.IN_CONTACT, Status.INTERPOLATED})
UNKNOWN = "unknown"


class Diagnosis(NamedTuple):
    """Level, message and values of one diagnostic status."""

    level: int
    message: str
    values: tuple[tuple[str, str], ...] = ()


def diagnose(measurement: Measurement, trip: str = "") -> Diagnosis:
    """Return the diagnosis of a measurement.

    `trip` explains the last trip during a hold of this node, with its fault and remedy. It is used while the
    rig is tripped.
    """
    trip = trip if measurement.state is State.TRIPPED else ""
    notable = sorted(known_status(measurement) - NORMAL, key=lambda bit: (bit in SUMMARIES, bit.value))
    level = _level(measurement, bool(notable))
    values = [*_measured(measurement), *(("fault", trip) for _ in range(bool(trip)))]
    values += [(bit.value, advice(bit)) for bit in notable]
    return Diagnosis(level, trip or _message(measurement, notable), tuple(values))


def connection_lost(error: Exception) -> Diagnosis:
    """Return the diagnosis while there is no connection to the instrument."""
    return Diagnosis(ERROR, f"no connection: {error}", (("connected", "false"), ("force_valid", "false")))


def changes_at(measurement: Measurement) -> tuple[State | None, frozenset[Status]]:
    """Return a value whose change must be published at once."""
    return measurement.state, known_status(measurement) - FREQUENT


def known_status(measurement: Measurement) -> frozenset[Status]:
    """Return the conditions that are known to be present. Over RDT, no condition is known."""
    return measurement.status_or_none or frozenset()


def advice(status: Status) -> str:
    """Return the meaning of a condition, and what to do."""
    meaning = STATUS_ADVICE[status.value]
    return f"{meaning.what} {meaning.do}".strip()


def _level(measurement: Measurement, is_notable: bool) -> int:
    nothing_known = measurement.state is None and not measurement.valid
    if measurement.state is State.TRIPPED or known_status(measurement) & ERRORS or nothing_known:
        return ERROR
    return WARN if is_notable or measurement.state is State.BOOT else OK


def _message(measurement: Measurement, notable: list[Status]) -> str:
    if notable:
        return f"{notable[0].value}: {advice(notable[0])}"
    state = measurement.state
    if state is not None:
        return f"{state}: {STATE_DESCRIPTIONS[state.value]}"
    if not measurement.valid:
        return "the force is not valid, and its state is unknown"
    unknown = ", but the bus does not transmit the status" if measurement.status_or_none is None else ""
    return f"the force is valid{unknown}"


def _measured(measurement: Measurement) -> list[tuple[str, str]]:
    """Return the measured values as texts. The age is that of the sample."""
    numbers = {
        "pressure_kpa": measurement.pressure_kpa,
        "setpoint_kpa": measurement.setpoint_kpa,
        "radius_mm": measurement.radius_mm,
        "force_std_n": measurement.force_std_n if measurement.valid else None,
        "age_s": measurement.age_s,
    }
    return [
        ("connected", "true"),
        ("state", str(measurement.state or UNKNOWN)),
        ("force_valid", str(measurement.valid).lower()),
        ("calibrated", _calibrated(measurement)),
        *((name, UNKNOWN if value is None else f"{value:.4g}") for name, value in numbers.items()),
    ]


def _calibrated(measurement: Measurement) -> str:
    if measurement.status_or_none is None:
        return UNKNOWN
    return str(Status.CALIBRATED in measurement.status).lower()
