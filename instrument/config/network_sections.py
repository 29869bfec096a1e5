"""Sections of the configuration file for the buses and the web page.

Each key has its default, its meaning and its limits.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field

from pneuforce.instrument.config.text_checks import (
    Text,
    check_allow,
    check_channel,
    check_host,
    check_network,
    check_plain_http,
    check_roles,
)
from pneuforce.registers.rights import DEFAULT_ROLES, RIGHTS
from pneuforce.support.toml_sections import Section

Host = Annotated[str, AfterValidator(check_host)]
Network = Annotated[str, AfterValidator(check_network)]
Port = Annotated[int, Field(ge=1, le=65535)]
Unit = Annotated[int, Field(ge=1, le=247)]
WordOrder = Literal["ABCD", "CDAB"]


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
    parameter_file: Text = Field(
        "canopen.json",
        max_length=500,
        description="mode canopen: file in which a master stores parameters, relative to this file; empty: "
        "nothing can be stored",
    )


class ModbusSecuritySection(ListenerSection):
    """Modbus/TCP Security: Modbus in TLS with certificates. Unit id and word order are those of [modbus]."""

    enabled: bool = Field(False, description="serve Modbus/TCP Security")
    port: Port = Field(802, description="TCP port (802 needs privileges)")
    ca: Text = Field(
        "ca.pem",
        max_length=500,
        description="certificates of the authorities that sign client certificates (PEM), relative to this "
        "file",
    )
    certificate: Text = Field(
        "instrument.pem", max_length=500, description="certificate of this instrument, with its chain (PEM)"
    )
    key: Text = Field("instrument.key", max_length=500, description="key of this certificate (PEM)")
    crl: Text = Field(
        "",
        max_length=500,
        description="list of revoked certificates (PEM); empty: no certificate is revoked",
    )
    max_connections: int = Field(
        16, ge=1, le=1000, description="maximum number of connections; a further one closes an older one"
    )
    roles: Annotated[dict[Text, list[str]], AfterValidator(check_roles)] = Field(
        {role: list(rights) for role, rights in DEFAULT_ROLES.items()},
        max_length=32,
        description="rights of each role: " + ", ".join(RIGHTS) + "; everybody may read and vent",
        json_schema_extra={"allowed_values": "table of roles with lists of rights"},
    )


class RdtSection(ListenerSection):
    """RDT server, compatible with clients for ATI Net F/T and Axia sensors. It is read-only."""

    enabled: bool = Field(False, description="send the force over RDT")
    port: Port = Field(49152, description="UDP port; most clients cannot use another port")
    stream_timeout_s: float = Field(
        0.0,
        ge=0,
        le=86_400,
        description="time after which a stream without a new start request ends [s]; 0: never, because most "
        "clients send one start request only",
    )


class WebSection(ListenerSection):
    """Web page to monitor and operate the instrument in a browser."""

    removed_keys: ClassVar[Mapping[str, str]] = {
        "token": "users with passwords replace the token: remove this key, and create a user with "
        "pneuforce users add NAME --role operator --config FILE"
    }

    enabled: bool = Field(False, description="serve the web page")
    port: Port = Field(8080, description="TCP port")
    users_file: Text = Field(
        "users.toml",
        max_length=500,
        description="file of the users who may log in (pneuforce users), relative to this file; empty or "
        "missing: the page can only vent",
    )
    session_idle_timeout_s: float = Field(
        3600.0, ge=60, le=86_400, description="time without input on the page after which a login ends [s]"
    )
    session_timeout_s: float = Field(
        43_200.0, ge=60, le=604_800, description="time after which every login ends [s]"
    )
    certificate: Text = Field(
        "",
        max_length=500,
        description="certificate for HTTPS, with its chain (PEM), relative to this file; empty: HTTP without "
        "encryption",
    )
    key: Text = Field("", max_length=500, description="key of this certificate (PEM)")
    allow_plain_http: Annotated[bool, AfterValidator(check_plain_http)] = Field(
        False,
        validate_default=True,
        description="serve the page without a certificate at an address that is not loopback; passwords are "
        "then sent without encryption",
    )
    recordings: Text = Field(
        "recordings",
        max_length=500,
        description="folder of the recordings that the operator starts on the page, relative to this file; "
        "empty: the page cannot record",
    )
    recording_max_mb: float = Field(
        4000.0, ge=1, le=1e6, description="size at which such a recording ends [MB]; 4000 MB are half a day"
    )
    recording_min_free_mb: float = Field(
        1000.0, ge=1, le=1e6, description="such a recording ends if less than this is free on the disk [MB]"
    )
