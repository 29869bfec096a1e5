"""`pneuforce demo`: simulator, CAN hub and instrument as processes, observed over Modbus and CAN."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from textwrap import wrap
from threading import Event
from typing import Any

from rich.live import Live

from pneuforce.instrument.cli.panel import DEMO_USER, MAX_EVENTS, DemoPorts, format_line, panel
from pneuforce.instrument.cli.terminal.stop_signals import at_stop_signal
from pneuforce.instrument.users.file import User, write_users
from pneuforce.instrument.users.password import hash_password
from pneuforce.registers.can.bus import CanAddress
from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.teststand.child_process import StartCancelled
from pneuforce.teststand.demo_sequence import DemoSequence
from pneuforce.teststand.observer import CanNodeAddress, ObservedValues, Observer, value_or_nan
from pneuforce.teststand.stack import Stack, start

PANEL_HZ = 5
REPORT_WIDTH = 76  #: width of the panel without its frame [characters]


def run_demo(seconds: float | None, ports: DemoPorts, simulator_options: Sequence[str]) -> int:
    """Run the demo until `seconds` have passed or a stop signal is received. Return the exit code.

    `simulator_options` are additional arguments of `pneuforce sim run`.

    Raises ChildProcessFailed if a process cannot start or ends by itself.
    """
    stop = Event()
    at_stop_signal(stop.set)
    with ExitStack() as stack, suppress(StartCancelled):
        folder = Path(stack.enter_context(TemporaryDirectory(prefix="pneuforce-")))
        users = folder / "users.toml"
        write_users(users, {DEMO_USER: User(DEMO_USER, "operator", hash_password(ports.password))})
        tables: dict[str, dict[str, Any]] = {
            "modbus": {"port": ports.modbus},
            "can": {"port": ports.can},
            "web": {
                "enabled": True,
                "port": ports.web,
                "users_file": str(users),
                "recordings": str(Path.cwd() / "recordings"),
            },
        }
        processes = start(stack, folder / "rig", simulator_options, tables, stop=stop)
        node = CanNodeAddress(CanAddress(interface="socketcand", port=ports.can))
        observer = Observer(ports.modbus, node, processes.control_port)
        observer.start()
        stack.callback(observer.stop)
        _show(observer, ports, seconds, stop, processes)
    return 0


def _show(observer: Observer, ports: DemoPorts, seconds: float | None, stop: Event, processes: Stack) -> None:
    """Update the output and run the demo sequence until `stop` is set or `seconds` have passed."""
    started_s = time.monotonic()
    sequence = DemoSequence(partial(ModbusClient.connect, port=ports.modbus))
    with _display(observer.values, sequence, ports, processes) as (update, period_s):
        while not stop.wait(period_s):
            elapsed_s = time.monotonic() - started_s
            if seconds is not None and elapsed_s > seconds:
                return
            processes.check()
            observer.values.forget_old(time.monotonic())
            sequence.step(observer.values.modbus, value_or_nan(observer.values.truth, "setpoint_kpa"))
            update(elapsed_s)


@contextmanager
def _display(
    values: ObservedValues, sequence: DemoSequence, ports: DemoPorts, processes: Stack
) -> Iterator[tuple[Callable[[float], None], float]]:
    """Yield a function that shows the present state, and the period [s] at which to call this function.

    The argument of the function is the elapsed time [s]. On a terminal the function draws a panel. Otherwise
    it prints one line, and another line for each new report of the sequence.
    """
    if not sys.stdout.isatty():
        print(ports.url, flush=True)
        print(f"control port of the simulator: {processes.control_port}", flush=True)
        print(f"local socket for pneuforce record: {processes.local_socket}", flush=True)
        shown = ""

        def print_lines(elapsed_s: float) -> None:
            nonlocal shown
            if sequence.report and sequence.report != shown:
                print(f"{elapsed_s:5.0f} s  {sequence.report}")
            shown = sequence.report
            print(format_line(values, elapsed_s, time.monotonic()), flush=True)

        yield print_lines, 1.0
        return
    with Live(auto_refresh=False) as live:

        def draw(elapsed_s: float) -> None:
            events = [*processes.host.stderr_lines, *wrap(sequence.report, REPORT_WIDTH)]
            live.update(
                panel(
                    values,
                    ports,
                    processes.control_port,
                    events[-MAX_EVENTS:],
                    elapsed_s,
                    time.monotonic(),
                ),
                refresh=True,
            )

        yield draw, 1 / PANEL_HZ
