"""`pneuforce doctor`: examine a rig, and say what is good, doubtful or bad, and what to do."""

from __future__ import annotations

import asyncio
import json
import logging
import signal
import sys
import time

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from instrument.core import Instrument
from instrument.coupling import Coupling
from instrument.doctor.check import AGAIN, Check, Verdict, unchecked
from instrument.doctor.circuit import circuit_checks
from instrument.doctor.examination import Examination, Stage
from instrument.doctor.port import port_checks
from instrument.doctor.signal import board_checks, signal_checks
from instrument.errors import RigError
from instrument.host import Host
from instrument.settings import Settings

LOOK_S = 0.02
ENDED_EARLY = "examination"
COLOURS = {Verdict.GOOD: "green", Verdict.DOUBTFUL: "yellow", Verdict.BAD: "bold red"}
SAID = {
    Stage.LISTENING: "listening",
    Stage.ZEROING: "waiting for the zero of the vented sensor",
    Stage.FILLING: "inflating",
    Stage.LEAKING: "holding, to see whether it leaks",
    Stage.VENTING: "venting",
}


def run_doctor(port: str, inflate_kpa: float | None, as_json: bool) -> int:
    """Examine the rig at `port` and print the checks; exit code 1 where one of them is bad."""
    logging.getLogger("pneuforce").setLevel(logging.ERROR)  # what it would warn of stands in the table
    checks = port_checks(port)
    if any(check.verdict is Verdict.BAD for check in checks):
        checks.append(unchecked("board", "see the checks above"))
    else:
        checks += asyncio.run(_of_the_rig(port, inflate_kpa))
    if as_json:
        print(json.dumps([check._asdict() for check in checks], indent=2, ensure_ascii=False))
    else:
        _show(checks)
        print(_conclusion(checks))
    return int(any(check.verdict is Verdict.BAD or check.name == ENDED_EARLY for check in checks))


async def _of_the_rig(port: str, inflate_kpa: float | None) -> list[Check]:
    """The checks that need the board. However they end, the balloon is vented."""
    stop = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    host, opened_s = Host(Coupling(Instrument(Settings())), port), time.monotonic()
    try:
        await host.connect(stop)
    except RigError as error:
        return [Check("board", Verdict.BAD, str(error), "power, cable, port, firmware: pneuforce flash")]
    since_opened_s = time.monotonic() - opened_s
    examination = Examination(host.instrument, host.link, inflate_kpa)
    host.faces.append(examination)
    await _examine(host, examination, stop)
    hello = host.link.hello
    greeted = board_checks(hello, since_opened_s) if hello else []
    return [*greeted, *signal_checks(examination), *circuit_checks(examination), *_end(examination)]


def _end(examination: Examination) -> list[Check]:
    """That it was interrupted, where it was."""
    return [] if examination.done else [unchecked(ENDED_EARLY, "interrupted; vented", AGAIN)]


async def _examine(host: Host, examination: Examination, stop: asyncio.Event) -> None:
    working, told = asyncio.create_task(host.run(stop)), None
    try:
        while not (examination.done or stop.is_set() or working.done()):
            if examination.stage is not told:
                told = examination.stage
                print(SAID[told], file=sys.stderr, flush=True)
            await asyncio.sleep(LOOK_S)
    finally:
        stop.set()
        await working


def _show(checks: list[Check]) -> None:
    table = Table("check", "verdict", "found", box=SIMPLE_HEAD)
    table.add_column("what to do", overflow="fold")  # paths are to be copied whole
    for name, verdict, found, advice in checks:
        table.add_row(name, f"[{COLOURS.get(verdict, 'dim')}]{verdict}[/]", _plain(found), _plain(advice))
    Console(soft_wrap=not sys.stdout.isatty()).print(table)


def _conclusion(checks: list[Check]) -> str:
    bad, doubtful = (
        ", ".join(check.name for check in checks if check.verdict is verdict)
        for verdict in (Verdict.BAD, Verdict.DOUBTFUL)
    )
    if bad:
        return f"Not fit for use; bad: {bad}."
    if any(check.name == ENDED_EARLY for check in checks):
        return "Interrupted: whether it is fit for use is not known."
    return f"Fit for use, with doubts about: {doubtful}." if doubtful else "Fit for use, in what was checked."


def _plain(text: str) -> str:
    """Text in which a bracket is one, not rich's markup."""
    return text.replace("[", "\\[")
