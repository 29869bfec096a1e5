"""`pneuforce doctor`: examine a rig, and print the result and the recommended action of each check."""

from __future__ import annotations

import asyncio
import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.text import Text

from pneuforce.instrument.cli.terminal.failure import checked_values
from pneuforce.instrument.cli.terminal.output import json_line, print_text
from pneuforce.instrument.commissioning.rig_examination import INTERRUPTED, examine_rig
from pneuforce.instrument.doctor.check import RUN_AGAIN, Check, CheckResult, unchecked
from pneuforce.instrument.doctor.examination import ExaminationStage
from pneuforce.instrument.doctor.port import port_checks
from pneuforce.support.printable import printable

COLOURS = {CheckResult.PASS: "green", CheckResult.WARNING: "yellow", CheckResult.FAIL: "bold red"}
STAGE_TEXTS = {
    ExaminationStage.CLEARING: "reading the latched faults",
    ExaminationStage.OBSERVING: "observing the samples",
    ExaminationStage.ZEROING: "waiting for the zero of the vented sensor",
    ExaminationStage.FILLING: "inflating",
    ExaminationStage.LEAK_TEST: "holding, to measure the leak",
    ExaminationStage.VENTING: "venting",
}


def run_doctor(port: str, inflate_kpa: float | None, as_json: bool) -> int:
    """Examine the rig at `port` and print the checks. Return the exit code.

    The exit code is 1 if a check has failed, the examination was interrupted, or `inflate_kpa` is given and a
    check was not possible.
    """
    with _without_warnings():
        checks = port_checks(port)
        if any(check.result is CheckResult.FAIL for check in checks):
            checks.append(
                unchecked("board", "not opened", f"follow the advice of the failed checks, then {RUN_AGAIN}")
            )
        else:
            checks += asyncio.run(examine_rig(port, inflate_kpa, _ignore_stage if as_json else _print_stage))
    bad_results = {CheckResult.FAIL} | ({CheckResult.NOT_CHECKED} if inflate_kpa is not None else set())
    failed = any(check.result in bad_results or check.name == INTERRUPTED for check in checks)
    if as_json:
        values = checked_values(not failed, _conclusion(checks))
        print_text(json_line(values | {"checks": [check._asdict() for check in checks]}))
    else:
        print_checks(checks)
        print(_conclusion(checks))
    return int(failed)


@contextmanager
def _without_warnings() -> Iterator[None]:
    """Log only errors in a with block, because the table contains the warnings."""
    logger = logging.getLogger("pneuforce")
    before = logger.level
    logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        logger.setLevel(before)


def _print_stage(stage: ExaminationStage) -> None:
    print(STAGE_TEXTS[stage], file=sys.stderr, flush=True)


def _ignore_stage(stage: ExaminationStage) -> None:
    """Print nothing, because a program reads the result."""


def print_checks(checks: list[Check]) -> None:
    """Print each check in one line, and its advice in the next line.

    The lines are not divided at the width of the terminal, so that a path in them can be copied.
    """
    console = Console(soft_wrap=True, highlight=False)
    name_width, result_width = (max(map(len, column)) for column in list(zip(*checks, strict=True))[:2])
    for name, result, finding, advice in checks:
        line = Text(f"{name:<{name_width}}  ")
        line.append(f"{result:<{result_width}}", style=COLOURS.get(result, "dim"))
        line.append(f"  {printable(finding)}")
        console.print(line)
        if advice:
            console.print(Text(f"{'':<{name_width}}  what to do: {printable(advice)}"))


def _conclusion(checks: list[Check]) -> str:
    """Return the result of the whole examination. The rig is fit for use only if no check is open."""
    names = {
        result: ", ".join(check.name for check in checks if check.result is result) for result in CheckResult
    }
    if names[CheckResult.FAIL]:
        return f"Not fit for use; failed: {names[CheckResult.FAIL]}."
    if any(check.name == INTERRUPTED for check in checks):
        return "Interrupted: the result is incomplete."
    open_results = (CheckResult.NOT_CHECKED, CheckResult.WARNING)
    open_checks = [f"{result.value}: {names[result]}" for result in open_results if names[result]]
    if open_checks:
        return f"No check failed, but the rig is not yet shown to be fit for use; {'; '.join(open_checks)}."
    return "Fit for use: all checks passed."
