"""Lines of the log at the start: where each interface is served, and which interfaces are disabled."""

from __future__ import annotations

from pneuforce.instrument.config import CanSection, Configuration
from pneuforce.registers.can.frames import COMMAND, FRAMES, IDENTITY, SDO_RESPONSE
from pneuforce.registers.canopen.node import SDO_REQUEST


def modbus_tcp_line(configuration: Configuration, port: int) -> str:
    """Return the line of Modbus TCP. `port` is the port on which the server listens."""
    settings = configuration.modbus
    return f"Modbus TCP on {settings.host}:{port}, unit {settings.unit}" + _access(settings.read_only)


def modbus_rtu_line(configuration: Configuration, port: str) -> str:
    """Return the line of Modbus RTU. `port` is the port with its baud rate and its format."""
    settings = configuration.modbus_rtu
    return f"Modbus RTU on {port}, unit {settings.unit}" + _access(settings.read_only)


def can_line(settings: CanSection, address: str) -> str:
    """Return the line of CAN or CANopen. `address` is the interface with its channel."""
    is_canopen, node_id = settings.mode == "canopen", settings.node_id
    sent = [frame for frame in FRAMES if not frame.received and not (is_canopen and frame is IDENTITY)]
    names = [f"{frame.base_id + node_id:03X}h {frame.name}" for frame in sent]
    received = [f"{COMMAND.base_id + node_id:03X}h {COMMAND.name}"]
    if is_canopen:
        names.append(f"{SDO_RESPONSE + node_id:03X}h SDO")
        received.append(f"{SDO_REQUEST + node_id:03X}h SDO")
    return (
        f"{'CANopen' if is_canopen else 'CAN'} on {address}, node {node_id}, {settings.bit_rate} bit/s "
        f"(set by the operating system): receives {', '.join(received)}; sends {', '.join(names)}"
    )


def disabled_line(configuration: Configuration) -> str:
    """Return the line about the disabled interfaces; empty if all interfaces are enabled."""
    sections = {
        "Modbus TCP [modbus]": configuration.modbus.enabled,
        "Modbus/TCP Security [modbus_security]": configuration.modbus_security.enabled,
        "Modbus RTU [modbus_rtu]": configuration.modbus_rtu.enabled,
        "CAN [can]": configuration.can.enabled,
        "RDT [rdt]": configuration.rdt.enabled,
        "web page [web]": configuration.web.enabled,
        "MQTT [mqtt]": configuration.mqtt.enabled,
    }
    disabled = [name for name, enabled in sections.items() if not enabled]
    return f"disabled in the configuration: {', '.join(disabled)}" if disabled else ""


def _access(read_only: bool) -> str:
    return ", read-only except for a vent" if read_only else ""
