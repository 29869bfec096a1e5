"""Modbus RTU server of the host, on its own serial port."""

from __future__ import annotations

import logging
import os
from collections.abc import Mapping

from pneuforce.errors import ConfigurationError, ServerError
from pneuforce.instrument.config import Configuration
from pneuforce.instrument.service.buses.interface_lines import modbus_rtu_line
from pneuforce.registers.modbus.rtu_server import ModbusRtuOptions, ModbusRtuServer
from pneuforce.registers.source import Source

log = logging.getLogger("pneuforce")


def check_ports(configuration: Configuration) -> None:
    """Raise ConfigurationError if Modbus RTU and the rig use the same port."""
    rtu, rig = configuration.modbus_rtu, configuration.rig
    if rtu.enabled and os.path.realpath(rtu.port) == os.path.realpath(rig.port):
        raise ConfigurationError(
            f"modbus_rtu.port = {rtu.port} is also the port of the rig (rig.port = {rig.port}): "
            "connect Modbus RTU to another serial port"
        )


class RtuServer:
    """Modbus RTU server of a configuration. Its methods do nothing if Modbus RTU is disabled."""

    def __init__(self, configuration: Configuration, source: Source, identity: Mapping[int, str]) -> None:
        """Create the server. Raises ConfigurationError if Modbus RTU and the rig use the same port."""
        check_ports(configuration)
        self._configuration = configuration
        settings = configuration.modbus_rtu
        options = ModbusRtuOptions(
            port=settings.port,
            baud=settings.baud,
            parity=settings.parity,
            stop_bits=settings.stop_bits,
            unit=settings.unit,
            word_swap=settings.word_order == "CDAB",
            read_only=settings.read_only,
        )
        self.line = ModbusRtuServer(source, options, identity) if settings.enabled else None

    async def open(self) -> None:
        """Open the port. Raises ServerError if the port cannot be opened."""
        if self.line is None:
            return
        try:
            await self.line.start()
        except OSError as error:
            remedy = "connect the port, correct [modbus_rtu] port, or set [modbus_rtu] enabled = false"
            raise ServerError(f"Modbus RTU: {error}; {remedy}") from None
        log.info("%s", modbus_rtu_line(self._configuration, str(self.line.options)))

    def close(self) -> None:
        """Close the port."""
        if self.line is not None:
            self.line.close()
