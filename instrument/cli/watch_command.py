"""The command that looks at a bus, and which of its options go together."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Annotated

import typer

from instrument.cli.options import Json, Parity, Seconds

commands = typer.Typer()


class BusName(Enum):
    """The buses that can be watched."""

    MODBUS = "modbus"
    CAN = "can"


#: What each way of watching takes; another option would be of no effect, and so is refused.
TAKES: Mapping[str, set[str]] = {
    "modbus": {"host", "port", "unit"},
    "modbus --device": {"device", "baud", "parity", "unit"},
    "can": {"interface", "channel", "host", "port", "node_id"},
}


Host = Annotated[str | None, typer.Option(help="Of the instrument, or of the CAN hub; default 127.0.0.1.")]
Port = Annotated[
    int | None, typer.Option(help="TCP port; default 5020 (Modbus), 29536 (CAN).", min=1, max=65535)
]
Device = Annotated[str | None, typer.Option(help="Modbus only: serial port, for RTU instead of TCP.")]
Baud = Annotated[int | None, typer.Option(help="With --device: its baud rate; default 19200.", min=1)]
LineParity = Annotated[Parity | None, typer.Option(help="With --device: its parity; default even.")]
Unit = Annotated[int | None, typer.Option(help="Modbus only: unit id; default 1.", min=1, max=247)]
Interface = Annotated[str | None, typer.Option(help="CAN only: python-can interface; default socketcand.")]
Channel = Annotated[str | None, typer.Option(help="CAN only: channel; default can0.")]
NodeId = Annotated[
    int | None, typer.Option(help="CAN only: node id of the instrument; default 5.", min=1, max=127)
]


@commands.command()
def watch(
    bus: Annotated[BusName, typer.Argument(help="Which bus to look at.")],
    host: Host = None,
    port: Port = None,
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
    """Show what a PLC (modbus) or a robot controller (can) sees of a running instrument.

    A PLC's registers are shown each in its own unit, CAN signals in the DBC's (N, kPa, mm, s).
    With --json both are in N, kPa, mm, s, and null where not available.
    Registers that repeat another in the unit of their name (pressure_pa) are left out.

    Example: pneuforce watch modbus --seconds 5
    """
    from instrument.cli.observe import NodeAt
    from instrument.cli.watch_can import watch_can
    from instrument.cli.watch_modbus import watch_modbus
    from registers.can.bus import BusAt
    from registers.modbus.client import Plc

    way = f"{bus.value} --device" if bus is BusName.MODBUS and device else bus.value
    own = {"host": host, "port": port, "device": device, "baud": baud, "parity": parity, "unit": unit}
    _refuse_idle(way, own | {"interface": interface, "channel": channel, "node_id": node_id})
    host = host or "127.0.0.1"
    if bus is BusName.CAN:
        at = BusAt(
            interface=interface or "socketcand", channel=channel or "can0", host=host, port=port or 29536
        )
        watch_can(NodeAt(at, node_id or 5), seconds, as_json)
    elif device:
        watch_modbus(
            lambda: Plc.on_line(device, baud=baud or 19200, parity=parity or "even", unit=unit or 1),
            seconds,
            as_json,
            "has its [modbus_rtu] this baud rate, parity and unit?",
        )
    else:
        watch_modbus(lambda: Plc.connect(host, port or 5020, unit=unit or 1), seconds, as_json)


def _refuse_idle(way: str, options: Mapping[str, object]) -> None:
    from instrument.errors import ConfigurationError

    for name, value in options.items():
        if value is not None and name not in TAKES[way]:
            others = " and ".join(f"watch {other}" for other, takes in TAKES.items() if name in takes)
            raise ConfigurationError(f"--{name.replace('_', '-')} is for {others}, not for watch {way}")
