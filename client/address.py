"""Address of an instrument: a URL that names the bus, and the connection that the URL describes."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from urllib.parse import SplitResult, parse_qsl, urlsplit

from pneuforce.client.connection import SensorConnection
from pneuforce.client.sensor import ForceSensor
from pneuforce.errors import ConfigurationError, ConnectionFailed
from pneuforce.support.user_part import without_user

if TYPE_CHECKING:
    from pneuforce.registers.modbus.client import ModbusClient

    #: Function that opens a Modbus connection, and the longest silence of valid samples [s].
    ModbusOpener = tuple[Callable[[], ModbusClient], float]

TCP_WAIT_S, TCP_SILENCE_S = 1.0, 0.1
CAN_SILENCE_S = RDT_SILENCE_S = 0.1
#: Characters of a request and of an answer with registers 0–25, and bits per character.
RTU_CHARACTERS, RTU_BITS = 8 + 57, 11
RTU_OVERHEAD_S = 0.05


class Scheme(NamedTuple):
    """Kind of address: an example for messages, the accepted options, and the function that connects."""

    example: str
    options: frozenset[str]
    open: Callable[[Url], SensorConnection]


class Url(NamedTuple):
    """Parts of an address, with methods that check them."""

    text: str
    scheme: str
    parts: SplitResult
    options: Mapping[str, str]

    def invalid(self, problem: str) -> ConfigurationError:
        """Return the error for an invalid address."""
        example = SCHEMES[self.scheme].example
        return ConfigurationError(
            f"the address {_shown(self.text)} is invalid: {problem}; example: {example!r}"
        )

    def integer(self, name: str, default: int, allowed: range) -> int:
        """Return an option that is an integer. Raises ConfigurationError."""
        text = self.options.get(name, str(default))
        if not re.fullmatch("[0-9]{1,9}", text) or int(text) not in allowed:
            raise self.invalid(f"{name} must be {allowed.start} to {allowed.stop - 1}")
        return int(text)

    def seconds(self, name: str, default: float, low: float, high: float) -> float:
        """Return an option that is a time [s]. Raises ConfigurationError."""
        text = self.options.get(name, str(default))
        if not re.fullmatch(r"[0-9]{1,9}(\.[0-9]{1,9})?", text) or not low <= float(text) <= high:
            raise self.invalid(f"{name} must be {low:g} to {high:g} s")
        return float(text)

    def host_and_port(self, default_port: int) -> tuple[str, int]:
        """Return the host and the port. Raises ConfigurationError."""
        try:
            host, port = self.parts.hostname, self.parts.port
        except ValueError:
            raise self.invalid("the port must be 1 to 65535") from None
        if not host:
            raise self.invalid("the host is missing")
        if self.parts.path not in ("", "/") or port == 0:
            raise self.invalid("the host may only be followed by a port from 1 to 65535, and by options")
        return host, default_port if port is None else port


def connect(url: str) -> ForceSensor:
    """Connect to the instrument at `url`, and return its force sensor.

    | address | bus |
    | --- | --- |
    | `tcp://host:5020?unit=1` | Modbus TCP |
    | `tls://host:802?unit=1&ca=ca.pem&certificate=plc.pem&key=plc.key` | Modbus/TCP Security |
    | `rtu:///dev/ttyUSB0?unit=1&baud=19200&parity=even` | Modbus RTU on a serial line |
    | `can://socketcan/can0?node=5&silence=0.1` | CAN interface of the Linux kernel |
    | `can://socketcand/can0?host=127.0.0.1&port=29536&node=5` | CAN over a socketcand server |
    | `rdt://host:49152` | RDT, read-only |

    The values after `?` are the defaults; `make run` uses socketcand. `silence` is the time in s
    after which a missing Force frame makes the force invalid. For a Force rate below 30 Hz, choose three
    periods of the frame.

    Raises ConfigurationError for an invalid address. Raises ConnectionFailed if no instrument answers, or if
    the map hash of the instrument differs from `pneuforce.MAP_HASH`. RDT transmits no map hash.

    Example:
        import pneuforce

        with pneuforce.connect("tcp://127.0.0.1:5020") as sensor:
            print(sensor.read().pressure_kpa)
    """
    address = parse_url(url)
    return ForceSensor(url, SCHEMES[address.scheme].open(address))


def connect_any_map(url: str) -> ForceSensor:
    """Connect like `connect`, over Modbus also to an instrument with another register map.

    Some values can then be wrong. Only a program that reports the difference may use this function.
    """
    address = parse_url(url)
    is_modbus = address.scheme in _MODBUS_CLIENTS
    return ForceSensor(url, _open_modbus(address, any_map=True)) if is_modbus else connect(url)


def send_vent(url: str) -> None:
    """Vent the instrument at `url` (tcp, tls or rtu), also if it has another register map.

    Register 516 is the same in all versions, and a vent must not depend on the version of a program. The vent
    is tried twice. Raises ConfigurationError for an invalid address, and ConnectionFailed if it was not sent.
    """
    from pneuforce.client.modbus_connection import vent_once

    open_client = modbus_opener(url)
    try:
        vent_once(url, open_client)
    except ConnectionFailed:
        vent_once(url, open_client)


def modbus_opener(url: str) -> Callable[[], ModbusClient]:
    """Return the function that connects to `url` (tcp, tls or rtu). Raises ConfigurationError."""
    open_client, _ = _MODBUS_CLIENTS[(address := parse_url(url)).scheme](address)
    return open_client


def parse_url(text: str) -> Url:
    """Return the parts of an address. Raises ConfigurationError for an unknown scheme or option."""
    examples = ", ".join(repr(scheme.example) for scheme in SCHEMES.values())
    scheme = text.partition(":")[0].lower() if isinstance(text, str) else ""
    if scheme not in SCHEMES or not text[len(scheme) :].startswith("://"):
        raise ConfigurationError(f"the address {_shown(text)} is invalid: it must be like one of {examples}")
    try:
        parts = urlsplit(text)
        pairs = parse_qsl(parts.query, keep_blank_values=True, strict_parsing=bool(parts.query))
    except ValueError as error:
        raise ConfigurationError(
            f"the address {_shown(text)} is invalid: {without_user(str(error))}; it must be like one of "
            f"{examples}"
        ) from None
    url = Url(text, scheme, parts, dict(pairs))
    _check_options(url, [name for name, _ in pairs])
    return url


def _shown(text: object) -> str:
    return without_user(repr(text))


def _check_options(url: Url, names: list[str]) -> None:
    accepted = SCHEMES[url.scheme].options
    for name in names:
        if name not in accepted:
            similar = get_close_matches(name, accepted, 1)
            hint = f"; did you mean {similar[0]!r}?" if similar else ""
            raise url.invalid(f"the option {name!r} is unknown{hint}")
        if names.count(name) > 1:
            raise url.invalid(f"the option {name!r} is given twice")
    if url.parts.fragment or url.parts.username is not None:
        raise url.invalid("user names and fragments (#) are not supported")


# ---- one function for each scheme


def _open_modbus(url: Url, any_map: bool = False) -> SensorConnection:
    from pneuforce.client.modbus_connection import ModbusSensorConnection

    return ModbusSensorConnection(url.text, *_MODBUS_CLIENTS[url.scheme](url), any_map=any_map)


def _tcp_client(url: Url) -> ModbusOpener:
    from pneuforce.registers.modbus.client import ModbusClient

    host, port = url.host_and_port(5020)
    unit = url.integer("unit", 1, range(256))
    return lambda: ModbusClient.connect(host, port, unit=unit, wait_s=TCP_WAIT_S), TCP_SILENCE_S


def _tls_client(url: Url) -> ModbusOpener:
    from pneuforce.registers.modbus.client import ModbusClient
    from pneuforce.registers.modbus.client_context import ClientFiles, client_context

    host, port = url.host_and_port(802)
    unit = url.integer("unit", 1, range(256))
    missing = [name for name in ClientFiles._fields if not url.options.get(name)]
    if missing:
        raise url.invalid(f"the options ca, certificate and key name files, and {missing[0]} is missing")
    try:
        context = client_context(
            host, ClientFiles(*(Path(url.options[name]) for name in ClientFiles._fields))
        )
    except OSError as error:
        raise ConfigurationError(f"the address {_shown(url.text)}: {error}") from None
    return lambda: ModbusClient.connect_tls(host, port, context, unit=unit, wait_s=TCP_WAIT_S), TCP_SILENCE_S


def _rtu_client(url: Url) -> ModbusOpener:
    from pneuforce.registers.modbus.client import ModbusClient

    device = url.parts.path
    if url.parts.netloc or len(device) < 2:
        raise url.invalid("three slashes and the path of the serial port must follow the scheme")
    unit = url.integer("unit", 1, range(1, 248))
    baud = url.integer("baud", 19200, range(1200, 115_201))
    parity = url.options.get("parity", "even")
    if parity not in ("even", "odd", "none"):
        raise url.invalid("parity must be even, odd or none")
    request_s = RTU_CHARACTERS * RTU_BITS / baud + RTU_OVERHEAD_S

    def open_client() -> ModbusClient:
        return ModbusClient.connect_serial(
            device, baud=baud, parity=parity, unit=unit, wait_s=0.3 + 3 * request_s
        )

    return open_client, max(TCP_SILENCE_S, 3 * request_s)


def _open_rdt(url: Url) -> SensorConnection:
    from pneuforce.client.rdt_connection import RdtSensorConnection
    from pneuforce.registers.rdt.record import RDT_PORT

    return RdtSensorConnection(url.text, *url.host_and_port(RDT_PORT), RDT_SILENCE_S)


def _open_can(url: Url) -> SensorConnection:
    from pneuforce.client.can_connection import CanSensorConnection
    from pneuforce.registers.can.bus import CanAddress
    from pneuforce.registers.can.frames import DEFAULT_NODE_ID

    interface, channel = url.parts.netloc, url.parts.path.removeprefix("/")
    if interface not in ("socketcan", "socketcand", "virtual") or not channel:
        raise url.invalid("the interface (socketcan, socketcand) and its channel must follow the scheme")
    if interface != "socketcand" and {"host", "port"} & url.options.keys():
        raise url.invalid(f"the interface {interface} has no host and no port")
    node_id = url.integer("node", DEFAULT_NODE_ID, range(1, 128))
    server = CanAddress(
        interface=interface,
        channel=channel,
        host=url.options.get("host", CanAddress().host),
        port=url.integer("port", CanAddress().port, range(1, 65536)),
    )
    return CanSensorConnection(url.text, server, node_id, url.seconds("silence", CAN_SILENCE_S, 0.02, 3.0))


_MODBUS_CLIENTS: Mapping[str, Callable[[Url], ModbusOpener]] = {
    "tcp": _tcp_client,
    "tls": _tls_client,
    "rtu": _rtu_client,
}

SCHEMES: Mapping[str, Scheme] = {
    "tcp": Scheme("tcp://192.168.1.10:5020?unit=1", frozenset({"unit"}), _open_modbus),
    "tls": Scheme(
        "tls://192.168.1.10:802?ca=ca.pem&certificate=plc.pem&key=plc.key",
        frozenset({"unit", "ca", "certificate", "key"}),
        _open_modbus,
    ),
    "rtu": Scheme(
        "rtu:///dev/ttyUSB0?unit=1&baud=19200", frozenset({"unit", "baud", "parity"}), _open_modbus
    ),
    "can": Scheme("can://socketcan/can0?node=5", frozenset({"node", "host", "port", "silence"}), _open_can),
    "rdt": Scheme("rdt://192.168.1.10:49152", frozenset(), _open_rdt),
}
