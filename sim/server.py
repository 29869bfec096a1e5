"""The simulated rig in real time, at the end of a pty, with its control server."""

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

from sim.cable import Cable
from sim.control import Control
from sim.remote import beside
from sim.rig import STEP_S
from sim.scenario import load
from sim.staging import world_of
from sim.world import World

#: Samples that were missed while the process slept are made up for, but no more than this.
LONGEST_LAG_S = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What a simulated rig is started with."""

    link: str = ""  #: where a symlink to the port is made; empty for none
    control_port: int = 0  #: 0 for a free one
    scenario: str = "demo"  #: name of one of the library, or a file
    seed: int | None = None  #: instead of the scenario's
    hand: bool = True  #: whether the simulated hand presses the balloon
    board: str = "python"  #: one of `sim.staging.BOARDS`


def serve(options: Options) -> None:
    """Run until SIGTERM or SIGINT. Prints one JSON line: port, link, control.

    The control port also stands in a file beside the link.
    Raises OSError where the link, the control port or the board cannot be had, ScenarioError.
    """
    ended = _ending()
    scenario = load(options.scenario)
    if options.seed is not None:
        scenario = scenario.model_copy(update={"seed": options.seed})
    world = world_of(scenario, options.hand, progress=_reckoning, board=options.board)
    link = Path(options.link) if options.link else None
    with (
        closing(Control(options.control_port, world)) as control,
        _told_beside(link, control.port),
        closing(Cable(link)) as cable,
    ):
        print(json.dumps({"port": cable.port, "link": options.link, "control": control.port}), flush=True)
        _run(world, cable, control, ended)


@contextmanager
def _told_beside(link: Path | None, port: int) -> Iterator[None]:
    """While it runs, the control port stands in a file beside the link, for whoever knows the link only.

    The file is locked, which ends with the process: raises FileExistsError where another has the link.
    """
    if link is None:
        yield
        return
    with _locked(link) as file:
        file.truncate(0)
        file.write(f"{port}\n")
        file.flush()
        try:
            yield
        finally:
            if _stands(file, beside(link)):
                beside(link).unlink()


def _locked(link: Path) -> TextIO:
    """The file beside the link, ours alone."""
    while True:
        file = beside(link).open("a+")
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            with file:
                file.seek(0)
                raise FileExistsError(
                    f"{link} is in use by a running simulator (control port {file.read().strip()}): "
                    "end it, or name another --link"
                ) from None
        if _stands(file, beside(link)):
            return file
        file.close()  # whoever had it ended meanwhile, and took it away


def _stands(file: TextIO, path: Path) -> bool:
    """Whether an open file still is the one of that name."""
    with suppress(OSError):
        return os.path.samestat(os.fstat(file.fileno()), path.stat())
    return False


def _reckoning(done: int, total: int) -> None:
    print(f"reckoning the rubber balloon, once: {done / total:.0%}", file=sys.stderr, flush=True)


def _ending() -> Callable[[], bool]:
    """Whether a signal has asked to end."""
    asked: list[int] = []
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda number, _: asked.append(number))
    return lambda: bool(asked)


def _run(world: World, cable: Cable, control: Control, ended: Callable[[], bool]) -> None:
    """One step each 2 ms of the monotonic clock. Bytes and requests wait for the next step."""
    due_s = time.monotonic() + STEP_S
    while not ended():
        wait_s = due_s - time.monotonic()
        if wait_s > 0:
            time.sleep(wait_s)
        elif wait_s < -LONGEST_LAG_S:
            due_s -= wait_s + LONGEST_LAG_S
        readable, _, _ = select.select(control.filenos(), [], [], 0)
        control.serve(readable)
        _follow(cable, world.line.pulled)
        cable.write(world.step(cable.read()))
        control.publish()
        due_s += STEP_S


def _follow(cable: Cable, pulled: bool) -> None:
    """Pull the plug or put it in, as the line says."""
    if pulled and cable.plugged:
        cable.pull()
    elif not (pulled or cable.plugged):
        cable.plug()
