"""The command `pneuforce watch`, and the check of its combinations of options."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from pneuforce.instrument.cli.operate.instrument_address import InstrumentAddress
from pneuforce.instrument.cli.terminal.options import Json, Parity, Seconds, checked_host
from pneuforce.instrument.cli.watch.can_commands import checked_interface

commands = typer.Typer()


class BusName(Enum):
    """Buses that the command can watch."""

    MODBUS = "modbus"
    CAN = "can"


#: Valid options of each variant of the command. All other options are rejected, because they have no effect.
VALID_OPTIONS: Mapping[str, set[str]] = {
    "modbus": {"host", "port", "unit", "ca", "certificate", "key"},
    "modbus --device": {"device", "baud", "parity", "unit"},
    "can": {"interface", "channel", "host", "port", "node_id"},
}


Host = Annotated[
    str | None,
    typer.Option(
        help="Address of the instrument or of the CAN hub; default 127.0.0.1.", callback=checked_host
    ),
]
Port = Annotated[
    int | None, typer.Option(help="TCP port; default 5020 (Modbus), 29536 (CAN).", min=1, max=65535)
]
Device = Annotated[str | None, typer.Option(help="For modbus only: serial port, for RTU instead of TCP.")]
Baud = Annotated[int | None, typer.Option(help="With --device: baud rate; default 19200.", min=1)]
LineParity = Annotated[Parity | None, typer.Option(help="With --device: parity; default even.")]
Unit = Annotated[int | None, typer.Option(help="For modbus only: unit id; default 1.", min=1, max=247)]
Interface = Annotated[
    str | None,
    typer.Option(help="For can only: python-can interface; default socketcand.", callback=checked_interface),
]
Channel = Annotated[str | None, typer.Option(help="For can only: channel of the interface; default can0.")]
Ca = Annotated[Path | None, typer.Option(help="For Modbus/TCP Security: authority (PEM).")]
Certificate = Annotated[Path | None, typer.Option(help="For Modbus/TCP Security: own certificate (PEM).")]
Key = Annotated[Path | None, typer.Option(help="For Modbus/TCP Security: key of --certificate.")]
NodeId = Annotated[
    int | None, typer.Option(help="For can only: node id of the instrument; default 5.", min=1, max=127)
]


@commands.command()
def watch(
    bus: Annotated[BusName, typer.Argument(help="The bus to watch.")],
    host: Host = None,
    port: Port = None,
    ca: Ca = None,
    certificate: Certificate = None,
    key: Key = None,
    device: Device = None,
    baud: Baud = None,
    parity: LineParity = None,
    unit: Unit = None,
    interface: Interface = None,
    channel: Channel = None,
    node_id: NodeId = None,
    seconds: Seconds = None,
    as_json: Json = False,
) -> None:
    """Show the values that a PLC (modbus) or a robot controller (can) reads from a running instrument.

    Modbus registers are shown in the units of the registers, CAN signals in the units of the DBC file.
    With --json, both are in N, kPa, mm and s, with null for a value that is not available.
    Registers that repeat a quantity in another unit (for example pressure_pa) are left out.

    Example: pneuforce watch modbus --seconds 5
    """
    from pneuforce.instrument.cli.watch.watch_can import watch_can
    from pneuforce.instrument.cli.watch.watch_modbus import watch_modbus
    from pneuforce.registers.can.bus import CanAddress
    from pneuforce.teststand.observer import CanNodeAddress

    variant = f"{bus.value} --device" if bus is BusName.MODBUS and device else bus.value
    modbus = InstrumentAddress(host, port, ca, certificate, key, device, baud, parity, unit)
    _check_options(
        variant, {**modbus._asdict(), "interface": interface, "channel": channel, "node_id": node_id}
    )
    if bus is BusName.MODBUS:
        watch_modbus(modbus.url, seconds, as_json)
    else:
        address = CanAddress(
            interface=interface or "socketcand",
            channel=channel or "can0",
            host=host or "127.0.0.1",
            port=port or 29536,
        )
        watch_can(CanNodeAddress(address, node_id or 5), seconds, as_json)


def _check_options(variant: str, options: Mapping[str, object]) -> None:
    """Raise ConfigurationError if an option has no effect in this variant of the command."""
    from pneuforce.errors import ConfigurationError

    for name, value in options.items():
        if value is not None and name not in VALID_OPTIONS[variant]:
            others = " and ".join(f"watch {other}" for other, names in VALID_OPTIONS.items() if name in names)
            raise ConfigurationError(f"--{name.replace('_', '-')} is for {others}, not for watch {variant}")
