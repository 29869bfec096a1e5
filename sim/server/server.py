"""Simulated rig in real time, with a pseudo-terminal as serial port and a control server."""

from __future__ import annotations

import json
import signal
import sys
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from pneuforce.sim.factory import build_world
from pneuforce.sim.line.pty_link import PtyLink
from pneuforce.sim.rig import STEP_S
from pneuforce.sim.scenario import load
from pneuforce.sim.server.control_server import ControlServer
from pneuforce.sim.server.port_file import port_file
from pneuforce.sim.world import World
from pneuforce.support.readiness import readable

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
        port_file(link, control.port),
        closing(PtyLink(link)) as cable,
    ):
        print(json.dumps({"port": cable.port, "link": options.link, "control": control.port}), flush=True)
        _run(world, cable, control, stop_requested)


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
        control.serve(readable(control.filenos(), 0))
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
