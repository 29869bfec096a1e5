"""The commands for a CAN bus: canlog, cansend, hub."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from pneuforce.instrument.cli.terminal.options import Seconds, checked_host

commands = typer.Typer()


def checked_interface(name: str | None) -> str | None:
    """Return `name`. Raises BadParameter if python-can has no interface of this name."""
    from pneuforce.registers.can.bus import interface_exists

    if name is None or interface_exists(name):
        return name
    raise typer.BadParameter(f"python-can has no interface {name!r}: socketcand and socketcan are usual")


Interface = Annotated[str, typer.Option(help="python-can interface.", callback=checked_interface)]
Channel = Annotated[str, typer.Option(help="Channel of the interface.")]
HubHost = Annotated[
    str,
    typer.Option("--host", help="For socketcand only: address of the CAN hub.", callback=checked_host),
]
HubPort = Annotated[
    int, typer.Option("--port", help="For socketcand only: TCP port of the CAN hub.", min=1, max=65535)
]


class LogFormat(Enum):
    """File formats of a CAN log."""

    CANDUMP = "candump"
    ASC = "asc"
    BLF = "blf"


@commands.command()
def canlog(
    form: Annotated[
        LogFormat, typer.Option("--format", help="File format: that of candump -l, or Vector's ASC or BLF.")
    ] = LogFormat.CANDUMP,
    output: Annotated[
        Path | None, typer.Option("--output", help="A new file; without it, stdout (not for BLF).")
    ] = None,
    seconds: Seconds = None,
    interface: Interface = "socketcand",
    channel: Channel = "can0",
    host: HubHost = "127.0.0.1",
    port: HubPort = 29536,
) -> None:
    """Record every frame on a CAN bus: the frames of the instrument and of all other nodes.

    If the command is killed, the file contains all frames that were received before.
    A BLF file is incomplete after a kill: end the command with Ctrl-C or --seconds.
    To send the recorded frames again, use python -m can.player.

    Example: pneuforce canlog --seconds 10 --output press.log
    """
    from pneuforce.instrument.cli.watch.canlog import record
    from pneuforce.registers.can.bus import CanAddress

    address = CanAddress(interface=interface, channel=channel, host=host, port=port)
    record(address, form.value, output, seconds)


@commands.command()
def cansend(
    frames: Annotated[
        list[str],
        typer.Argument(
            metavar="FRAME...", help="Frames to send, or - for lines of stdin.", show_default=False
        ),
    ],
    interface: Interface = "socketcand",
    channel: Channel = "can0",
    host: HubHost = "127.0.0.1",
    port: HubPort = 29536,
) -> None:
    """Send frames on a CAN bus, in the notation of cansend from can-utils or of candump -L.

    The answer of the instrument is shown by pneuforce watch can.

    Example: pneuforce cansend 205#0000000100000000

    Example: pneuforce canlog | ./robot_listener - 6.0 | pneuforce cansend -
    """
    from pneuforce.instrument.cli.watch.cansend import send
    from pneuforce.registers.can.bus import CanAddress

    send(CanAddress(interface=interface, channel=channel, host=host, port=port), frames)


@commands.command()
def hub(
    port: Annotated[
        int, typer.Option(help="TCP port on the loopback interface; 0 selects a free port.", min=0, max=65535)
    ] = 29536,
) -> None:
    """Run a CAN hub, a CAN bus between the programs on this computer, until Ctrl-C or SIGTERM.

    For a computer whose kernel does not support CAN. Prints one JSON line with the port.
    Programs connect with the interface socketcand and the channel can0.

    Example: pneuforce hub --port 29536
    """
    from pneuforce.errors import ServerError
    from pneuforce.registers.can.hub import run

    try:
        run(port)
    except OSError as error:
        raise ServerError(str(error)) from None
