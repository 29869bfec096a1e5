"""Process of `pneuforce run`: host, instrument and servers together."""

from __future__ import annotations

import asyncio
import gc
import json
import logging
import signal
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pneuforce.instrument.config import Configuration
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.recording.broadcaster import EntryBroadcaster
from pneuforce.instrument.recording.schema import STOP_REQUESTED
from pneuforce.instrument.service.audit_log import audited
from pneuforce.instrument.service.buses.can_server import CanServer
from pneuforce.instrument.service.buses.interface_lines import can_line, disabled_line
from pneuforce.instrument.service.buses.modbus_server import identity, modbus_server_of, open_modbus
from pneuforce.instrument.service.buses.rdt_server import open_rdt, rdt_server_of
from pneuforce.instrument.service.buses.rtu_server import RtuServer
from pneuforce.instrument.service.health import (
    can_health,
    events_health,
    modbus_health,
    rdt_health,
    rig_health,
    rtu_health,
)
from pneuforce.instrument.service.host.host import Host
from pneuforce.instrument.service.host.loop import HostLoop, ServedSource
from pneuforce.instrument.service.host.maintenance_log import MaintenanceLog
from pneuforce.instrument.service.host.unproven_tube import UnprovenTube, unproven_tube_file
from pneuforce.instrument.service.local_socket.server import WEB, LocalServer
from pneuforce.instrument.service.processes.modbus_security_server import health as modbus_security_health
from pneuforce.instrument.service.processes.modbus_security_server import modbus_security_of
from pneuforce.instrument.service.processes.mqtt_process import health as mqtt_health
from pneuforce.instrument.service.processes.mqtt_process import mqtt_process_of
from pneuforce.instrument.service.processes.recorder_process import RecorderProcess
from pneuforce.instrument.service.processes.tls_process import CertificateMonitor
from pneuforce.instrument.service.processes.web_process import WebProcess, web_process_of
from pneuforce.instrument.service.stderr_log import log_to_stderr
from pneuforce.instrument.service.systemd_notify import systemd_notifier
from pneuforce.registers.map_hash import MAP_HASH
from pneuforce.support.background import cancel_on

log = logging.getLogger("pneuforce")

SWITCH_INTERVAL_S = 0.0005  #: longest time for which the thread of a bus can delay the event loop


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceFiles:
    """Files of a running instrument. A file that is not used is None."""

    events: Path | None = None
    socket: Path | None = None
    recording: Path | None = None
    can_parameters: Path | None = None  #: file in which a CANopen master stores parameters
    tls: Mapping[str, str] = field(default_factory=dict)  #: certificates and key of Modbus/TCP Security
    web: Mapping[str, str] = field(default_factory=dict)  #: files of the web page; see `web_files`
    mqtt: Mapping[str, str] = field(default_factory=dict)  #: files of MQTT; empty: MQTT is disabled


def serve(configuration: Configuration, files: ServiceFiles) -> bool:
    """Run the instrument until SIGTERM or Ctrl-C, then vent and end. Return False for an unverified vent.

    A second signal ends the wait for the verification. Before the first sample, there is nothing to verify.

    Prints one JSON line when Modbus is served. The line contains the port of Modbus, and the ports of
    Modbus/TCP Security and of the web page if they are enabled. Their port is null if they are not served
    yet. The CAN node starts after the check that its node id is free. Until then the status bit `can_down` is
    set.

    Raises PneuforceError if the instrument cannot start.
    """
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    with log_to_stderr():
        if configuration.warning:
            log.warning("%s", configuration.warning)
        return asyncio.run(_serve(configuration, files))


async def _serve(configuration: Configuration, files: ServiceFiles) -> bool:
    broadcaster = EntryBroadcaster()
    session = Session(Instrument(configuration.settings(MAP_HASH)), broadcaster)
    with audited(session, configuration, files.events, broadcaster) as audit_logger:
        host = Host(session, configuration.rig.port)
        host.channels.append(audit_logger)
        if files.events is not None:
            file = unproven_tube_file(files.events)
            host.channels.append(UnprovenTube(host.instrument, file, configuration.rig.port))
        servers = Servers(configuration, host, audit_logger, broadcaster, files)
        await run_until_stopped(servers, files)
    return host.vent_verified or host.instrument.sample is None


class Servers:
    """All servers of one instrument or of one replay."""

    def __init__(
        self,
        configuration: Configuration,
        host: HostLoop,
        source: ServedSource,
        broadcaster: EntryBroadcaster,
        files: ServiceFiles,
    ) -> None:
        """Create the servers without opening them.

        Raises PneuforceError if two servers need the same port or CAN would be overloaded.
        """
        self.configuration = configuration
        self.host = host
        self.source = source
        self.modbus = modbus_server_of(configuration, source)
        self.security = modbus_security_of(
            configuration, source, identity(configuration), files.socket, files.tls
        )
        self.rtu = RtuServer(configuration, source, identity(configuration))
        can = configuration.can
        self.can = CanServer(source, can, files.can_parameters) if can.enabled else None
        self.rdt = rdt_server_of(source, configuration.rdt)
        self.local = LocalServer(host.session, source, broadcaster, configuration, self._health)
        self.systemd = systemd_notifier(source)
        self._started_utc_s = time.time()
        events = {"events": str(files.events or "")}
        self.web = web_process_of(configuration.web, files.socket, {**files.web, **events})
        self.mqtt = mqtt_process_of(configuration, files.socket, files.mqtt)
        gateway = self.security and self.security.gateway
        tls = [each for each in (gateway, self.web, self.mqtt) if each]
        host.channels += [
            self.local,
            self.systemd,
            CertificateMonitor(host, tls),
            MaintenanceLog(host.instrument),
        ]

    def _health(self, now_s: float) -> dict[str, Any]:
        instrument = self.host.instrument
        return {
            "started_utc_s": self._started_utc_s,
            "counts": self.source.counts.values(),
            "rig": rig_health(self.host, self.source.snapshot(WEB, now_s).age_s),
            "modbus_tcp": modbus_health(self.modbus, now_s),
            "modbus_tls": modbus_security_health(self.security, now_s),
            "modbus_rtu": rtu_health(self.rtu),
            "can": can_health(self.can, now_s),
            "web": {"certificate_days": self.web.certificate_days if self.web else None},
            "mqtt": mqtt_health(self.mqtt),
            "rdt": rdt_health(self.rdt),
            "events": events_health(
                self.configuration.events.file, instrument.log_down, instrument.event_log_head
            ),
        }


async def run_until_stopped(servers: Servers, files: ServiceFiles) -> None:
    """Open the servers and run until SIGTERM or Ctrl-C. Raises PneuforceError if a start fails."""
    stop = asyncio.Event()
    _stop_on_signals(stop, servers)
    web = servers.web
    processes = [process for process in (web, servers.mqtt) if process is not None]
    await servers.local.open(files.socket)
    recorder = (
        RecorderProcess(servers.local, files.socket, files.recording)
        if files.socket and files.recording
        else None
    )
    joining = asyncio.create_task(_join_can(servers, stop))
    why = STOP_REQUESTED
    try:
        for process in processes:
            process.begin()
        if servers.security is not None:
            await servers.security.open()
        if recorder is not None:
            await recorder.start()
        await servers.host.connect(stop)
        await _run(servers, web, joining, stop)
    except BaseException as error:
        why = str(error) or type(error).__name__
        raise
    finally:
        servers.source.end(why, time.monotonic())  # first, because no samples arrive during the next steps
        stop.set()
        if servers.can is not None:
            servers.can.close()
        await asyncio.gather(
            joining, return_exceptions=True
        )  # _run has already raised the exception of this task
        await servers.local.close(why)
        await asyncio.gather(*(process.close() for process in processes))
        if servers.security is not None:
            await servers.security.close()
        if recorder is not None:
            await recorder.wait_for_end()


def _stop_on_signals(stop: asyncio.Event, servers: Servers) -> None:
    def end() -> None:
        if stop.is_set():
            servers.host.end_at_once()
        stop.set()
        servers.systemd.stopping()

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:  # nohup starts a process with SIGHUP ignored
            asyncio.get_running_loop().add_signal_handler(number, end)


async def _join_can(servers: Servers, stop: asyncio.Event) -> None:
    """Join the CAN bus if CAN is enabled. Raises ServerError."""
    if servers.can is not None:
        servers.source.can_down = True
        await servers.can.open(stop)
        servers.host.channels.append(servers.can)
        if not stop.is_set():
            settings = servers.configuration.can.model_copy(
                update={"node_id": servers.can.node.options.node_id}
            )
            log.info("%s", can_line(settings, str(servers.can.bus.address)))


async def _open_rdt(servers: Servers) -> None:
    """Open the RDT server if it is enabled. Raises ServerError."""
    if servers.rdt is not None:
        await open_rdt(servers.rdt)
        servers.host.channels.append(servers.rdt)


async def _run(
    servers: Servers, web: WebProcess | None, joining: asyncio.Task[None], stop: asyncio.Event
) -> None:
    host, modbus = servers.host, servers.modbus
    running = asyncio.create_task(host.run(stop))
    try:
        if not stop.is_set():
            await servers.rtu.open()
            await _open_rdt(servers)
            await (joining if modbus is None else open_modbus(modbus, servers.configuration))
            ports = {"modbus": modbus.port if modbus else None}
            if servers.security is not None:
                ports["modbus_security"] = await cancel_on(stop, servers.security.gateway.first_port())
            if web is not None:
                ports["web"] = await cancel_on(stop, web.first_port())
            print(json.dumps(ports), flush=True)
            if disabled := disabled_line(servers.configuration):
                log.info("%s", disabled)
        await joining
        if not stop.is_set():
            servers.systemd.ready()
        gc.freeze()
        await running
    finally:
        servers.rtu.close()
        if servers.rdt is not None:
            servers.rdt.close()
        if modbus is not None:
            modbus.close()
        stop.set()
        await running
