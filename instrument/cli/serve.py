"""`pneuforce run`: the host process, its instrument and its buses put together."""

from __future__ import annotations

import asyncio
import errno
import gc
import json
import logging
import signal
import sys
import time
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from instrument.aside import unless
from instrument.cli.can_face import CanFace
from instrument.cli.event_face import witnessed
from instrument.cli.health import can_health, events_health, modbus_health, rig_health, rtu_health
from instrument.cli.local_face import PAGE, LocalFace
from instrument.cli.logs import log_to_stderr
from instrument.cli.loop import Loop, Shown
from instrument.cli.notify import service_face
from instrument.cli.page_face import PageFace, page_face
from instrument.cli.recorder import Recorder
from instrument.cli.rtu_face import RtuFace
from instrument.config import Configuration
from instrument.core import Instrument
from instrument.coupling import Coupling
from instrument.errors import FaceError
from instrument.host import Host
from instrument.tape.feed import Feed
from instrument.tape.schema import ASKED
from registers.modbus.identity import Object
from registers.modbus.tcp import ModbusTcpServer, Options
from registers.source import Source

log = logging.getLogger("pneuforce")

SWITCH_INTERVAL_S = 0.0005  #: how long a bus thread may hold up the loop


@dataclass(frozen=True, slots=True, kw_only=True)
class Files:
    """What an instrument keeps beside its configuration; None for none."""

    events: Path | None = None
    socket: Path | None = None
    recording: Path | None = None


def serve(configuration: Configuration, files: Files) -> None:
    """Run until SIGTERM or Ctrl-C, then vent and end.

    Prints one JSON line when it serves Modbus: its port, and that of the page where one is wanted, null where
    it does not serve as yet. CAN follows once the node id was found free; until then the status says that CAN
    is down.

    Raises PneuforceError where it cannot start.
    """
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    with log_to_stderr():
        if configuration.doubt:
            log.warning("%s", configuration.doubt)
        asyncio.run(_serve(configuration, files))


async def _serve(configuration: Configuration, files: Files) -> None:
    feed = Feed()
    coupling = Coupling(Instrument(configuration.settings()), feed)
    with witnessed(coupling, configuration, files.events, feed) as witness:
        host = Host(coupling, configuration.rig.port)
        host.faces.append(witness)
        await work_until_stopped(Faces(configuration, host, witness, feed), files)


class Faces:
    """Everything that shows the instrument of one host, or what a player shows in its place."""

    def __init__(self, configuration: Configuration, host: Loop, source: Shown, feed: Feed) -> None:
        """Set them up, none opened. Raises PneuforceError: a port wanted twice, or too much of CAN."""
        self.configuration = configuration
        self.host = host
        self.source = source
        self.modbus = modbus_server(configuration, source)
        self.rtu = RtuFace(configuration, source, identity(configuration))
        own = configuration.can
        self.can = CanFace(source, own) if own.enabled else None
        self.local = LocalFace(host.coupling, source, feed, configuration, self._health)
        self.service = service_face(source)
        host.faces += [self.local, self.service]

    def _health(self, now_s: float) -> dict[str, Any]:
        return {
            "rig": rig_health(self.host, self.source.snapshot(PAGE, now_s).age_s),
            "modbus_tcp": modbus_health(self.modbus, now_s),
            "modbus_rtu": rtu_health(self.rtu),
            "can": can_health(self.can, now_s),
            "events": events_health(self.configuration.events.file, self.host.instrument.log_down),
        }


async def work_until_stopped(faces: Faces, files: Files) -> None:
    """Open the faces, and go round until SIGTERM or Ctrl-C. Raises PneuforceError where it cannot start."""
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()

    def end() -> None:
        stop.set()
        faces.service.stopping()

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:  # nohup's wish
            loop.add_signal_handler(number, end)
    page = page_face(faces.configuration.page, files.socket)
    await faces.local.open(files.socket)
    recorder = (
        Recorder(faces.local, files.socket, files.recording) if files.socket and files.recording else None
    )
    joining = asyncio.create_task(_join(faces, stop))
    why = ASKED
    try:
        if page is not None:
            page.begin()
        if recorder is not None:
            await recorder.start()
        await faces.host.connect(stop)
        await _work(faces, page, joining, stop)
    except BaseException as error:
        why = str(error) or type(error).__name__
        raise
    finally:
        faces.source.end(why, time.monotonic())  # first: while others are waited for, the rig falls silent
        stop.set()
        if faces.can is not None:
            faces.can.close()
        await asyncio.gather(joining, return_exceptions=True)  # what it raised was raised in _work
        await faces.local.close(why)
        if page is not None:
            await page.close()
        if recorder is not None:
            await recorder.ended()


async def _join(faces: Faces, stop: asyncio.Event) -> None:
    """Join the CAN bus, if any: it listens for 1.2 s whether its node id is free. Raises FaceError."""
    if faces.can is not None:
        faces.source.can_down = True
        await faces.can.open(stop)
        faces.host.faces.append(faces.can)


async def _work(
    faces: Faces, page: PageFace | None, joining: asyncio.Task[None], stop: asyncio.Event
) -> None:
    host, modbus = faces.host, faces.modbus
    working = asyncio.create_task(host.run(stop))
    try:
        if not stop.is_set():
            await faces.rtu.open()
            await (joining if modbus is None else _listen(modbus, faces.configuration))
            ports = {"modbus": modbus.port if modbus else None}
            if page is not None:
                ports["page"] = await unless(stop, page.tried())
            print(json.dumps(ports), flush=True)
        await joining
        if not stop.is_set():
            faces.service.ready()
        gc.freeze()
        await working
    finally:
        faces.rtu.close()
        if modbus is not None:
            modbus.close()
        stop.set()
        await working


def modbus_server(configuration: Configuration, source: Source) -> ModbusTcpServer | None:
    """The Modbus server of a configuration, None where it is switched off."""
    own = configuration.modbus
    if not own.enabled:
        return None
    options = Options(
        host=own.host,
        port=own.port,
        allow=tuple(own.allow),
        unit=own.unit,
        word_swap=own.word_order == "CDAB",
        read_only=own.read_only,
        most_connections=own.connections,
        idle_s=own.idle_s,
        frame_s=own.frame_s,
    )
    return ModbusTcpServer(source, options, identity(configuration))


async def _listen(modbus: ModbusTcpServer, configuration: Configuration) -> None:
    own = configuration.modbus
    try:
        await modbus.start()
    except OSError as error:
        busy = error.errno == errno.EADDRINUSE
        why = "it is in use; end the other instrument, or change [modbus] port" if busy else error.strerror
        raise FaceError(f"Modbus cannot listen on {own.host}:{own.port}: {why or error}") from None
    log.info("Modbus TCP on %s:%d, unit %d", own.host, modbus.port, own.unit)


def identity(configuration: Configuration) -> dict[int, str]:
    """Objects of Modbus function 43/14."""
    own = configuration.identity
    calibrated = configuration.calibration_date
    date = f"{calibrated:08d}"
    return {
        Object.VENDOR: "pneuforce",
        Object.PRODUCT_CODE: "PF-1",
        Object.REVISION: version("pneuforce"),
        Object.URL: own.url,
        Object.PRODUCT_NAME: "Pneumatic force sensor",
        Object.MODEL: "PF-1 field instrument",
        Object.USER_APPLICATION: own.application,
        Object.SERIAL_NUMBER: str(own.serial_number),
        Object.CALIBRATION_DATE: f"{date[:4]}-{date[4:6]}-{date[6:]}" if calibrated else "",
    }
