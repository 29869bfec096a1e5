"""The commands and their help. Each imports what it needs when it runs, so that none waits for another's."""

from __future__ import annotations

import errno
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from instrument.cli import (
    calibrate_commands,
    can_commands,
    event_commands,
    files,
    force_commands,
    rig_commands,
    tape_commands,
    watch_command,
)
from instrument.cli.options import Json, Seconds

app = typer.Typer(
    name="pneuforce",
    help="A pneumatic force sensor as a field instrument: force over Modbus and CAN, with its uncertainty.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
)
app.add_typer(force_commands.commands)
app.add_typer(rig_commands.commands)
app.add_typer(watch_command.commands)
app.add_typer(can_commands.commands)
app.add_typer(tape_commands.commands)
app.add_typer(calibrate_commands.commands, name="calibrate")
app.add_typer(event_commands.commands, name="log")
app.add_typer(files.commands)

LINK = Path("/tmp/pneuforce-rig")


def _say_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"pneuforce {version('pneuforce')}")
        raise typer.Exit


@app.callback()
def _pneuforce(
    version: Annotated[
        bool,
        typer.Option("--version", help="Say which version this is.", callback=_say_version, is_eager=True),
    ] = False,
) -> None:
    pass


class MapFormat(Enum):
    """The documents made from the register map: pages, tables, and code for PLC and C programs."""

    MD = "md"
    FAULTS = "faults"
    CSV = "csv"
    JSON = "json"
    DBC = "dbc"
    EDS = "eds"
    OBJECTS = "objects"
    ST = "st"
    H = "h"


class BoardName(Enum):
    """The boards that a simulated rig can have."""

    PYTHON = "python"
    AVR = "avr"


ScenarioName = Annotated[
    str, typer.Option(help="What happens: a name of pneuforce sim --list, or a TOML file.")
]
Seed = Annotated[int | None, typer.Option(help="Seed of the noise, instead of the scenario's.", min=0)]
BoardOption = Annotated[
    BoardName, typer.Option("--board", help="The board in Python, or the firmware on an emulated ATmega328P.")
]


@app.command()
def demo(
    seconds: Seconds = None,
    modbus_port: Annotated[int, typer.Option(help="TCP port of the Modbus server.", min=1, max=65535)] = 5020,
    can_port: Annotated[
        int, typer.Option(help="TCP port of the CAN hub (socketcand protocol).", min=1, max=65535)
    ] = 29536,
    control_port: Annotated[
        int, typer.Option(help="TCP port for truth, hand and faults; 0 takes a free one.", min=0, max=65535)
    ] = 0,
    page_port: Annotated[
        int, typer.Option(help="TCP port of the page in the browser; 0 takes a free one.", min=0, max=65535)
    ] = 8080,
    scenario: ScenarioName = "demo",
    seed: Seed = None,
    board: BoardOption = BoardName.PYTHON,
) -> None:
    """The whole instrument on a simulated rig: contacts, live panel, page, Modbus and CAN to try out.

    Starts the rig simulator, a CAN hub and the instrument as processes of their own, inflates the balloon and
    lets a simulated hand press it again and again. What the panel shows is read back over Modbus and CAN.
    """
    from secrets import token_urlsafe

    from instrument.cli.demo import refuse_taken, run_demo
    from instrument.cli.panel import Ports
    from instrument.cli.scenarios import checked
    from teststand.stack import free_port

    rig = ["--control-port", str(control_port), "--scenario", checked(scenario), "--board", board.value]
    rig += [] if seed is None else ["--seed", str(seed)]
    taken = {"modbus-port": modbus_port, "can-port": can_port, "control-port": control_port}
    refuse_taken({**taken, "page-port": page_port})
    ports = Ports(modbus_port, can_port, page_port or free_port(), token_urlsafe(12))
    raise typer.Exit(run_demo(seconds, ports, rig))


@app.command()
def run(
    config: Annotated[Path, typer.Option("--config", help="The instrument.toml; see pneuforce config.")],
    record: Annotated[
        Path | None, typer.Option(help="Record everything from the start into this new file.")
    ] = None,
) -> None:
    """Run the instrument on a real port and real buses until Ctrl-C or SIGTERM; then vent and end."""
    from instrument.cli.serve import Files, serve
    from instrument.config import beside, load
    from instrument.errors import ConfigurationError

    configuration = load(config)
    if record and not configuration.local.socket:
        raise ConfigurationError("--record goes through the local socket, and local.socket is empty")
    serve(
        configuration,
        Files(
            events=beside(config, configuration.events.file),
            socket=beside(config, configuration.local.socket),
            recording=record,
        ),
    )


@app.command()
def sim(
    link: Annotated[Path, typer.Option(help="Where to put a link to the serial port.")] = LINK,
    control_port: Annotated[
        int, typer.Option(help="TCP port for truth and the hand; 0 takes a free one.")
    ] = 0,
    scenario: ScenarioName = "demo",
    hand: Annotated[bool, typer.Option(help="Let the simulated hand play the scenario.")] = True,
    seed: Seed = None,
    board: BoardOption = BoardName.PYTHON,
    show: Annotated[bool, typer.Option("--list", help="Say which scenarios there are.")] = False,
    as_json: Json = False,
) -> None:
    """Run the rig simulator alone: a board on a serial port (a pty), its truth on a control port.

    Prints one JSON line that names both; the control port also stands in the file LINK.control.
    An instrument connects with port = the link, in the table rig of its configuration.
    """
    from instrument.cli.scenarios import checked, listed
    from instrument.errors import RigError
    from sim.avr.emulator import Crashed
    from sim.server import Options, serve

    if show:
        typer.echo(listed(as_json))
        return
    try:
        serve(
            Options(
                link=str(link),
                control_port=control_port,
                scenario=checked(scenario),
                seed=seed,
                hand=hand,
                board=board.value,
            )
        )
    except OSError as error:
        busy = error.errno == errno.EADDRINUSE
        why = f"--control-port {control_port} is in use by another program" if busy else error
        raise RigError(f"the simulator cannot start: {why}") from None
    except Crashed as error:
        raise RigError(f"the emulated board has stopped: {error}") from None


@app.command()
def fault(
    name: Annotated[str | None, typer.Argument(help="The fault; without one, those that are in.")] = None,
    arguments: Annotated[
        list[str] | None, typer.Argument(help="How much of it, as kpa_per_s=0.02.", metavar="ARGUMENT=NUMBER")
    ] = None,
    off: Annotated[bool, typer.Option("--off", help="Take the fault out.")] = False,
    link: Annotated[Path, typer.Option(help="Which simulator: the link to its serial port.")] = LINK,
    control: Annotated[
        int | None, typer.Option(help="Which simulator: its control port, as printed.", min=1, max=65535)
    ] = None,
    show: Annotated[bool, typer.Option("--list", help="Say which faults there are.")] = False,
    as_json: Json = False,
) -> None:
    """Put a fault into a running simulator, or take it out.

    Example: pneuforce fault leak kpa_per_s=0.05
    """
    from instrument.cli.fault import control_beside, inject, show_catalogue

    if show:
        show_catalogue(as_json)
    else:
        port = control or control_beside(link)
        typer.echo(inject(port, name, arguments or [], off, as_json))


@app.command("map")
def map_(
    form: Annotated[MapFormat, typer.Option("--format", help="Document to print.")] = MapFormat.MD,
    node_id: Annotated[int, typer.Option(help="DBC only: node id of the instrument.", min=1, max=127)] = 5,
) -> None:
    """Print the register map and the CAN frames from their one declaration.

    Example: pneuforce map --format dbc > pneuforce.dbc
    """
    from registers.views import VIEWS, dbc

    text = dbc.render(node_id) if form is MapFormat.DBC else VIEWS[form.value].render()
    typer.echo(text, nl=False)


@app.command()
def config(
    example: Annotated[
        bool, typer.Option("--example", help="Print every key with meaning and span.")
    ] = False,
    check: Annotated[
        Path | None, typer.Option("--check", help="Say whether this file is acceptable.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Document or check an instrument.toml.

    Example: pneuforce config --example > instrument.toml
    """
    from instrument.cli.config_check import check_config
    from instrument.config import example as example_text
    from instrument.errors import ConfigurationError

    if as_json and check is None:
        raise ConfigurationError("--json is for --check: an example is TOML")
    if example or check is None:
        typer.echo(example_text(), nl=False)
    if check is not None:
        raise typer.Exit(check_config(check, as_json))
