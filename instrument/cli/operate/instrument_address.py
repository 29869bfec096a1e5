"""Options that address a running instrument: Modbus TCP, or Modbus RTU on a serial line."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, NamedTuple
from urllib.parse import urlencode

import typer

from pneuforce.instrument.cli.terminal.options import Parity, checked_host

_TLS = ("ca", "certificate", "key")


def command(words: str, url: str) -> str:
    """Return a command to suggest. At another address than the default, its options are needed."""
    same_options = "" if url == InstrumentAddress().url else " (with the same options for the address)"
    return f"pneuforce {words}{same_options}"


class InstrumentAddress(NamedTuple):
    """Address of an instrument. An option that is not given is None."""

    host: Annotated[
        str | None,
        typer.Option(help="Address of the instrument; default 127.0.0.1.", callback=checked_host),
    ] = None
    port: Annotated[int | None, typer.Option(help="TCP port; default 5020.", min=1, max=65535)] = None
    ca: Annotated[Path | None, typer.Option(help="For Modbus/TCP Security: authority (PEM).")] = None
    certificate: Annotated[
        Path | None, typer.Option(help="For Modbus/TCP Security: own certificate (PEM).")
    ] = None
    key: Annotated[Path | None, typer.Option(help="For Modbus/TCP Security: key of --certificate.")] = None
    device: Annotated[
        str | None, typer.Option(help="Serial port of this computer, for Modbus RTU instead of TCP.")
    ] = None
    baud: Annotated[
        int | None, typer.Option(help="With --device: baud rate; default 19200.", min=1200, max=115200)
    ] = None
    parity: Annotated[Parity | None, typer.Option(help="With --device: parity; default even.")] = None
    unit: Annotated[int | None, typer.Option(help="Unit id; default 1.", min=1, max=247)] = None

    @property
    def url(self) -> str:
        """Return the address for `pneuforce.connect`. Raises ConfigurationError for useless options."""
        self._check()
        if self.device is not None:
            line = f"baud={self.baud or 19200}&parity={self.parity or 'even'}"
            return f"rtu://{os.path.abspath(self.device)}?unit={self.unit or 1}&{line}"
        host = self.host or "127.0.0.1"
        host = f"[{host}]" if ":" in host else host
        if self.certificate is None:
            return f"tcp://{host}:{self.port or 5020}?unit={self.unit or 1}"
        files = urlencode({name: getattr(self, name) for name in _TLS}, safe="/")
        return f"tls://{host}:{self.port or 802}?unit={self.unit or 1}&{files}"

    def _check(self) -> None:
        from pneuforce.errors import ConfigurationError

        given = [name for name in _TLS if getattr(self, name) is not None]
        if 0 < len(given) < len(_TLS):
            raise ConfigurationError(
                "--ca, --certificate and --key belong together: give all of them, or none"
            )
        useless = ("baud", "parity") if self.device is None else ("host", "port", *_TLS)
        for name in useless:
            if getattr(self, name) is not None:
                needed = "needs --device" if self.device is None else "is for Modbus TCP, not for --device"
                raise ConfigurationError(f"--{name} {needed}: remove --{name}, or change the other option")
