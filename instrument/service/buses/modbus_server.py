"""Modbus TCP in the host process: server of a configuration, its start, and its device identification."""

from __future__ import annotations

import logging
from importlib.metadata import version

from pneuforce.errors import ConfigurationFileError, ServerError
from pneuforce.instrument.config import Configuration
from pneuforce.instrument.service.buses.interface_lines import modbus_tcp_line
from pneuforce.registers.modbus.device_identification import IdentityObject
from pneuforce.registers.modbus.tcp import ModbusTcpOptions, ModbusTcpServer
from pneuforce.registers.source import Source
from pneuforce.support.listening import listen_failure, needs_privilege

log = logging.getLogger("pneuforce")


def modbus_server_of(configuration: Configuration, source: Source) -> ModbusTcpServer | None:
    """Return the Modbus TCP server of a configuration, or None if it is disabled."""
    settings = configuration.modbus
    if not settings.enabled:
        return None
    options = ModbusTcpOptions(
        host=settings.host,
        port=settings.port,
        allow=tuple(settings.allow),
        unit=settings.unit,
        word_swap=settings.word_order == "CDAB",
        read_only=settings.read_only,
        max_connections=settings.max_connections,
        idle_timeout_s=settings.idle_timeout_s,
        frame_timeout_s=settings.frame_timeout_s,
    )
    return ModbusTcpServer(source, options, identity(configuration))


async def open_modbus(modbus: ModbusTcpServer, configuration: Configuration) -> None:
    """Listen on the configured address.

    Raises ConfigurationFileError if the port needs a privilege, ServerError for every other reason.
    """
    settings = configuration.modbus
    try:
        await modbus.start()
    except OSError as error:
        why = listen_failure(error, "modbus", settings.port)
        kind = ConfigurationFileError if needs_privilege(error) else ServerError
        raise kind(f"Modbus cannot listen on {settings.host}:{settings.port}: {why}") from None
    log.info("%s", modbus_tcp_line(configuration, modbus.port))


def identity(configuration: Configuration) -> dict[int, str]:
    """Return the objects of Modbus function 43/14 (device identification)."""
    settings = configuration.identity
    calibrated = configuration.calibration_date
    date = f"{calibrated:08d}"
    return {
        IdentityObject.VENDOR: "pneuforce",
        IdentityObject.PRODUCT_CODE: "PF-1",
        IdentityObject.REVISION: version("pneuforce"),
        IdentityObject.URL: settings.url,
        IdentityObject.PRODUCT_NAME: "Pneumatic force sensor",
        IdentityObject.MODEL: "PF-1 field instrument",
        IdentityObject.USER_APPLICATION: settings.application,
        IdentityObject.SERIAL_NUMBER: str(settings.serial_number),
        IdentityObject.CALIBRATION_DATE: f"{date[:4]}-{date[4:6]}-{date[6:]}" if calibrated else "",
    }
