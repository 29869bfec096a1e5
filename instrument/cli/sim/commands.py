"""The commands `pneuforce sim …`: the rig simulator and its faults."""

from __future__ import annotations

import errno
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from pneuforce.instrument.cli.terminal.options import Json

commands = typer.Typer(
    name="sim",
    help="Run a simulated rig, press its balloon, and inject faults into it.",
    no_args_is_help=True,
)

DEFAULT_LINK = Path("/tmp/pneuforce-rig")


class BoardName(Enum):
    """Implementations of the board in a simulated rig."""

    PYTHON = "python"
    AVR = "avr"


ScenarioName = Annotated[
    str, typer.Option(help="Scenario to play: a name from pneuforce sim run --list, or a TOML file.")
]
Seed = Annotated[
    int | None, typer.Option(help="Seed of the noise, instead of the seed of the scenario.", min=0)
]
BoardOption = Annotated[
    BoardName,
    typer.Option("--board", help="python: board in Python; avr: firmware on an emulated ATmega328P."),
]


@commands.command()
def run(
    link: Annotated[Path, typer.Option(help="Path of the symbolic link to the serial port.")] = DEFAULT_LINK,
    control_port: Annotated[
        int, typer.Option(help="TCP port of the control server; 0 selects a free port.", min=0, max=65535)
    ] = 0,
    scenario: ScenarioName = "demo",
    hand: Annotated[
        bool, typer.Option(help="Let the simulated hand press the balloon according to the scenario.")
    ] = True,
    seed: Seed = None,
    board: BoardOption = BoardName.PYTHON,
    show: Annotated[bool, typer.Option("--list", help="List the scenarios and exit.")] = False,
    as_json: Json = False,
) -> None:
    """Run a simulated rig on a serial port (a pty) until Ctrl-C.

    Prints one JSON line with the serial port and the control port.
    The control port is also written to the file LINK.control.
    The control server reports the true values, moves the hand and injects faults.
    To connect an instrument, set port to the link in the table rig of its configuration.

    Example: pneuforce sim run --scenario demo --link /tmp/pneuforce-rig
    """
    from pneuforce.errors import RigError
    from pneuforce.instrument.cli.sim.scenarios import check_scenario, list_scenarios
    from pneuforce.sim.avr.emulator import FirmwareCrashed
    from pneuforce.sim.server.server import SimulatorOptions, serve

    if show:
        typer.echo(list_scenarios(as_json))
        return
    try:
        serve(
            SimulatorOptions(
                link=str(link),
                control_port=control_port,
                scenario=check_scenario(scenario),
                seed=seed,
                hand=hand,
                board=board.value,
            )
        )
    except OSError as error:
        raise RigError(f"the simulator cannot start: {_reason(error, control_port)}") from None
    except FirmwareCrashed as error:
        raise RigError(f"the emulated board has stopped: {error}") from None


def _reason(error: OSError, control_port: int) -> str:
    """Return why the simulator cannot start, and the option to change."""
    if error.errno == errno.EADDRINUSE:
        return f"--control-port {control_port} is in use by another program"
    if error.filename:
        return f"{error.filename2 or error.filename}: {error.strerror}; choose another --link"
    return str(error)


Link = Annotated[Path, typer.Option(help="Link to the serial port of the simulator.")]
ControlPort = Annotated[
    int | None,
    typer.Option(
        "--control-port",
        "--control",
        help="Control port of the simulator, instead of the link.",
        min=1,
        max=65535,
    ),
]


@commands.command()
def press(
    force_n: Annotated[
        float | None, typer.Argument(help="Force in N.", metavar="FORCE", min=0.0, max=20.0)
    ] = None,
    release: Annotated[bool, typer.Option("--release", help="End the contact.")] = False,
    seconds: Annotated[
        float | None, typer.Option(help="Release after this time, in s, or at Ctrl-C.", min=0.0)
    ] = None,
    link: Link = DEFAULT_LINK,
    control_port: ControlPort = None,
    as_json: Json = False,
) -> None:
    """Press the balloon of a running simulator with a constant force until --release.

    The instrument measures a force only if the balloon was held before the contact.
    pneuforce press and pneuforce sim press are the same command.
    For the rig of make run, give the --control-port that the demo prints.

    Example: pneuforce sim press 2.0 --seconds 3
    """
    from pneuforce.instrument.cli.sim import press as simulated_press
    from pneuforce.instrument.cli.sim.fault import control_port_of

    simulated_press.press(control_port or control_port_of(link), force_n, release, seconds, as_json)


class HandState(Enum):
    """States of the simulated hand."""

    ON = "on"
    OFF = "off"


@commands.command()
def hand(
    state: Annotated[HandState, typer.Argument(help="off: no contacts; on: the contacts of the scenario.")],
    link: Link = DEFAULT_LINK,
    control_port: ControlPort = None,
    as_json: Json = False,
) -> None:
    """Stop the contacts of the scenario in a running simulator, or continue with them.

    For the rig of make run, give the --control-port that the demo prints.

    Example: pneuforce sim hand off
    """
    from pneuforce.instrument.cli.sim.fault import control_port_of
    from pneuforce.instrument.cli.sim.hand import play_scenario

    play_scenario(control_port or control_port_of(link), state is HandState.ON, as_json)


@commands.command()
def truth(
    seconds: Annotated[
        float | None, typer.Option(help="Duration in s; by default until Ctrl-C.", min=0.0)
    ] = None,
    every: Annotated[
        int,
        typer.Option(help="Print every n-th sample; the rig sends 500 samples per second.", min=1, max=500),
    ] = 5,
    link: Link = DEFAULT_LINK,
    control_port: ControlPort = None,
    as_json: Json = False,
) -> None:
    """Print the true values of a running simulator as CSV, or with --json as one object per line.

    The column force_n is the force that a perfect reference sensor would measure.
    The file can therefore be the --reference of calibrate contacts, evaluate, export and plot,
    with --time-column utc_s.

    Example: pneuforce sim truth --seconds 60 > cell.csv
    """
    from pneuforce.instrument.cli.sim.fault import control_port_of
    from pneuforce.instrument.cli.sim.truth import print_truth

    print_truth(control_port or control_port_of(link), every, seconds, as_json)


def _fault_names(begin: str) -> list[str]:
    """Return the names of the faults for the completion in a shell."""
    from pneuforce.sim.faults import CATALOGUE

    return [name for name in CATALOGUE if name.startswith(begin)]


@commands.command()
def fault(
    name: Annotated[
        str | None,
        typer.Argument(
            help="Name of the fault; without a name, the active faults are listed.",
            autocompletion=_fault_names,
        ),
    ] = None,
    arguments: Annotated[
        list[str] | None,
        typer.Argument(help="Size of the fault, for example kpa_per_s=0.02.", metavar="ARGUMENT=NUMBER"),
    ] = None,
    off: Annotated[bool, typer.Option("--off", help="Remove the fault.")] = False,
    link: Link = DEFAULT_LINK,
    control_port: ControlPort = None,
    show: Annotated[bool, typer.Option("--list", help="List all faults and exit.")] = False,
    as_json: Json = False,
) -> None:
    """Inject a fault into a running simulator, or remove the fault.

    Prints the faults that are active afterwards.

    Example: pneuforce sim fault leak kpa_per_s=0.05
    """
    from pneuforce.instrument.cli.sim.fault import change_faults, control_port_of, show_catalogue

    if show:
        show_catalogue(as_json)
    else:
        port = control_port or control_port_of(link)
        typer.echo(change_faults(port, name, arguments or [], off, as_json))
