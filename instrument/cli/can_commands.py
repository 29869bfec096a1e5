"""The command that keeps what is on a CAN bus."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from instrument.cli.options import Seconds

commands = typer.Typer()


class LogFormat(Enum):
    """What a recording is written as."""

    CANDUMP = "candump"
    ASC = "asc"
    BLF = "blf"


@commands.command()
def canlog(
    form: Annotated[
        LogFormat, typer.Option("--format", help="candump -l's, or Vector's ASC or BLF.")
    ] = LogFormat.CANDUMP,
    output: Annotated[
        Path | None, typer.Option("--output", help="A new file; without it, stdout (not BLF).")
    ] = None,
    seconds: Seconds = None,
    interface: Annotated[str, typer.Option(help="python-can interface.")] = "socketcand",
    channel: Annotated[str, typer.Option(help="Its channel.")] = "can0",
    host: Annotated[str, typer.Option(help="socketcand only: address of the hub.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="socketcand only: its TCP port.", min=1, max=65535)] = 29536,
) -> None:
    """Record every frame on the CAN bus, the instrument's and all others.

    A recording that is killed keeps all frames up to then, except that BLF wants an end by Ctrl-C or time.
    python -m can.player sends a recording again.

    Example: pneuforce canlog --seconds 10 --output press.log
    """
    from instrument.cli.canlog import record
    from registers.can.bus import BusAt

    at = BusAt(interface=interface, channel=channel, host=host, port=port)
    record(at, form.value, output, seconds)
