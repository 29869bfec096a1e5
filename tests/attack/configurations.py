"""Random configuration files.

Each file is the example configuration with a few changes. A file must be rejected with one sentence for each
error, or the servers of the instrument must be ready to start with it.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import os
import random
import socket
from pathlib import Path
from tempfile import TemporaryDirectory

from pneuforce.errors import ConfigurationFileError, PneuforceError
from pneuforce.instrument.audit.audit_logger import AuditLogger, NullAuditSink
from pneuforce.instrument.cli.config_check import check_config
from pneuforce.instrument.cli.terminal.failure import failure_values
from pneuforce.instrument.config import Configuration, load, resolve_path
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.recording.broadcaster import EntryBroadcaster
from pneuforce.instrument.service.host.host import Host
from pneuforce.instrument.service.serve import Servers, ServiceFiles
from pneuforce.registers.can.carrier import link_problem
from pneuforce.registers.modbus.rtu_port import open_port
from pneuforce.support.serial_port import SerialPort
from pneuforce.web.__main__ import WebProcessOptions, create_services
from tests.attack.configuration_files import any_file
from tests.attack.result import AttackResult

MAX_SENTENCES = 200


def attack_configurations(result: AttackResult, rng: random.Random, amount: int) -> None:
    """Check files and prepare the start with each good file. Any error that no user can read is a finding."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "instrument.toml"
        for _ in range(amount):
            content = any_file(rng)
            path.write_bytes(content)
            result.sent += 1
            try:
                good = checked(path)
                result.notes["good" if good else "rejected"] += 1
                if good:
                    asyncio.run(prepare(path))
            except Exception as error:
                result.check(False, f"{type(error).__name__}: {error!s:.200}: {content!r:.2000}")
    result.check(min(result.notes["good"], result.notes["rejected"]) > amount / 20, "too few good files")


def checked(path: Path) -> bool:
    """Return True if the file is good. Raises ValueError if the result of the check is not readable."""
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            check_config([path], as_json=True)
    except ConfigurationFileError as error:
        message = failure_values(error)["message"]
    else:
        return True
    sentences = message.split("\n")
    if len(sentences) > MAX_SENTENCES or not all(
        s.startswith(str(path)) and s.isprintable() for s in sentences
    ):
        raise ValueError(f"not one sentence for each error: {message[:300]!r}")
    return False


async def prepare(path: Path) -> None:
    """Do what `pneuforce run` does before it opens a port, and open the ports that do not exist."""
    configuration = load(path)
    broadcaster = EntryBroadcaster()
    session = Session(Instrument(configuration.settings()), broadcaster)
    source = AuditLogger(session, NullAuditSink())
    socket_path, web = resolve_path(path, configuration.local.socket), configuration.web
    files = ServiceFiles(socket=socket_path)
    Servers(configuration, Host(session, configuration.rig.port), source, broadcaster, files)
    create_services(WebProcessOptions(str(socket_path), web.host, web.port, web.allow))
    link_problem(configuration.can.channel)
    for name in (configuration.events.file, configuration.local.socket):
        file = resolve_path(path, name)
        if file is not None:
            with contextlib.suppress(OSError):
                file.lstat()
    for host in (configuration.modbus.host, configuration.web.host, configuration.can.host):
        with contextlib.suppress(OSError):
            socket.getaddrinfo(host, 1, flags=socket.AI_NUMERICHOST)
    open_missing_ports(configuration)


def open_missing_ports(configuration: Configuration) -> None:
    """Open the serial ports, except devices that exist. Each error must be one that a user can read."""
    rig, rtu = configuration.rig.port, configuration.modbus_rtu
    if not os.path.lexists(rig) and not rig.startswith("socket://"):
        with contextlib.suppress(PneuforceError):
            SerialPort(rig).close()
    if rtu.enabled and not os.path.lexists(rtu.port):
        with contextlib.suppress(OSError):
            open_port(rtu.port, rtu.baud, rtu.parity, rtu.stop_bits).close()
