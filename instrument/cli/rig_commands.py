"""The commands for a rig at the end of a cable, without an instrument around it."""

from __future__ import annotations

from typing import Annotated

import typer

from instrument.cli.options import Json

commands = typer.Typer()

_DEVICE = "The board's device, as /dev/serial/by-id/…"


@commands.command()
def doctor(
    port: Annotated[str, typer.Option("--port", help=f"{_DEVICE}; or a simulator's link.")],
    inflate: Annotated[
        float | None,
        typer.Option(
            min=2.0, max=12.0, help="Test ramp, leak and vent at this many kPa: it inflates the balloon!"
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Examine a rig: port, board, samples, clock, sensor, supply; with --inflate the circuit too.

    Ends venting, also at Ctrl-C. Exit code 1: a check is bad, or it was interrupted.
    Nobody may touch the balloon meanwhile: start a simulator with --no-hand.

    Example: pneuforce doctor --port /dev/ttyACM0 --inflate 5.0
    """
    from instrument.cli.doctor import run_doctor

    raise typer.Exit(run_doctor(port, inflate, as_json))


@commands.command()
def flash(
    port: Annotated[str, typer.Option("--port", help=f"{_DEVICE}.")],
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only print what would be run.")] = False,
    as_json: Json = False,
) -> None:
    """Put the firmware on an Arduino UNO with avrdude; another chip, or a port in use, is refused.

    Example: pneuforce flash --port /dev/ttyACM0 --dry-run
    """
    from instrument.cli.flash import run_flash

    run_flash(port, dry_run, as_json)
