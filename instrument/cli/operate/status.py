"""`pneuforce status`: state, fault, force, pressure, lease, firmware and versions of a running instrument."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from importlib.metadata import version
from typing import Any

from pneuforce.client.address import connect_any_map
from pneuforce.client.details import Details, LatchedFault
from pneuforce.client.measurement import Measurement, State, Status
from pneuforce.instrument.cli.operate.instrument_address import command
from pneuforce.instrument.cli.terminal.command_words import fault_values, in_command_words
from pneuforce.instrument.cli.terminal.output import done_json, hanging, pressure_text, print_text
from pneuforce.protocol.firmware_version import format_version
from pneuforce.registers.advice import (
    FIRMWARE_ORIGIN_DESCRIPTIONS,
    MAINTENANCE_ADVICE,
    STATE_DESCRIPTIONS,
    STATUS_ADVICE,
)
from pneuforce.registers.map import BY_NAME
from pneuforce.registers.map_hash import MAP_HASH

NOT_AVAILABLE = "not available"
EXAMPLE_SETPOINT_KPA = 6.5  #: shown if the instrument has no setpoint yet
#: Conditions that other lines of the output show, that repeat another condition, or that describe the normal
#: operation.
_SHOWN_ELSEWHERE = frozenset(
    {
        Status.INFLATING,
        Status.HOLDING,
        Status.VENTED,
        Status.FAILURE,
        Status.ANY_FAILURE,
        Status.FUNCTION_CHECK,
        Status.OUT_OF_SPECIFICATION,
        Status.CALIBRATED,
    }
)
#: Conditions that a latched fault sets, and whose remedy is that of the fault.
_STATUS_BITS = BY_NAME["status"].bits
assert _STATUS_BITS is not None
_OF_FAULTS = frozenset(Status(bit.name) for bit in _STATUS_BITS.bits if bit.latches)


def show_status(url: str, as_json: bool) -> None:
    """Read the instrument at `url` and print its status. Raises ClientError."""
    with connect_any_map(url) as sensor:
        measurement, details = sensor.read(), sensor.details()
    if as_json:
        print_text(done_json(_own_words(_state_text(measurement)), **facts(url, measurement, details)))
    else:
        rows = [
            f"{name:<10} {hanging(_own_words(text), 11)}" for name, text in lines(measurement, details, url)
        ]
        print_text("\n".join(rows))


def _own_words(text: str) -> str:
    """Return a text in the words of the command line, without a reference to this command."""
    return in_command_words(text).replace(" (pneuforce status)", "")


def facts(url: str, measurement: Measurement, details: Details) -> dict[str, Any]:
    """Return the status for JSON, with None or NaN for everything that is not available.

    `warning` describes another register map, and is None otherwise.
    """
    fault, status = details.first_out_fault, measurement.status_or_none
    return {
        "address": url,
        "state": measurement.state,
        "status": None if status is None else sorted(status),
        "simulated": None if status is None else Status.SIMULATED in status,
        "first_out_fault": None if fault is None else fault_values(fault),
        "active_fault_count": details.active_fault_count,
        "latched_faults": [each.name for each in details.latched_faults],
        "force_n": measurement.force_or_nan,
        "force_std_n": measurement.force_std_or_nan,
        "no_force_because": in_command_words(measurement.explanation) or None,
        "no_force_remedy": in_command_words(_remedy(measurement, fault)) or None,
        "pressure_kpa": measurement.pressure_kpa,
        "radius_mm": measurement.radius_mm,
        "setpoint_kpa": measurement.setpoint_kpa,
        "setpoint_requested_kpa": details.setpoint_requested_kpa,
        "force_limit_n": details.force_limit_n,
        "maintenance_causes": None
        if details.maintenance_causes is None
        else sorted(details.maintenance_causes),
        "sample_age_s": measurement.age_s,
        "lease": None if details.lease_left_s is None else _lease(details),
        "versions": _versions(details),
        "warning": _map_warning(details),
    }


def _remedy(measurement: Measurement, fault: LatchedFault | None) -> str:
    """Return what to do about a missing force. After a trip, this is the remedy of the first-out fault."""
    return fault.remedy if fault and measurement.state is State.TRIPPED else measurement.remedy


def lines(measurement: Measurement, details: Details, url: str) -> Iterator[tuple[str, str]]:
    """Yield the name and the text of each line."""
    if warning := _map_warning(details):
        yield "warning", warning
    yield "state", _state_text(measurement)
    yield "fault", _fault_text(details)
    for fault in _later_faults(details):
        yield "also", f"{fault.name}: {fault.cause} {fault.remedy}"
    attention = _attention(measurement, details)
    yield "force", _force_text(measurement, details, attention, url)
    yield "pressure", pressure_text(measurement.pressure_kpa)
    yield "setpoint", _setpoint_text(measurement.setpoint_kpa, details.setpoint_requested_kpa)
    if details.force_limit_n is not None:
        yield "limit", f"{details.force_limit_n:g} N, above which the force alarm is set"
    yield "lease", _lease_text(details)
    yield "firmware", _firmware_text(details)
    for each in attention:
        what, do = STATUS_ADVICE[each]
        if each is Status.MAINTENANCE_REQUIRED and details.maintenance_causes:
            yield from _maintenance_lines(details.maintenance_causes)
        else:
            yield "attention", f"{each}: {what} {do}".rstrip()
    if measurement.status_or_none is None:
        yield "attention", "the status is unknown, because this bus does not transmit it"
    versions = {name: value for name, value in _versions(details).items() if not name.startswith("firmware")}
    yield "versions", ", ".join(f"{name} {value}" for name, value in versions.items() if value)


def _state_text(measurement: Measurement) -> str:
    """Return the state and its description."""
    state = str(measurement.state or "unknown")
    return f"{state}: {STATE_DESCRIPTIONS.get(state, 'this program does not know the state.')}"


def _map_warning(details: Details) -> str | None:
    """Return a warning if the instrument and this program have different register maps."""
    if details.map_hash in (None, MAP_HASH):
        return None
    return (
        f"the map hash of the instrument is {_hexadecimal(details.map_hash)}, and that of this program is "
        f"{_hexadecimal(MAP_HASH)}. Values can therefore be wrong: install the same version of pneuforce on "
        "both computers. The commands vent and watch also work."
    )


def force_text(measurement: Measurement) -> str:
    """Return the force with its expanded uncertainty, or the reason why there is none, and the remedy."""
    if not measurement.valid:
        return in_command_words(f"{NOT_AVAILABLE}: {measurement.explanation} {measurement.remedy}").rstrip()
    std_n = measurement.force_std_n
    uncertainty = NOT_AVAILABLE if std_n is None else f"{2 * std_n:.3f} N"
    return f"{measurement.force_n:.3f} N ± {uncertainty} (2 u)"


def _attention(measurement: Measurement, details: Details) -> list[Status]:
    """Return the conditions that no other line shows. The line of a fault shows those of the fault."""
    status = measurement.status_or_none or frozenset()
    shown = set(_SHOWN_ELSEWHERE)
    if details.latched_faults:
        shown |= _OF_FAULTS
    if any(fault.name == Status.LINK_LOST for fault in details.latched_faults):
        shown.add(Status.LINK_LOST)
    if Status.LINK_LOST in status:
        shown.add(Status.STALE)
    return sorted(status - shown)


def _maintenance_lines(causes: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield a line for each cause of maintenance, with its remedy."""
    for cause in sorted(causes):
        what, do = MAINTENANCE_ADVICE[cause]
        yield "attention", f"{Status.MAINTENANCE_REQUIRED}: {cause}: {what} {do}"


def _force_text(measurement: Measurement, details: Details, attention: Sequence[Status], url: str) -> str:
    """Return the force, or why there is none. Other lines explain the state and `attention`."""
    if measurement.state is State.VENTED and measurement.reasons == (Status.FUNCTION_CHECK,):
        setpoint_kpa = details.setpoint_requested_kpa or EXAMPLE_SETPOINT_KPA
        return f"{NOT_AVAILABLE}: to measure, inflate the balloon: {command(f'hold {setpoint_kpa:g}', url)}"
    if not measurement.valid and measurement.state not in (None, State.HOLDING):
        return f"{NOT_AVAILABLE} in this state"
    causes = [reason for reason in measurement.reasons if reason in attention]
    return f"{NOT_AVAILABLE}: {', '.join(causes)}" if causes else force_text(measurement)


def _setpoint_text(in_effect_kpa: float | None, requested_kpa: float | None) -> str:
    if in_effect_kpa == requested_kpa:
        return pressure_text(requested_kpa)
    return f"{pressure_text(in_effect_kpa)} (requested {pressure_text(requested_kpa)})"


def _fault_text(details: Details) -> str:
    fault = details.first_out_fault
    if fault is None:
        return "none" if details.active_fault_count == 0 else "unknown"
    return f"{fault.name}: {fault.cause} {fault.remedy}"


def _later_faults(details: Details) -> Iterator[LatchedFault]:
    """Yield all faults that were latched after the first-out fault."""
    return (each for each in details.latched_faults if each != details.first_out_fault)


def _lease_text(details: Details) -> str:
    if details.lease_left_s is None:
        return "none" if details.lease_holder == "none" else "unknown"
    return f"{details.lease_left_s:.1f} s left, the holder is a client of {details.lease_holder}"


def _firmware_text(details: Details) -> str:
    version = details.firmware_version
    if version is None:
        return "unknown"
    image = f"{format_version(version)}, image {details.firmware_image:08X}: " if version else ""
    return image + FIRMWARE_ORIGIN_DESCRIPTIONS.get(str(details.firmware_origin), NOT_AVAILABLE)


def _lease(details: Details) -> dict[str, Any]:
    return {"holder": details.lease_holder, "left_s": details.lease_left_s}


def _versions(details: Details) -> dict[str, Any]:
    """Return the versions of this program and of the instrument. Hashes are shown as hexadecimal numbers."""
    return {
        "this_program": version("pneuforce"),
        "map_version": details.map_version,
        "map_hash": _hexadecimal(details.map_hash),
        "configuration_hash": _hexadecimal(details.configuration_hash),
        "configuration_signature": details.configuration_signature,
        "calibration_signature": details.calibration_signature,
        "serial_number": details.serial_number,
        "method": details.method,
        "calibration_date": details.calibration_date,
        "balloon_id": details.balloon_id,
        "firmware_version": format_version(details.firmware_version) if details.firmware_version else None,
        "firmware_origin": details.firmware_origin,
        "firmware_image": _hexadecimal(details.firmware_image),
    }


def _hexadecimal(value: int | None) -> str | None:
    return None if value is None else f"{value:08x}"
