"""Modbus/TCP Security of the host: the process of the TLS gateway, and the connections that it forwards."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pneuforce.errors import ServerError
from pneuforce.instrument.config import Configuration, ModbusSecuritySection, absolute_paths
from pneuforce.instrument.service.host.loop import ServedSource
from pneuforce.instrument.service.local_socket.unix_socket import LocalSocket
from pneuforce.instrument.service.processes.tls_process import TlsProcess
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.registers.modbus.tcp import ModbusTcpOptions
from pneuforce.registers.modbus_security.forwarded import CHANNEL, ForwardedConnections
from pneuforce.registers.source import Peer
from pneuforce.support.counted import counted
from pneuforce.support.throttle import RateLimitedLogger

LOG_PERIOD_S = 60.0
MAX_REASON = 64


def gateway_socket(local_socket: Path) -> Path:
    """Return the Unix socket between the gateway and the host. It is beside the local socket."""
    return local_socket.with_name(local_socket.name + ".tls")


def tls_files(settings: ModbusSecuritySection, configuration_file: Path) -> dict[str, str]:
    """Return the paths of certificates and key. The path of an unused file is empty."""
    return absolute_paths(configuration_file, settings, ("ca", "certificate", "key", "crl"))


class ModbusSecurityServer:
    """Modbus/TCP Security of one instrument."""

    def __init__(
        self,
        configuration: Configuration,
        source: ServedSource,
        identity: Mapping[int, str],
        local_socket: Path | None,
        files: Mapping[str, str],
    ) -> None:
        """Create the server without opening it. Raises ServerError if there is no local socket."""
        path = gateway_socket(required(local_socket))
        settings = configuration.modbus_security
        bank = RegisterBank(word_swap=configuration.modbus.word_order == "CDAB")
        roles = {role: tuple(rights) for role, rights in settings.roles.items()}
        options = ModbusTcpOptions(
            unit=configuration.modbus.unit,
            max_connections=settings.max_connections,
            idle_timeout_s=configuration.modbus.idle_timeout_s,
            frame_timeout_s=configuration.modbus.frame_timeout_s,
        )
        self.connections = ForwardedConnections(source, bank, identity, options, roles, time.monotonic)
        self.gateway = GatewayProcess(settings, path, files, source)
        self._socket = LocalSocket(path, self.connections.new_connection)

    async def open(self) -> None:
        """Start the gateway. Raises ServerError if the Unix socket cannot be opened."""
        await self._socket.open()
        self.connections.begin()
        self.gateway.begin()

    async def close(self) -> None:
        """End the gateway and close all connections."""
        self.connections.close()
        await self.gateway.close()
        self._socket.close()


class GatewayProcess(TlsProcess):
    """Process of the TLS gateway. It reports failed handshakes for the event log."""

    def __init__(
        self, settings: ModbusSecuritySection, socket: Path, files: Mapping[str, str], source: ServedSource
    ) -> None:
        options = {
            "instrument": str(socket),
            "host": settings.host,
            "port": settings.port,
            "allow": settings.allow,
            **files,
        }
        super().__init__("pneuforce.registers.modbus_security", "Modbus/TCP Security", options)
        self.counters: dict[str, Any] = {}
        self._source = source
        self._warn = RateLimitedLogger(logging.getLogger("pneuforce"), LOG_PERIOD_S).warning

    def on_heartbeat(self, message: Mapping[str, Any]) -> None:
        """Log failed handshakes; keep the counters. Raises TypeError or ValueError for an invalid message."""
        super().on_heartbeat(message)
        now_s = time.monotonic()
        self.counters = {name: message[name] for name in ("handshakes", "failed", "not_allowed")}
        for address, reason, times in message["failures"]:
            self._log_failure(str(address), str(reason)[:MAX_REASON], int(times), now_s)

    def _log_failure(self, address: str, reason: str, times: int, now_s: float) -> None:
        self._source.log_failed_logins(Peer(CHANNEL, address), reason, times, now_s)
        text = "Modbus/TCP Security: %s of %s failed: %s"
        self._warn(now_s, text, counted(times, "handshake"), address, reason)


def required(local_socket: Path | None) -> Path:
    """Return the local socket. Raises ServerError if it is disabled."""
    if local_socket is None:
        raise ServerError(
            "modbus_security.enabled = true needs the local socket, but local.socket is empty: set it"
        )
    return local_socket


def modbus_security_of(
    configuration: Configuration,
    source: ServedSource,
    identity: Mapping[int, str],
    local_socket: Path | None,
    files: Mapping[str, str],
) -> ModbusSecurityServer | None:
    """Return the server of a configuration, or None if it is disabled or no files are given.

    Raises ServerError if there is no local socket.
    """
    if not configuration.modbus_security.enabled or not files:
        return None
    return ModbusSecurityServer(configuration, source, identity, local_socket, files)


def health(server: ModbusSecurityServer | None, now_s: float) -> dict[str, Any] | None:
    """Return the counters and the connected clients, or None if Modbus/TCP Security is disabled."""
    if server is None:
        return None
    counters, gateway = server.connections.counters, server.gateway
    names = ("connections", "requests", "exceptions", "invalid_frames", "timeouts", "evicted")
    return {
        "port": gateway.port,
        "clients": [client.health(now_s) for client in server.connections.connections],
        "certificate_days": gateway.certificate_days,
        **{name: getattr(counters, name) for name in names},
        **gateway.counters,
    }
