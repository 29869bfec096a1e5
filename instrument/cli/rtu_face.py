"""The Modbus RTU face: the configured unit on its own serial port."""

from __future__ import annotations

import logging
import os
from collections.abc import Mapping

from instrument.config import Configuration
from instrument.errors import ConfigurationError, FaceError
from registers.modbus.rtu_line import ModbusRtuLine, Options
from registers.source import Source

log = logging.getLogger("pneuforce")


def check_ports(configuration: Configuration) -> None:
    """Raise ConfigurationError where both faces of the host would be on one port."""
    own, rig = configuration.modbus_rtu, configuration.rig
    if own.enabled and os.path.realpath(own.port) == os.path.realpath(rig.port):
        raise ConfigurationError(
            f"modbus_rtu.port = {own.port} is the rig's own port (rig.port = {rig.port}): "
            "Modbus RTU needs another serial port"
        )


class RtuFace:
    """Modbus RTU as configured; nothing where it is switched off."""

    def __init__(self, configuration: Configuration, source: Source, identity: Mapping[int, str]) -> None:
        """Set up the unit. Raises ConfigurationError: its port is the rig's."""
        check_ports(configuration)
        own = configuration.modbus_rtu
        options = Options(
            port=own.port,
            baud=own.baud,
            parity=own.parity,
            stop_bits=own.stop_bits,
            unit=own.unit,
            word_swap=own.word_order == "CDAB",
            read_only=own.read_only,
        )
        self.line = ModbusRtuLine(source, options, identity) if own.enabled else None

    async def open(self) -> None:
        """Listen on the port. Raises FaceError."""
        if self.line is None:
            return
        try:
            await self.line.start()
        except OSError as error:
            raise FaceError(f"Modbus RTU: {error}") from None
        log.info("Modbus RTU on %s, unit %d", self.line.options, self.line.options.unit)

    def close(self) -> None:
        """Give the port back."""
        if self.line is not None:
            self.line.close()
