"""The sections of the configuration: every key, its default, its meaning and its span."""

from __future__ import annotations

from datetime import date
from ipaddress import ip_address, ip_network
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, SecretStr, ValidationInfo

from instrument.chain import ChainSettings
from instrument.model import Balloon, Circuit
from instrument.model.law import Low, MethodName, Switch
from instrument.settings import Settings
from instrument.tables import Section


def _date(code: int) -> int:
    if code:
        date.fromisoformat(f"{code:08d}")
    return code


def _network(text: str) -> str:
    ip_network(text)
    return text


def _long_enough(token: SecretStr) -> SecretStr:
    if 0 < len(token.get_secret_value()) < 12:
        raise ValueError("a token of fewer than 12 characters is soon guessed")
    return token


def _is_loopback(host: str) -> bool:
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _named_where_reachable(allow: list[str], section: ValidationInfo) -> list[str]:
    host = section.data.get("host", "localhost")  # a wrong one is told by itself
    if not allow and not _is_loopback(host):
        raise ValueError(
            f'host {host} is reached from the network, so say who may connect: allow = ["192.168.1.0/24"] '
            '(everyone: ["0.0.0.0/0", "::/0"])'
        )
    return allow


_BALLOON, _CIRCUIT, _CHAIN, _SETTINGS = Balloon(), Circuit(), ChainSettings(), Settings()

Port = Annotated[int, Field(ge=1, le=65535)]
Network = Annotated[str, AfterValidator(_network)]
Unit = Annotated[int, Field(ge=1, le=247)]
WordOrder = Literal["ABCD", "CDAB"]


class Rig(Section):
    """The board at the end of the serial cable."""

    port: str = Field(
        "/dev/ttyACM0",
        min_length=1,
        description="device (better its /dev/serial/by-id name), or socket://host:port",
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
    id: int = Field(0, ge=0, le=0xFFFF_FFFF, description="number of the balloon fitted")


class CircuitSection(Section):
    """The gas around the balloon."""

    volume_mm3: float = Field(
        _CIRCUIT.volume_mm3, ge=100, le=1e6, description="volume V_c of all pipes [mm³]"
    )
    ambient_kpa: float = Field(
        _CIRCUIT.ambient_kpa, ge=60, le=110, description="ambient pressure P_0 [kPa absolute]"
    )


class MeasurementSection(Section):
    """From pressure to force."""

    method: MethodName = Field(_CHAIN.law.method, description="force model")
    switch: Switch = Field(
        _CHAIN.law.switch, description="change of the stretching energy at 8.85 kPa: at once, or blended"
    )
    low: Low = Field(
        _CHAIN.law.low, description="force below a rise of 0.5 kPa: straight to zero, or joined smoothly"
    )
    filter_s: float = Field(
        _CHAIN.filter_s, ge=0.002, le=1, description="time constant of the pressure that is shown [s]"
    )
    tube_s: float = Field(
        _CHAIN.tube_s,
        ge=0,
        le=0.5,
        description="lag between balloon and sensor, which the force makes up for [s]",
    )
    calibration: str = Field(
        "", max_length=500, description="file of pneuforce calibrate, beside this one; empty for none"
    )


class Safety(Section):
    """Limits and reactions. The board has hard limits of its own that nothing here can raise."""

    contact_limit_kpa: float = Field(
        _SETTINGS.contact_limit_kpa,
        ge=2,
        le=25,
        description="pressure of the locked balloon above which it is vented [kPa]",
    )
    vent_after_s: float = Field(
        _SETTINGS.vent_after_s,
        ge=0.25,
        le=10,
        description="silence of this host after which the board vents [s]",
    )
    force_limit_n: float = Field(
        _SETTINGS.force_limit_n, ge=0.1, le=20, description="force alarm at start, register 514 [N]"
    )
    vent_on_force_limit: bool = Field(
        False, description="vent when the force limit is passed, not only alarm"
    )
    lease_demanded: bool = Field(False, description="refuse mode hold without a lease (register 517)")
    write_lock: bool = Field(False, description="refuse every write but a vent")


class Listening(Section):
    """What listens on the network: its first keys, in their order."""

    enabled: bool
    host: str = Field(
        "127.0.0.1", min_length=1, description="address to listen on; another than loopback demands allow"
    )
    allow: Annotated[list[Network], AfterValidator(_named_where_reachable)] = Field(
        [],
        max_length=64,
        validate_default=True,
        description="who may connect beside 127.0.0.1 and ::1; on loopback, empty means this whole machine",
    )


class Modbus(Listening):
    """Modbus TCP server."""

    enabled: bool = Field(True, description="serve Modbus TCP")
    port: Port = Field(5020, description="TCP port (502 needs privileges)")
    unit: Unit = Field(1, description="unit id")
    word_order: WordOrder = Field("ABCD", description="order of 32-bit values: high or low word first")
    read_only: bool = Field(False, description="answer every write but a vent with exception 01")
    connections: int = Field(
        64,
        ge=1,
        le=1000,
        description="most connections at once; one more evicts the idlest of the busiest address",
    )
    idle_s: float = Field(
        60.0, ge=1, le=86_400, description="idle time after which a connection is closed [s]"
    )
    frame_s: float = Field(5.0, ge=0.1, le=60, description="time that a request may take to arrive whole [s]")


class ModbusRtu(Section):
    """Modbus RTU on a serial port of its own, beside Modbus TCP or instead of it."""

    enabled: bool = Field(False, description="serve Modbus RTU")
    port: str = Field(
        "/dev/ttyUSB0",
        min_length=1,
        description="device, better its /dev/serial/by-id name: the one that it comes back under",
    )
    baud: Literal[1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200] = Field(
        19200, description="of the line"
    )
    parity: Literal["even", "odd", "none"] = Field("even", description="of the line")
    stop_bits: int = Field(1, ge=1, le=2, description="of the line; without parity the standard wants 2")
    unit: Unit = Field(1, description="unit id, no other device's on that line")
    word_order: WordOrder = Field("ABCD", description="order of 32-bit values: high or low word first")
    read_only: bool = Field(False, description="answer every write but a vent with exception 01")


class Can(Section):
    """CAN node."""

    enabled: bool = Field(False, description="send and receive CAN frames")
    mode: Literal["raw", "canopen"] = Field(
        "raw", description="raw: frames flow from the start; canopen: a CANopen node, started by its manager"
    )
    interface: Literal["socketcan", "socketcand", "virtual"] = Field(
        "socketcan", description="socketcan on real hardware"
    )
    channel: str = Field("can0", min_length=1, description="channel of the interface")
    host: str = Field("127.0.0.1", min_length=1, description="socketcand only: its address")
    port: Port = Field(29536, description="socketcand only: its port")
    node_id: int = Field(5, ge=1, le=127, description="CANopen node id N: frames 180h+N and so on")
    bit_rate: Literal[125_000, 250_000, 500_000, 1_000_000] = Field(
        500_000, description="of the bus; decides the load check"
    )
    force_rate_hz: int = Field(
        100, ge=1, le=500, description="Force frames per second, at most the rig's 500"
    )


class Events(Section):
    """The event log: every write and what became of it, faults, start and stop."""

    file: str = Field(
        "events.sqlite", max_length=500, description="file of the log, beside this one; empty for none"
    )


class Local(Section):
    """A socket for programs of this machine: the page and recorders."""

    socket: str = Field(
        "pneuforce.sock", max_length=100, description="its path, beside this file; empty for none"
    )


class Page(Listening):
    """The page: the instrument in a browser."""

    enabled: bool = Field(False, description="serve the page")
    port: Port = Field(8080, description="TCP port")
    token: Annotated[SecretStr, AfterValidator(_long_enough)] = Field(
        SecretStr(""),
        description="what an operator must know to do more than vent, 12 characters at least; empty: none",
    )


class IdentitySection(Section):
    """What the instrument says of itself."""

    serial_number: int = Field(0, ge=0, le=0xFFFF_FFFF, description="serial number")
    calibration_date: Annotated[int, AfterValidator(_date)] = Field(
        0, ge=0, le=99_991_231, description="yyyymmdd, 0 where never; a calibration file brings its own"
    )
    url: str = Field("", max_length=128, description="where its maker is found, read by Modbus function 43")
    application: str = Field(
        "", max_length=64, description="user application name, read by Modbus function 43"
    )
