"""Simulated rig in real time, with a pseudo-terminal as serial port and a control server."""

from __future__ import annotations

import fcntl
import json
import os
import select
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from pneuforce.sim.factory import build_world
from pneuforce.sim.line.pty_link import PtyLink
from pneuforce.sim.rig import STEP_S
from pneuforce.sim.scenario import load
from pneuforce.sim.server.client import control_port_file
from pneuforce.sim.server.control_server import ControlServer
from pneuforce.sim.world import World

#: Longest delay that the simulation makes up by additional steps [s]. The rest of a longer delay is ignored.
MAX_LAG_S = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatorOptions:
    """Options of a simulated rig."""

    link: str = ""  #: path of the symlink to the serial port; empty: no symlink
    control_port: int = 0  #: TCP port of the control server; 0 selects a free port
    scenario: str = "demo"  #: name of a scenario of the library, or path of a TOML file
    seed: int | None = None  #: seed that replaces the seed of the scenario
    hand: bool = True  #: if False, the simulated hand presses on request only
    board: str = "python"  #: a key of `pneuforce.sim.factory.BOARDS`


def serve(options: SimulatorOptions) -> None:
    """Run the simulator until SIGTERM or SIGINT. Print one JSON line with the keys port, link and control.

    The control port is also written to a file next to the link. Raises OSError if the link, the control port
    or the board is unavailable, and ScenarioError if the scenario is invalid.
    """
    stop_requested = _catch_signals()
    scenario = load(options.scenario)
    if options.seed is not None:
        scenario = scenario.model_copy(update={"seed": options.seed})
    world = build_world(scenario, options.hand, progress=_print_progress, board=options.board)
    link = Path(options.link) if options.link else None
    with (
        closing(ControlServer(options.control_port, world)) as control,
        _port_file(link, control.port),
        closing(PtyLink(link)) as cable,
    ):
        print(json.dumps({"port": cable.port, "link": options.link, "control": control.port}), flush=True)
        _run(world, cable, control, stop_requested)


@contextmanager
def _port_file(link: Path | None, port: int) -> Iterator[None]:
    """Keep the control port in a file next to the link, for clients that have only the path of the link.

    The file is locked until the process ends. Raises FileExistsError if another simulator uses the link.
    """
    if link is None:
        yield
        return
    with _lock_port_file(link) as file:
        file.truncate(0)
        file.write(f"{port}\n")
        file.flush()
        try:
            yield
        finally:
            if _is_at(file, control_port_file(link)):
                control_port_file(link).unlink()


def _lock_port_file(link: Path) -> TextIO:
    """Open and lock the file of the control port, which is next to the link."""
    while True:
        file = control_port_file(link).open("a+")
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            with file:
                file.seek(0)
                raise FileExistsError(
                    f"{link} is in use by a running simulator (control port {file.read().strip()}): "
                    "end that simulator, or choose another --link"
                ) from None
        if _is_at(file, control_port_file(link)):
            return file
        file.close()  # another simulator has ended between open and flock, and has removed the file


def _is_at(file: TextIO, path: Path) -> bool:
    """Return True if an open file is still the file at `path`."""
    with suppress(OSError):
        return os.path.samestat(os.fstat(file.fileno()), path.stat())
    return False


def _print_progress(done: int, total: int) -> None:
    print(f"computing the rubber balloon (once): {done / total:.0%}", file=sys.stderr, flush=True)


def _catch_signals() -> Callable[[], bool]:
    """Catch SIGTERM and SIGINT. Return a function that returns True after one of these signals."""
    received: list[int] = []
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda number, _: received.append(number))
    return lambda: bool(received)


def _run(world: World, cable: PtyLink, control: ControlServer, stop_requested: Callable[[], bool]) -> None:
    """Advance the simulation every 2 ms. Received bytes and requests are processed at the next step."""
    due_s = time.monotonic() + STEP_S
    while not stop_requested():
        wait_s = due_s - time.monotonic()
        if wait_s > 0:
            time.sleep(wait_s)
        elif wait_s < -MAX_LAG_S:
            due_s -= wait_s + MAX_LAG_S
        readable, _, _ = select.select(control.filenos(), [], [], 0)
        control.serve(readable)
        _plug_or_unplug(cable, world.line.unplugged)
        cable.write(world.step(cable.read()))
        control.publish()
        due_s += STEP_S


def _plug_or_unplug(cable: PtyLink, unplugged: bool) -> None:
    """Unplug the cable if a fault requires that, and plug the cable in after the fault."""
    if unplugged and cable.plugged:
        cable.unplug()
    elif not (unplugged or cable.plugged):
        cable.plug()
