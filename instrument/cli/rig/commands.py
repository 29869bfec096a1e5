"""The commands for a rig without a running instrument: doctor, flash."""

from __future__ import annotations

from typing import Annotated

import typer

from pneuforce.instrument.cli.terminal.options import Json

commands = typer.Typer()

_DEVICE = "Serial device of the board, for example /dev/serial/by-id/…"


@commands.command()
def doctor(
    port: Annotated[str, typer.Option("--port", help=f"{_DEVICE}; or the link of a simulator.")],
    inflate_kpa: Annotated[
        float | None,
        typer.Option(
            "--inflate",
            min=2.0,
            max=12.0,
            help="Also inflate the balloon to this pressure in kPa, to test filling, leak and venting!",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Examine a rig: port, board, samples, clock, sensor, supply; with --inflate also the circuit.

    Each check gives pass, warning or fail, and a recommended action.
    The rig is vented at the end, also after Ctrl-C.
    The exit code is 1 if a check fails or the examination is interrupted.
    Do not touch the balloon during the examination. Start a simulator with --no-hand.

    Example: pneuforce doctor --port /dev/ttyACM0 --inflate 5.0
    """
    from pneuforce.instrument.cli.rig.doctor import run_doctor

    raise typer.Exit(run_doctor(port, inflate_kpa, as_json))


@commands.command()
def flash(
    port: Annotated[str, typer.Option("--port", help=f"{_DEVICE}.")],
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only print the command.")] = False,
    as_json: Json = False,
) -> None:
    """Write the firmware to an Arduino UNO with avrdude.

    Nothing is written if the chip is not an ATmega328P, or if another process uses the port.

    Example: pneuforce flash --port /dev/ttyACM0 --dry-run
    """
    from pneuforce.instrument.cli.rig.flash import run_flash

    run_flash(port, dry_run, as_json)
