"""Health of the rig link and the buses: counters since the start, for the web page and for Prometheus."""

from __future__ import annotations

from typing import Any

from pneuforce.instrument.core.event_log_head import EventLogHead
from pneuforce.instrument.service.buses.can_server import CanServer
from pneuforce.instrument.service.buses.rtu_server import RtuServer
from pneuforce.instrument.service.host.loop import HostLoop
from pneuforce.protocol.firmware_version import format_version
from pneuforce.protocol.limits import HOST_SILENCE_S
from pneuforce.registers.can.frames import find_frame
from pneuforce.registers.canopen.node import CanopenNode
from pneuforce.registers.modbus.tcp import ModbusTcpServer
from pneuforce.registers.rdt.server import RdtServer


def rig_health(host: HostLoop, age_s: float) -> dict[str, Any]:
    """Return the state of the link to the rig; `age_s` is the age of its latest sample."""
    link, hello = host.link, host.link.hello
    return {
        "url": host.url,
        "phase": link.phase.name.lower(),
        "up": age_s <= HOST_SILENCE_S,
        "board": hello.board if hello else None,
        "serial": hello.serial if hello else None,
        "firmware": format_version(hello.firmware) if hello else None,
        "firmware_origin": link.firmware.origin if link.firmware else None,
        "age_s": age_s,
        "samples": host.instrument.sample_counter,
        "lost_frames": link.lost_frames,
        "repeated_frames": link.repeated_frames,
        "implausible_frames": link.implausible_frames,
        "damaged_bytes": link.decoder.skipped_bytes,
        "reconnects": host.reconnects,
        "board_restarts": link.board_restarts,
        "clock_error": link.clock.rate_error,
        "command_gaps": host.command_gaps.values(),
    }


def modbus_health(server: ModbusTcpServer | None, now_s: float) -> dict[str, Any] | None:
    """Return counters of Modbus TCP and of each connected client, or None if it is disabled."""
    if server is None or not server.listening:
        return None
    clients = [client.health(now_s) for client in server.connections]
    names = ("connections", "requests", "exceptions", "invalid_frames", "timeouts", "evicted", "not_allowed")
    counters = {name: getattr(server.counters, name) for name in names}
    return {"port": server.port, "clients": clients, **counters}


def rtu_health(rtu: RtuServer) -> dict[str, Any] | None:
    """Return counters of Modbus RTU, or None if it is disabled."""
    line = rtu.line
    if line is None:
        return None
    names = ("requests", "exceptions", "broadcasts", "other_units", "echoes")
    counters = {name: getattr(line.unit.counters, name) for name in names}
    return {"port": str(line.options), "up": line.is_up, **counters}


def can_health(can: CanServer | None, now_s: float) -> dict[str, Any] | None:
    """Return counters of CAN and the last frame of each identifier, or None if CAN is disabled."""
    if can is None:
        return None
    node_id = can.node.options.node_id
    frames = [
        {
            "id": identifier,
            "name": frame.name if (frame := find_frame(identifier, node_id)) else "",
            "data": last.data.hex(" "),
            "count": last.count,
            "age_s": round(now_s - last.at_s, 3),
            "out": sent,
        }
        for (identifier, sent), last in sorted(can.last_frames.items())
    ]
    names = ("sent", "received", "error_frames", "reopened")
    return {
        "at": str(can.bus.address),
        "up": can.bus.is_up,
        "node_id": node_id,
        "stored_parameters": can.node.storage.summary if isinstance(can.node, CanopenNode) else None,
        "dropped": can.bus.dropped,
        **{name: getattr(can.bus.counters, name) for name in names},
        "frames": frames,
    }


def rdt_health(rdt: RdtServer | None) -> dict[str, Any] | None:
    """Return counters of RDT, or None if it is disabled."""
    if rdt is None or not rdt.is_open:
        return None
    names = ("records", "dropped", "requests", "refused")
    counters = {name: getattr(rdt.counters, name) for name in names}
    return {"port": rdt.port, "clients": len(rdt.streams), **counters}


def events_health(file: str, down: bool, head: EventLogHead) -> dict[str, Any] | None:
    """Return the state of the event log and its head on the disk, or None if the log is disabled."""
    if not file:
        return None
    trouble = "the file cannot be written now" if down else ""
    return {"file": file, "trouble": trouble, "records": head.records, "head": head.digest.hex()}
