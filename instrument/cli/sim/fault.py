"""`pneuforce sim fault`: inject a fault into a running simulator, remove it, or list the faults."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from pneuforce.errors import ConfigurationError, RigError
from pneuforce.instrument.cli.terminal.output import done_json, print_text
from pneuforce.sim.faults import CATALOGUE
from pneuforce.sim.faults.document import format_arguments, format_response
from pneuforce.sim.faults.kind import FaultKind, format_active
from pneuforce.sim.server.client import SimulatorClient
from pneuforce.support.atomic_file import read_file
from pneuforce.support.counted import counted
from pneuforce.support.printable import printable
from pneuforce.support.simulator_link import control_port_file, is_left_behind

MAX_PORT = 65535


def show_catalogue(as_json: bool) -> None:
    """Print every fault with its description, its arguments and the expected response."""
    if as_json:
        faults = [_facts(kind) for kind in CATALOGUE.values()]
        print_text(done_json(counted(len(faults), "fault"), faults=faults))
        return
    table = Table("name", "what happens", "arguments: default (range)", "response", box=SIMPLE_HEAD)
    table.columns[0].no_wrap = True  # a name must be typed
    for column in table.columns[1:]:
        column.overflow = "fold"
    for kind in CATALOGUE.values():
        table.add_row(kind.name, kind.description, format_arguments(kind), format_response(kind))
    Console().print(table)


def change_faults(control_port: int, name: str | None, pairs: Sequence[str], off: bool, as_json: bool) -> str:
    """Inject the named fault, or remove it if `off` is True. Return the active faults as text or JSON.

    Without a name, nothing is changed. Raises ConfigurationError for invalid options, SimulatorRequestError
    if the simulator rejects the request, SimulatorNotResponding if no simulator answers.
    """
    arguments = parse_arguments(pairs)
    if off and (name is None or arguments):
        raise ConfigurationError(
            "--off takes the name of one fault and no arguments, for example: pneuforce sim fault leak --off"
        )
    simulator = SimulatorClient(control_port)
    if name is not None:
        simulator.request(fault={"name": name, "on": not off, **arguments})
    active = simulator.faults()
    lines = [format_active(**fault) for fault in active] or ["no fault is active"]
    return done_json("; ".join(lines), active=active) if as_json else "\n".join(map(printable, lines))


def control_port_of(link: Path) -> int:
    """Return the control port of the simulator whose serial port is at `link`. Raises RigError."""
    try:
        port = int(read_file(control_port_file(link)).decode("ascii"))
    except ValueError:  # ConfigurationError of `read_file` is a subclass
        port = 0
    if not 1 <= port <= MAX_PORT or is_left_behind(link):
        raise RigError(
            f"no simulator has its port at {link}: start pneuforce sim run, or give --link or --control-port "
            "PORT (make run and pneuforce demo print the control port)"
        )
    return port


def _facts(kind: FaultKind) -> dict[str, Any]:
    return {
        "name": kind.name,
        "what": kind.description,
        "rule": kind.expected,
        "where": kind.phase,
        "arguments": [argument._asdict() for argument in kind.arguments],
        "answer": format_response(kind),
    }


def parse_arguments(pairs: Iterable[str]) -> dict[str, float]:
    """Return the arguments of a fault from texts `name=number`. Raises ConfigurationError."""
    arguments: dict[str, float] = {}
    for pair in pairs:
        name, _, text = pair.partition("=")
        try:
            arguments[name.replace("-", "_")] = float(text)
        except ValueError:
            raise ConfigurationError(
                f"{pair}: an argument has the form name=number, for example kpa_per_s=0.02"
            ) from None
    return arguments
