"""`pneuforce doctor`: examine a rig, and print for each check pass, warning or fail, and what to do."""

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

from pneuforce.errors import RigError
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.doctor.check import RUN_AGAIN, Check, CheckResult, unchecked
from pneuforce.instrument.doctor.circuit import circuit_checks
from pneuforce.instrument.doctor.examination import Examination, ExaminationStage
from pneuforce.instrument.doctor.port import port_checks
from pneuforce.instrument.doctor.signal import board_checks, signal_checks
from pneuforce.instrument.service.host import Host

POLL_PERIOD_S = 0.02
INTERRUPTED = "examination"  #: name of the check that is added to an interrupted examination
COLOURS = {CheckResult.PASS: "green", CheckResult.WARNING: "yellow", CheckResult.FAIL: "bold red"}
STAGE_TEXTS = {
    ExaminationStage.OBSERVING: "observing the samples",
    ExaminationStage.ZEROING: "waiting for the zero of the vented sensor",
    ExaminationStage.FILLING: "inflating",
    ExaminationStage.LEAK_TEST: "holding, to measure the leak",
    ExaminationStage.VENTING: "venting",
}


def run_doctor(port: str, inflate_kpa: float | None, as_json: bool) -> int:
    """Examine the rig at `port` and print the checks. Return the exit code.

    The exit code is 1 if a check has failed or the examination was interrupted.
    """
    logging.getLogger("pneuforce").setLevel(logging.ERROR)  # the table contains the warnings
    checks = port_checks(port)
    if any(check.result is CheckResult.FAIL for check in checks):
        checks.append(unchecked("board", "see the checks above"))
    else:
        checks += asyncio.run(_examine_rig(port, inflate_kpa))
    if as_json:
        print(json.dumps([check._asdict() for check in checks], indent=2, ensure_ascii=False))
    else:
        _print_table(checks)
        print(_conclusion(checks))
    return int(any(check.result is CheckResult.FAIL or check.name == INTERRUPTED for check in checks))


async def _examine_rig(port: str, inflate_kpa: float | None) -> list[Check]:
    """Return the checks that need the board. The rig is vented in any case."""
    stop = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    host, opened_s = Host(Session(Instrument(Settings())), port), time.monotonic()
    try:
        await host.connect(stop)
    except RigError as error:
        advice = "check power, cable, port and firmware: pneuforce flash"
        return [Check("board", CheckResult.FAIL, str(error), advice)]
    since_opened_s = time.monotonic() - opened_s
    examination = Examination(host.instrument, host.link, inflate_kpa)
    host.channels.append(examination)
    await _run_examination(host, examination, stop)
    hello = host.link.hello
    checks = board_checks(hello, since_opened_s) if hello else []
    checks += [*signal_checks(examination), *circuit_checks(examination)]
    if not examination.done:
        checks.append(unchecked(INTERRUPTED, "interrupted; vented", RUN_AGAIN))
    return checks


async def _run_examination(host: Host, examination: Examination, stop: asyncio.Event) -> None:
    """Run the host until the examination is done or `stop` is set, and print each stage on stderr."""
    task, printed = asyncio.create_task(host.run(stop)), None
    try:
        while not (examination.done or stop.is_set() or task.done()):
            if examination.stage is not printed:
                printed = examination.stage
                print(STAGE_TEXTS[printed], file=sys.stderr, flush=True)
            await asyncio.sleep(POLL_PERIOD_S)
    finally:
        stop.set()
        await task


def _print_table(checks: list[Check]) -> None:
    table = Table("check", "result", "finding", box=SIMPLE_HEAD)
    table.add_column("what to do", overflow="fold")  # paths stay complete, so that they can be copied
    for name, result, finding, advice in checks:
        cell = f"[{COLOURS.get(result, 'dim')}]{result}[/]"
        table.add_row(name, cell, _escape_markup(finding), _escape_markup(advice))
    Console(soft_wrap=not sys.stdout.isatty()).print(table)


def _conclusion(checks: list[Check]) -> str:
    failed, warnings = (
        ", ".join(check.name for check in checks if check.result is result)
        for result in (CheckResult.FAIL, CheckResult.WARNING)
    )
    if failed:
        return f"Not fit for use; failed: {failed}."
    if any(check.name == INTERRUPTED for check in checks):
        return "Interrupted: the result is incomplete."
    return f"Fit for use, with warnings: {warnings}." if warnings else "Fit for use, as far as checked."


def _escape_markup(text: str) -> str:
    """Return a text whose brackets rich does not take for markup."""
    return text.replace("[", "\\[")
