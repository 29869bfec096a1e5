"""Metrics for MQTT with Sparkplug B: name, datatype, meaning and source of each metric of an instrument.

Most metrics are registers. Their names, units, ranges and meanings are those of the register map.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import Any, NamedTuple

from pneuforce.registers.advice import FAULT_ADVICE
from pneuforce.registers.codes import CONDENSED
from pneuforce.registers.field import WireType
from pneuforce.registers.map import BY_NAME, Register

#: Value of a metric; None if the value is not available.
Value = float | int | bool | str | None
#: Header and latest SNAPSHOT of the stream of the instrument.
Reading = Mapping[str, Mapping[str, Any]]

VENT = "Vent"
VENT_RESULT = "Vent Result"
REBIRTH = "Node Control/Rebirth"
BIRTH_NUMBER = "bdSeq"


class Datatype(IntEnum):
    """Datatypes of Sparkplug B that an instrument uses, with their codes."""

    INT64 = 4
    FLOAT = 9
    BOOLEAN = 11
    STRING = 12


class SparkplugMetric(NamedTuple):
    """Metric of the device in a birth message."""

    name: str
    datatype: Datatype
    doc: str
    value: Callable[[Reading], Value]  #: function that reads the metric from a reading
    unit: str = ""
    low: float | None = None
    high: float | None = None

    @property
    def is_analog(self) -> bool:
        """Return True if the metric is published only after a change by more than a deadband."""
        return self.datatype is Datatype.FLOAT


def _register(name: str) -> SparkplugMetric:
    """Return the metric of a register. A status is a number, and the code of an enumeration is its name.

    All integers are Int64: host applications disagree about the field in which a UInt32 is transmitted.
    """
    register = BY_NAME[name]
    datatype = Datatype.FLOAT if register.wire is WireType.F32 else Datatype.INT64
    if register.values:
        datatype = Datatype.STRING
    return SparkplugMetric(
        name,
        datatype,
        register.doc,
        lambda reading: _register_value(register, reading),
        register.unit,
        register.low,
        register.high,
    )


def _register_value(register: Register, reading: Reading) -> Value:
    if register.constant is not None:
        return int(register.constant)
    value = reading["snapshot"].get(register.quantity)
    if register.bits:
        return None if value is None else register.bits.code(value)
    if register.values:
        return value if value in register.values.codes else None
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value) if register.wire is WireType.F32 else int(register.encode(value))


def _force_valid(reading: Reading) -> bool:
    """Return True if the status and the values agree that there is a force with its uncertainty."""
    values = (FORCE.value(reading), FORCE_UNCERTAINTY.value(reading))
    return "force_valid" in (reading["snapshot"].get("status") or ()) and None not in values


def _fault_text(reading: Reading) -> Value:
    code = reading["snapshot"].get("first_out_fault")
    advice = FAULT_ADVICE.get(code) if isinstance(code, int) else None
    return advice.what if advice else None if code is None else f"unknown fault {code}"


def _version(reading: Reading) -> Value:
    version = reading["header"].get("version")
    return None if version is None else str(version)


FORCE, FORCE_UNCERTAINTY = _register("force"), _register("force_uncertainty")
_FORCE_VALID_DOC = next(bit.doc for bit in CONDENSED.bits if bit.name == "force_valid")
FORCE_VALID = SparkplugMetric("force_valid", Datatype.BOOLEAN, _FORCE_VALID_DOC, _force_valid)

#: Metrics that can change with each sample.
MEASURED = (
    FORCE,
    FORCE_UNCERTAINTY,
    FORCE_VALID,
    *map(_register, ("pressure", "setpoint", "radius", "state", "status", "first_out_fault")),
    SparkplugMetric(
        "first_out_fault_text", Datatype.STRING, "Meaning of the first-out fault, in words.", _fault_text
    ),
    *map(_register, ("active_fault_count", "contact_counter", "peak_counter", "peak_force")),
)
#: Metrics that stay constant while the host process runs, or change rarely.
IDENTITY = (
    SparkplugMetric("version", Datatype.STRING, "Version of the program.", _version),
    *map(
        _register,
        (
            *("serial_number", "method", "calibration_date", "firmware_version"),
            *("map_version", "map_hash", "configuration_hash"),
        ),
    ),
)
METRICS = (*MEASURED, *IDENTITY)


def values_of(reading: Reading) -> dict[str, Value]:
    """Return the value of each metric. Without a valid force, force and uncertainty are None."""
    values = {metric.name: metric.value(reading) for metric in METRICS}
    if not values[FORCE_VALID.name]:
        values |= dict.fromkeys((FORCE.name, FORCE_UNCERTAINTY.name))
    return values


def unavailable_values() -> dict[str, Value]:
    """Return the values of the measured metrics while the instrument cannot be reached."""
    return dict.fromkeys((metric.name for metric in MEASURED), None) | {FORCE_VALID.name: False}
