"""`pneuforce run`: the host process, its instrument and its buses put together."""

from __future__ import annotations

import asyncio
import errno
import gc
import json
import logging
import signal
import sys
from importlib.metadata import version
from pathlib import Path

from instrument.cli.can_face import CanFace
from instrument.cli.event_face import witnessed
from instrument.cli.logs import log_to_stderr
from instrument.cli.rtu_face import RtuFace
from instrument.config import Configuration
from instrument.core import Instrument
from instrument.errors import FaceError
from instrument.events.witness import Witness
from instrument.host import Host
from registers.modbus.identity import Object
from registers.modbus.tcp import ModbusTcpServer, Options
from registers.source import Source

log = logging.getLogger("pneuforce")

SWITCH_INTERVAL_S = 0.0005  #: how long a bus thread may hold up the loop


def serve(configuration: Configuration, events: Path | None) -> None:
    """Run until SIGTERM or Ctrl-C, then vent and end; what happens is kept in the file `events`, if any.

    Prints one JSON line when it serves Modbus. CAN follows once the node id was found free; until then the
    status says that CAN is down.

    Raises PneuforceError where it cannot start.
    """
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    with log_to_stderr():
        if configuration.doubt:
            log.warning("%s", configuration.doubt)
        asyncio.run(_serve(configuration, events))


async def _serve(configuration: Configuration, events: Path | None) -> None:
    instrument = Instrument(configuration.settings())
    with witnessed(instrument, configuration, events) as witness:
        await _run(configuration, instrument, witness)


async def _run(configuration: Configuration, instrument: Instrument, witness: Witness) -> None:
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:  # nohup's wish
            loop.add_signal_handler(number, stop.set)
    host = Host(instrument, configuration.rig.port)
    host.faces.append(witness)
    modbus = modbus_server(configuration, witness)
    rtu = RtuFace(configuration, witness, identity(configuration))
    can = CanFace(instrument, witness, configuration.can) if configuration.can.enabled else None
    joining = asyncio.create_task(_join(can, host, stop))
    try:
        await host.connect(stop)
        if not stop.is_set():
            log.info("rig on %s answered", host.url)
        await _work(host, modbus, rtu, joining, configuration, stop)
    finally:
        stop.set()
        if can is not None:
            can.close()
        await asyncio.gather(joining, return_exceptions=True)  # what it raised was raised in _work


async def _join(can: CanFace | None, host: Host, stop: asyncio.Event) -> None:
    """Join the CAN bus, if any: it listens for 1.2 s whether its node id is free. Raises FaceError."""
    if can is not None:
        host.instrument.can_down = True
        await can.open(stop)
        host.faces.append(can)


async def _work(
    host: Host,
    modbus: ModbusTcpServer | None,
    rtu: RtuFace,
    joining: asyncio.Task[None],
    configuration: Configuration,
    stop: asyncio.Event,
) -> None:
    working = asyncio.create_task(host.run(stop))
    try:
        if not stop.is_set():
            await rtu.open()
            await (joining if modbus is None else _listen(modbus, configuration))
            print(json.dumps({"modbus": modbus.port if modbus else None}), flush=True)
        await joining
        gc.freeze()
        await working
        log.info("vented; ended")
    finally:
        rtu.close()
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
