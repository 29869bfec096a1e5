"""Sections of the configuration file for rig, balloon, measurement, safety, files and identity.

Each key has its default, its meaning and its limits.
"""

from __future__ import annotations

from datetime import date
from typing import Annotated

from pydantic import AfterValidator, Field

from pneuforce.instrument.config.text_checks import Text, check_rig_port
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import Balloon, Circuit
from pneuforce.instrument.model.law import Low, MethodName, Switch
from pneuforce.support.toml_sections import Section

MIN_PROOF_TEST_S = 10.0


def _check_date(code: int) -> int:
    """Return `code`. Raises ValueError if it is neither 0 nor a date as yyyymmdd."""
    if code:
        date.fromisoformat(f"{code:08d}")
    return code


def _check_period(period_s: float) -> float:
    """Return `period_s`. Raises ValueError if it is neither 0 nor at least 10 s."""
    if 0 < period_s < MIN_PROOF_TEST_S:
        raise ValueError(f"must be 0 or at least {MIN_PROOF_TEST_S:g}")
    return period_s


_BALLOON, _CIRCUIT, _CHAIN, _SETTINGS = Balloon(), Circuit(), ChainSettings(), Settings()


class RigSection(Section):
    """The board at the end of the serial cable."""

    port: Annotated[str, AfterValidator(check_rig_port)] = Field(
        "/dev/ttyACM0",
        min_length=1,
        description="device (preferably its /dev/serial/by-id name), or socket://host:port",
    )
    require_released_firmware: bool = Field(
        False, description="reject mode hold if the image of the firmware is not a released image"
    )


class BalloonSection(Section):
    """The balloon: membrane and measured radius R_i = rest + linear ΔP + quadratic ΔP²."""

    young_kpa: float = Field(_BALLOON.young_kpa, ge=100, le=20_000, description="Young's modulus E [kPa]")
    poisson: float = Field(_BALLOON.poisson, ge=0.3, le=0.5, description="Poisson's ratio ν")
    rest_radius_mm: float = Field(
        _BALLOON.rest_radius_mm, ge=1, le=30, description="radius R_0 of the empty balloon [mm]"
    )
    rest_thickness_mm: float = Field(
        _BALLOON.rest_thickness_mm, ge=0.01, le=1, description="membrane thickness h_0 [mm]"
    )
    radius_linear_mm_per_kpa: float = Field(
        _BALLOON.radius_linear_mm_per_kpa, ge=0, le=1, description="linear term of the radius"
    )
    radius_quadratic_mm_per_kpa2: float = Field(
        _BALLOON.radius_quadratic_mm_per_kpa2, ge=0, le=0.1, description="quadratic term of the radius"
    )
    id: int = Field(
        0, ge=0, le=0xFFFF_FFFF, description="number of the fitted balloon; new-balloon accepts 0 to 65535"
    )


class CircuitSection(Section):
    """The gas in tubes and balloon."""

    volume_mm3: float = Field(
        _CIRCUIT.volume_mm3, ge=100, le=1e6, description="volume V_c of all tubes [mm³]"
    )
    ambient_kpa: float = Field(
        _CIRCUIT.ambient_kpa, ge=60, le=110, description="ambient pressure P_0 [kPa absolute]"
    )


class MeasurementSection(Section):
    """The measuring chain from pressure to force."""

    method: MethodName = Field(_CHAIN.law.method, description="force model")
    switch: Switch = Field(
        _CHAIN.law.switch, description="change of the stretching energy at 8.85 kPa: a step, or a blend"
    )
    low: Low = Field(
        _CHAIN.law.low, description="force below a rise of 0.5 kPa: a straight line to zero, or a smooth join"
    )
    pressed_sides: int = Field(
        _CHAIN.law.sides,
        ge=1,
        le=2,
        description="number of sides on which the balloon is pressed, method membrane",
    )
    grip: float = Field(
        _CHAIN.law.grip,
        ge=0,
        le=1,
        description="grip of the contact, method membrane: 0 if the skin slides, 1 if it sticks; "
        "pneuforce calibrate grip measures it",
    )
    grip_std: float = Field(
        _CHAIN.input_uncertainties.grip,
        ge=0,
        le=1,
        description="standard uncertainty of the grip; the default is that of an unknown grip",
    )
    filter_time_constant_s: float = Field(
        _CHAIN.filter_time_constant_s,
        ge=0.002,
        le=1,
        description="time constant of the filter of the displayed pressure [s]",
    )
    tube_time_constant_s: float = Field(
        _CHAIN.tube_time_constant_s,
        ge=0,
        le=0.5,
        description="time constant of the lag between balloon and sensor, which is compensated [s]",
    )
    reference_timeout_s: float = Field(
        _SETTINGS.reference_timeout_s,
        ge=0,
        le=3600,
        description="time after a write of register 518 in which the force is valid [s]; 0: not limited",
    )
    ambient_timeout_s: float = Field(
        _SETTINGS.ambient_timeout_s,
        ge=1,
        le=86_400,
        description="time after a write of register 556 in which this ambient pressure is used [s]",
    )
    ambient_std_kpa: float = Field(
        _CHAIN.ambient_std_kpa,
        ge=0.001,
        le=5,
        description="standard uncertainty of the ambient pressure that is written to register 556 [kPa]",
    )
    ambient_required: bool = Field(
        False, description="set the status bit maintenance_required without a recent ambient pressure"
    )
    calibration: Text = Field(
        "",
        max_length=500,
        description="file of pneuforce calibrate, relative to this file; empty: no calibration",
    )


class SafetySection(Section):
    """Limits and reactions. The board has its own hard limits, which no setting can raise."""

    contact_limit_kpa: float = Field(
        _SETTINGS.contact_limit_kpa,
        ge=2,
        le=25,
        description="pressure of the locked balloon above which the rig vents [kPa]",
    )
    host_timeout_s: float = Field(
        _SETTINGS.host_timeout_s,
        ge=0.25,
        le=10,
        description="silence of the host process after which the board vents [s]",
    )
    force_limit_n: float = Field(
        _SETTINGS.force_limit_n,
        ge=0.1,
        le=20,
        description="force alarm limit after a start, register 514 [N]",
    )
    force_limit_2_n: float = Field(
        _SETTINGS.force_limit_2_n,
        ge=0.1,
        le=20,
        description="second force alarm limit after a start, register 548 [N]",
    )
    alarm_hysteresis_n: float = Field(
        _SETTINGS.alarm_hysteresis_n,
        ge=0,
        le=10,
        description="hysteresis of the second force alarm after a start, register 550 [N]",
    )
    alarm_delay_s: float = Field(
        _SETTINGS.alarm_delay_s,
        ge=0,
        le=10,
        description="delay of the second force alarm after a start, register 552 [s]",
    )
    proof_test_s: Annotated[float, AfterValidator(_check_period)] = Field(
        _SETTINGS.proof_test_s,
        ge=0,
        le=3600,
        description="time from one proof test of the held balloon to the next [s]; 0: no proof tests",
        json_schema_extra={"allowed_values": "0, or 10 to 3600"},
    )
    vent_on_force_limit: bool = Field(
        False, description="vent when the force exceeds the limit, in addition to the alarm"
    )
    lease_required: bool = Field(False, description="reject mode hold without a lease (register 517)")
    write_protect: bool = Field(False, description="reject every write except a vent")


class EventsSection(Section):
    """Event log: every write with its result, faults, start and stop."""

    file: Text = Field(
        "events.sqlite",
        max_length=500,
        description="file of the event log, relative to this file; empty: no log",
    )


class LocalSection(Section):
    """Local socket for programs on this machine: the web process and recorders."""

    socket: Text = Field(
        "pneuforce.sock",
        max_length=100,
        description="path of the socket, relative to this file; empty: no socket",
    )


class IdentitySection(Section):
    """Identification data of the instrument."""

    serial_number: int = Field(0, ge=0, le=0xFFFF_FFFF, description="serial number")
    calibration_date: Annotated[int, AfterValidator(_check_date)] = Field(
        0,
        ge=0,
        le=99_991_231,
        description="yyyymmdd, 0: never calibrated; a calibration file has its own date",
    )
    url: Text = Field("", max_length=128, description="web address of the vendor, read by Modbus function 43")
    application: Text = Field(
        "", max_length=64, description="user application name, read by Modbus function 43"
    )
