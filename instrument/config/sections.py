"""Sections of the configuration file: every key with its default, its meaning and its limits."""

from __future__ import annotations

from datetime import date
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, SecretStr

from pneuforce.instrument.config.text_checks import (
    check_allow,
    check_channel,
    check_host,
    check_network,
    check_rig_port,
    check_text,
    check_token,
)
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.measurement.chain import ChainSettings
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

Text = Annotated[str, AfterValidator(check_text)]
Host = Annotated[str, AfterValidator(check_host)]
Network = Annotated[str, AfterValidator(check_network)]
Port = Annotated[int, Field(ge=1, le=65535)]
Unit = Annotated[int, Field(ge=1, le=247)]
WordOrder = Literal["ABCD", "CDAB"]


class RigSection(Section):
    """The board at the end of the serial cable."""

    port: Annotated[str, AfterValidator(check_rig_port)] = Field(
        "/dev/ttyACM0",
        min_length=1,
        description="device (preferably its /dev/serial/by-id name), or socket://host:port",
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
    id: int = Field(0, ge=0, le=0xFFFF_FFFF, description="number of the fitted balloon")


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


class ListenerSection(Section):
    """Common keys of the sections that listen on the network. These keys come first in each section."""

    enabled: bool
    host: Host = Field(
        "127.0.0.1",
        description="address to listen on; an address that is not loopback requires allow",
        json_schema_extra={"allowed_values": "IP address or host name"},
    )
    allow: Annotated[list[Network], AfterValidator(check_allow)] = Field(
        [],
        max_length=64,
        validate_default=True,
        description="clients that may connect in addition to 127.0.0.1 and ::1; empty on loopback: all of "
        "this machine",
        json_schema_extra={"allowed_values": "list of addresses and networks"},
    )


class ModbusSection(ListenerSection):
    """Modbus TCP server."""

    enabled: bool = Field(True, description="serve Modbus TCP")
    port: Port = Field(5020, description="TCP port (502 needs privileges)")
    unit: Unit = Field(1, description="unit id")
    word_order: WordOrder = Field("ABCD", description="order of 32-bit values: high or low word first")
    read_only: bool = Field(False, description="answer every write except a vent with exception 01")
    max_connections: int = Field(
        64,
        ge=1,
        le=1000,
        description="maximum number of connections; a further one closes an older one, "
        "a client that polls regularly last",
    )
    idle_timeout_s: float = Field(
        60.0, ge=1, le=86_400, description="idle time after which a connection is closed [s]"
    )
    frame_timeout_s: float = Field(
        5.0, ge=0.1, le=60, description="time in which a request must arrive completely [s]"
    )


class ModbusRtuSection(Section):
    """Modbus RTU on its own serial port, in addition to Modbus TCP or instead of it."""

    enabled: bool = Field(False, description="serve Modbus RTU")
    port: Text = Field(
        "/dev/ttyUSB0",
        min_length=1,
        description="device; its /dev/serial/by-id name stays the same after the adapter is plugged in again",
    )
    baud: Literal[1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200] = Field(
        19200, description="baud rate of the line"
    )
    parity: Literal["even", "odd", "none"] = Field("even", description="parity of the line")
    stop_bits: int = Field(
        1, ge=1, le=2, description="stop bits of the line; the standard requires 2 without parity"
    )
    unit: Unit = Field(1, description="unit id, different from all other devices on the line")
    word_order: WordOrder = Field("ABCD", description="order of 32-bit values: high or low word first")
    read_only: bool = Field(False, description="answer every write except a vent with exception 01")


class CanSection(Section):
    """CAN node."""

    enabled: bool = Field(False, description="send and receive CAN frames")
    mode: Literal["raw", "canopen"] = Field(
        "raw", description="raw: frames are sent from the start; canopen: a CANopen manager starts the node"
    )
    interface: Literal["socketcan", "socketcand", "virtual"] = Field(
        "socketcan", description="python-can interface, socketcan for real hardware"
    )
    channel: Annotated[str, AfterValidator(check_channel)] = Field(
        "can0", description="channel of the interface"
    )
    host: Host = Field(
        "127.0.0.1",
        description="socketcand only: address of the server",
        json_schema_extra={"allowed_values": "IP address or host name"},
    )
    port: Port = Field(29536, description="socketcand only: TCP port of the server")
    node_id: int = Field(5, ge=1, le=127, description="CANopen node id N: frames 180h+N and so on")
    bit_rate: Literal[125_000, 250_000, 500_000, 1_000_000] = Field(
        500_000, description="bit rate of the bus, used to check the bus load"
    )
    force_rate_hz: int = Field(
        100, ge=1, le=500, description="Force frames per second, at most the 500 samples of the rig"
    )


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


class WebSection(ListenerSection):
    """Web page to monitor and operate the instrument in a browser."""

    enabled: bool = Field(False, description="serve the web page")
    port: Port = Field(8080, description="TCP port")
    token: Annotated[SecretStr, AfterValidator(check_token)] = Field(
        SecretStr(""),
        description="password of the operator, at least 12 characters; empty: the page can only vent",
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
