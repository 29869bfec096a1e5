"""`pneuforce run`: the host process, its instrument and its buses put together."""

from __future__ import annotations

import asyncio
import gc
import logging
import signal
import sys
from importlib.metadata import version

from instrument.cli.can_face import CanFace
from instrument.config import Configuration
from instrument.core import Instrument
from instrument.errors import FaceError
from instrument.host import Host
from registers.modbus.tcp import ModbusTcpServer, Options

log = logging.getLogger("pneuforce")

URL = "https://pneuforce.example"
SWITCH_INTERVAL_S = 0.0005  #: how long a bus thread may hold up the loop


def serve(configuration: Configuration) -> None:
    """Run until SIGTERM or Ctrl-C, then vent and end. Raises PneuforceError where it cannot start."""
    logging.basicConfig(
        format="%(asctime)s %(message)s", datefmt="%H:%M:%S", level=logging.INFO, stream=sys.stderr
    )
    logging.getLogger("can").setLevel(logging.ERROR)
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    asyncio.run(_serve(configuration))


async def _serve(configuration: Configuration) -> None:
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    instrument = Instrument(configuration.settings())
    host = Host(instrument, configuration.rig.port)
    modbus = modbus_server(configuration, instrument)
    can = CanFace(instrument, configuration.can) if configuration.can.enabled else None
    try:
        if can is not None:
            await can.open()  # python-can takes long to import: before the rig waits for its keep-alive
        await host.connect()
        log.info("rig on %s answered", host.url)
        if can is not None:
            host.faces.append(can)
        await _work(host, modbus, configuration, stop)
    finally:
        if can is not None:
            can.close()


async def _work(
    host: Host, modbus: ModbusTcpServer | None, configuration: Configuration, stop: asyncio.Event
) -> None:
    working = asyncio.create_task(host.run(stop))
    try:
        if modbus is not None:
            await _listen(modbus, configuration)
        gc.freeze()
        await working
        log.info("vented; ended")
    finally:
        stop.set()
        await working
        if modbus is not None:
            modbus.close()


def modbus_server(configuration: Configuration, instrument: Instrument) -> ModbusTcpServer | None:
    """The Modbus server of a configuration, None where it is switched off."""
    own = configuration.modbus
    if not own.enabled:
        return None
    options = Options(
        host=own.host,
        port=own.port,
        unit=own.unit,
        word_swap=own.word_order == "CDAB",
        read_only=own.read_only,
        most_connections=own.connections,
        idle_s=own.idle_s,
        frame_s=own.frame_s,
    )
    return ModbusTcpServer(instrument, options, identity(configuration))


async def _listen(modbus: ModbusTcpServer, configuration: Configuration) -> None:
    own = configuration.modbus
    try:
        await modbus.start()
    except OSError as error:
        raise FaceError(
            f"Modbus cannot listen on {own.host}:{own.port}: {error.strerror or error}; "
            "is another instrument running?"
        ) from None
    log.info("Modbus TCP on %s:%d, unit %d", own.host, modbus.port, own.unit)


def identity(configuration: Configuration) -> dict[int, str]:
    """Objects of Modbus function 43/14."""
    date = f"{configuration.identity.calibration_date:08d}"
    return {
        0x00: "pneuforce",
        0x01: "PF-1",
        0x02: version("pneuforce"),
        0x03: URL,
        0x04: "Pneumatic force sensor",
        0x05: "PF-1 field instrument",
        0x06: configuration.identity.application,
        0x80: str(configuration.identity.serial_number),
        0x81: f"{date[:4]}-{date[4:6]}-{date[6:]}" if configuration.identity.calibration_date else "",
    }
