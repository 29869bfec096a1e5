"""Details of an instrument beside its measurement: fault, requested values, lease and versions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from pneuforce.client.measurement import number_or_none
from pneuforce.errors import Tripped
from pneuforce.registers.advice import FAULT_ADVICE, REJECT_REASON_ADVICE
from pneuforce.registers.codes import FAULTS

#: Names of the faults that set the status bit `vent_fault`: the balloon may still be inflated.
VENT_FAULTS = frozenset({"vent_shut", "occlusion", "not_vented"})


class LatchedFault(NamedTuple):
    """Fault that has tripped the rig, with its cause and the remedy of docs/faults.md."""

    code: int  #: number of the fault in docs/faults.md
    name: str  #: name of the fault, for example "burst"
    cause: str  #: what has happened
    remedy: str  #: what to do


@dataclass(frozen=True, slots=True, kw_only=True)
class Details:
    """Details of an instrument. A value that is not available, or that the bus does not transmit, is None."""

    #: First fault of a trip. None also if the rig has tripped and the fault is unknown.
    first_out_fault: LatchedFault | None = None
    active_fault_count: int | None = None  #: number of latched faults
    latched_faults: tuple[LatchedFault, ...] = ()  #: first-out fault, then the others; empty over CAN
    setpoint_requested_kpa: float | None = None  #: setpoint of the next hold
    force_limit_n: float | None = None  #: limit of the status `FORCE_HIGH_ALARM`
    lease_holder: str | None = None  #: bus of the client that has the lease; "none" without a lease
    lease_left_s: float | None = None  #: time until the lease expires; None without a lease
    method: str | None = None  #: force model
    calibration_date: str | None = None  #: date of the calibration (ISO 8601); None without a calibration
    serial_number: int | None = None  #: serial number of the instrument
    balloon_id: int | None = None  #: number of the balloon
    firmware_version: int | None = None  #: of the board: major · 256 + minor
    firmware_origin: str | None = None  #: comparison with the released images, for example "current"
    firmware_image: int | None = None  #: CRC-32 of the image of the firmware
    inflation_count: int | None = None  #: number of inflations of this balloon
    maintenance_causes: frozenset[str] | None = None  #: causes of the status `MAINTENANCE_REQUIRED`
    map_version: int | None = None  #: version of the register map
    map_hash: int | None = None  #: hash of all declarations of all buses
    configuration_hash: int | None = None  #: hash of the configuration and the calibration
    #: Signature of the configuration at the start, for example "signed" by a trusted key, or "altered".
    configuration_signature: str | None = None
    calibration_signature: str | None = None  #: signature of the calibration; "no_file" without one


def fault_of(code: int) -> LatchedFault | None:
    """Return the fault with this code, None for 0 and for a code that this version does not know."""
    if not code or code not in FAULT_ADVICE:
        return None
    advice = FAULT_ADVICE[code]
    return LatchedFault(code, FAULTS.names[code], advice.what, advice.do)


def trip_of(code: int) -> Tripped:
    """Return the error of a trip with this first-out fault."""
    fault = fault_of(code)
    if fault is None:
        return Tripped("", "", REJECT_REASON_ADVICE["fault_latched"])
    return Tripped(fault.name, fault.cause, fault.remedy)


def _faults_of(mask: int, first: int) -> tuple[LatchedFault, ...]:
    """Return the known faults whose codes are bits of a mask: first the first-out fault."""
    codes = sorted(
        (code for code in FAULT_ADVICE if mask >> code & 1), key=lambda code: (code != first, code)
    )
    return tuple(fault for fault in map(fault_of, codes) if fault is not None)


def fault_named(name: str) -> LatchedFault | None:
    """Return the fault with this name, None for a name that this version does not know."""
    return next((fault_of(code) for code, each in FAULTS.names.items() if each == name), None)


def details_of(registers: Mapping[str, Any]) -> Details:
    """Return the details in the values of the registers, by register name."""
    held, first = registers["lease_holder"] != "none", int(registers["first_out_fault"])
    mask = int(registers["latched_faults_1"]) | int(registers["latched_faults_2"]) << 32
    return Details(
        first_out_fault=fault_of(first),
        latched_faults=_faults_of(mask, first),
        setpoint_requested_kpa=number_or_none(registers["setpoint_requested"]),
        force_limit_n=number_or_none(registers["force_limit"]),
        lease_left_s=number_or_none(registers["lease_left"]) if held else None,
        calibration_date=_iso_date(int(registers["calibration_date"])),
        **{
            name: registers[name]
            for name in (
                "active_fault_count",
                "lease_holder",
                "method",
                "serial_number",
                "balloon_id",
                "firmware_version",
                "firmware_origin",
                "firmware_image",
                "inflation_count",
                "maintenance_causes",
                "map_version",
                "map_hash",
                "configuration_hash",
                "configuration_signature",
                "calibration_signature",
            )
        },
    )


def _iso_date(code: int) -> str | None:
    """Return a date yyyymmdd as text, None for 0."""
    return f"{code // 10000:04d}-{code // 100 % 100:02d}-{code % 100:02d}" if code else None
