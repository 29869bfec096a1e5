"""The commands for a rig at the end of a cable, without an instrument around it."""

from __future__ import annotations

from typing import Annotated

import typer

from instrument.cli.options import Json

commands = typer.Typer()

Port = Annotated[
    str, typer.Option("--port", help="The board's device, as /dev/serial/by-id/…; or a simulator's link.")
]


@commands.command()
def doctor(
    port: Port,
    inflate: Annotated[
        float | None,
        typer.Option(
            min=2.0, max=12.0, help="Test ramp, leak and vent at this pressure [kPa]. Inflates the balloon!"
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Examine a rig: port, board, samples, clock, sensor, supply; with --inflate the circuit too.

    Ends venting, also at Ctrl-C. Exit code 1 where a check is bad.

    Example: pneuforce doctor --port /dev/ttyACM0 --inflate 5.0
    """
    from instrument.cli.doctor import run_doctor

    raise typer.Exit(run_doctor(port, inflate, as_json))


@commands.command()
def flash(
    port: Port,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only print what would be run.")] = False,
) -> None:
    """Put the firmware on an Arduino UNO with avrdude; another chip, or a port in use, is refused.

    Example: pneuforce flash --port /dev/ttyACM0 --dry-run
    """
    from instrument.cli.flash import run_flash

    run_flash(port, dry_run)
