"""Health: how link and buses are, as counted since the start, for whoever looks at the instrument."""

from __future__ import annotations

from typing import Any

from instrument.cli.can_face import CanFace
from instrument.cli.loop import Loop
from instrument.cli.rtu_face import RtuFace
from registers.can.frames import frame_of
from registers.modbus.tcp import ModbusTcpServer


def rig_health(host: Loop, age_s: float) -> dict[str, Any]:
    """The link to the rig, and how old its latest sample is."""
    link, hello = host.link, host.link.hello
    return {
        "url": host.url,
        "phase": link.phase.name.lower(),
        "board": hello.board if hello else None,
        "serial": hello.serial if hello else None,
        "firmware": hello.firmware if hello else None,
        "age_s": age_s,
        "samples": host.instrument.sample_counter,
        "lost_frames": link.lost_frames,
        "repeated_frames": link.repeated_frames,
        "implausible_frames": link.implausible_frames,
        "damaged_bytes": link.decoder.skipped_bytes,
        "reconnects": host.reconnects,
        "board_restarts": link.board_restarts,
        "clock_error": link.clock.rate_error,
    }


def modbus_health(server: ModbusTcpServer | None, now_s: float) -> dict[str, Any] | None:
    """Modbus TCP and each client that is connected; None where it is not served."""
    if server is None or not server.listening:
        return None
    own = server.counters
    clients = [
        {
            "address": client.address,
            "requests": client.requests,
            "exceptions": client.exceptions,
            "age_s": round(now_s - client.heard_s, 3),
        }
        for client in server.connections
    ]
    counted = ("connections", "requests", "exceptions", "refused_frames", "timeouts", "evicted", "foreign")
    return {"port": server.port, "clients": clients, **{name: getattr(own, name) for name in counted}}


def rtu_health(rtu: RtuFace) -> dict[str, Any] | None:
    """Modbus RTU; None where it is not served."""
    line = rtu.line
    if line is None:
        return None
    own = line.unit.counters
    counted = ("requests", "exceptions", "broadcasts", "others", "echoes")
    return {
        "port": str(line.options),
        "up": line.is_up,
        **{name: getattr(own, name) for name in counted},
    }


def can_health(can: CanFace | None, now_s: float) -> dict[str, Any] | None:
    """CAN, with the last frame of each identifier; None where it is off."""
    if can is None:
        return None
    own = can.bus.counters
    node_id = can.node.options.node_id
    frames = [
        {
            "id": identifier,
            "name": declared.name if (declared := frame_of(identifier, node_id)) else "",
            "data": seen.data.hex(" "),
            "count": seen.count,
            "age_s": round(now_s - seen.at_s, 3),
            "out": out,
        }
        for (identifier, out), seen in sorted(can.sighted.items())
    ]
    counted = ("sent", "received", "error_frames", "reopened")
    return {
        "at": str(can.bus.at),
        "up": can.bus.is_up,
        "dropped": can.bus.dropped,
        **{name: getattr(own, name) for name in counted},
        "frames": frames,
    }


def events_health(file: str, down: bool) -> dict[str, Any] | None:
    """The event log; None where none is kept."""
    return {"file": file, "trouble": "the file takes no records now" if down else ""} if file else None
