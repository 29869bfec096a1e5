"""Options that address a running instrument: Modbus TCP, or Modbus RTU on a serial line."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Mapping
from functools import wraps
from typing import Annotated, Any, NamedTuple, get_type_hints

import typer

from pneuforce.instrument.cli.options import Parity

OPTIONS: Mapping[str, Any] = {
    "host": Annotated[str | None, typer.Option(help="Address of the instrument; default 127.0.0.1.")],
    "port": Annotated[int | None, typer.Option(help="TCP port; default 5020.", min=1, max=65535)],
    "device": Annotated[
        str | None, typer.Option(help="Serial port of this computer, for Modbus RTU instead of TCP.")
    ],
    "baud": Annotated[
        int | None, typer.Option(help="With --device: baud rate; default 19200.", min=1200, max=115200)
    ],
    "parity": Annotated[Parity | None, typer.Option(help="With --device: parity; default even.")],
    "unit": Annotated[int | None, typer.Option(help="Unit id; default 1.", min=1, max=247)],
}


class InstrumentAddress(NamedTuple):
    """Address of an instrument. An option that is not given is None."""

    host: str | None = None
    port: int | None = None
    device: str | None = None
    baud: int | None = None
    parity: Parity | None = None
    unit: int | None = None

    @property
    def url(self) -> str:
        """Return the address for `pneuforce.connect`. Raises ConfigurationError for useless options."""
        self._check()
        if self.device is not None:
            line = f"baud={self.baud or 19200}&parity={self.parity or 'even'}"
            return f"rtu://{os.path.abspath(self.device)}?unit={self.unit or 1}&{line}"
        host = self.host or "127.0.0.1"
        host = f"[{host}]" if ":" in host else host
        return f"tcp://{host}:{self.port or 5020}?unit={self.unit or 1}"

    def _check(self) -> None:
        from pneuforce.errors import ConfigurationError

        useless = ("baud", "parity") if self.device is None else ("host", "port")
        for name in useless:
            if getattr(self, name) is not None:
                needed = "needs --device" if self.device is None else "is for Modbus TCP, not for --device"
                raise ConfigurationError(f"--{name} {needed}: remove --{name}, or change the other option")


def at_address(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command for typer in which the options of this module replace the parameter `address`."""

    @wraps(command)
    def with_options(**values: Any) -> None:
        address = InstrumentAddress(**{name: values.pop(name) for name in OPTIONS})
        command(address=address, **values)

    hints = get_type_hints(command, include_extras=True)
    parameters = [
        each.replace(annotation=hints[each.name], kind=inspect.Parameter.KEYWORD_ONLY)
        for each in inspect.signature(command).parameters.values()
        if each.name != "address"
    ]
    parameters += [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=annotation)
        for name, annotation in OPTIONS.items()
    ]
    with_options.__annotations__ = {each.name: each.annotation for each in parameters}
    with_options.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    return with_options
