"""Examination of a rig by a host: all checks that need the board."""

from __future__ import annotations

import asyncio
import signal
import time
from collections.abc import Callable

from pneuforce.errors import RigError
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.doctor.check import RUN_AGAIN, Check, CheckResult, unchecked
from pneuforce.instrument.doctor.circuit import circuit_checks
from pneuforce.instrument.doctor.examination import Examination, ExaminationStage
from pneuforce.instrument.doctor.signal import board_checks, inflation_obstacle, signal_checks
from pneuforce.instrument.service.host.host import Host

POLL_PERIOD_S = 0.02
INTERRUPTED = "examination"  #: name of the check that is added to an interrupted examination


async def examine_rig(
    port: str, inflate_kpa: float | None, on_stage: Callable[[ExaminationStage], None]
) -> list[Check]:
    """Return the checks that need the board. At the end, the rig is always vented.

    `on_stage` is called at the start of each stage. SIGINT, SIGTERM and SIGHUP interrupt the examination.
    """
    stop = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    host, opened_s = Host(Session(Instrument(Settings())), port), time.monotonic()
    try:
        await host.connect(stop)
    except RigError as error:
        advice = "check power, cable, port and firmware: pneuforce flash"
        return [Check("board", CheckResult.FAIL, str(error), advice)]
    since_opened_s, firmware = time.monotonic() - opened_s, host.link.firmware
    examination = Examination(host.instrument, host.link, inflation_obstacle, inflate_kpa)
    host.channels.append(examination)
    await _run(host, examination, stop, on_stage)
    hello = host.link.hello
    checks = board_checks(hello, firmware, since_opened_s) if hello and firmware else []
    checks += [*signal_checks(examination), *circuit_checks(examination)]
    if not examination.done:
        vent = "vented" if host.vent_verified else "the vent is not verified: look at the balloon"
        checks.append(unchecked(INTERRUPTED, f"interrupted; {vent}", RUN_AGAIN))
    return checks


async def _run(
    host: Host, examination: Examination, stop: asyncio.Event, on_stage: Callable[[ExaminationStage], None]
) -> None:
    """Run the host until the examination is done or `stop` is set."""
    task, reported = asyncio.create_task(host.run(stop)), None
    try:
        while not (examination.done or stop.is_set() or task.done()):
            if examination.stage is not reported:
                reported = examination.stage
                on_stage(reported)
            await asyncio.sleep(POLL_PERIOD_S)
    finally:
        stop.set()
        await task
