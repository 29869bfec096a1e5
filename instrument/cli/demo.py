"""`pneuforce demo`: simulator, CAN hub and instrument as processes, observed as a PLC and a robot do it."""

from __future__ import annotations

import errno
import math
import signal
import socket
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Event
from typing import Any

from rich.live import Live

from pneuforce.errors import ServerError
from pneuforce.instrument.cli.observe import CanNodeAddress, ObservedValues, Observer, value_or_nan
from pneuforce.instrument.cli.panel import MAX_EVENTS, DemoPorts, format_line, panel
from pneuforce.registers.can.bus import CanAddress
from pneuforce.registers.modbus.client import ModbusClient, ModbusClientError
from pneuforce.teststand.child_process import ChildProcessFailed, StartCancelled
from pneuforce.teststand.stack import Stack, start

PANEL_HZ = 5


def check_ports_free(ports: Mapping[str, int]) -> None:
    """Raise ServerError if a TCP port cannot be used. `ports` maps the names of the options to the ports."""
    for option, port in ports.items():
        try:
            socket.create_server(("127.0.0.1", port)).close()
        except OSError as error:
            in_use = error.errno == errno.EADDRINUSE
            why = "is in use by another program" if in_use else "needs privileges that you do not have"
            raise ServerError(f"--{option} {port} {why}: choose another") from None


def run_demo(seconds: float | None, ports: DemoPorts, simulator_options: Sequence[str]) -> int:
    """Run the demo until `seconds` have passed, Ctrl-C or SIGTERM. Return the exit code.

    `simulator_options` are additional arguments of `pneuforce sim run`.

    Raises ChildProcessFailed if a process cannot start or ends by itself.
    """
    stop = Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    with ExitStack() as stack, suppress(StartCancelled):
        folder = Path(stack.enter_context(TemporaryDirectory(prefix="pneuforce-")))
        tables: dict[str, dict[str, Any]] = {
            "modbus": {"port": ports.modbus},
            "can": {"port": ports.can},
            "web": {"enabled": True, "port": ports.web, "token": ports.token},
        }
        processes = start(stack, folder / "rig", simulator_options, tables, stop=stop)
        plc = stack.enter_context(ModbusClient.connect(port=ports.modbus))
        node = CanNodeAddress(CanAddress(interface="socketcand", port=ports.can))
        observer = Observer(plc, node, processes.control_port)
        observer.start()
        stack.callback(observer.stop)
        _show(observer, ports, seconds, stop, processes)
    return 0


class DemoSequence:
    """Commands of the demo: vent, setpoint and hold, then the setpoints of the scenario.

    The sequence ends as soon as another client has written a setpoint or taken the lease.
    """

    def __init__(self, port: int) -> None:
        self._port = port
        #: The last two setpoints. An observed value can be older than the last command.
        self._commanded_kpa = (math.nan, math.nan)
        self._done = False

    def step(self, values: dict[str, Any], wanted_kpa: float) -> None:
        """Command the setpoint `wanted_kpa` if the sensor has its zero. A rejection ends the sequence."""
        if (
            self._done
            or "not_zeroed" in values.get("status", {"not_zeroed"})
            or wanted_kpa == self._commanded_kpa[0]
        ):
            return
        requested_kpa = value_or_nan(values, "setpoint_requested")
        own_setpoint = any(
            math.isclose(requested_kpa, setpoint_kpa, rel_tol=1e-6) for setpoint_kpa in self._commanded_kpa
        )
        first = math.isnan(requested_kpa) and math.isnan(self._commanded_kpa[0])
        self._done = not (own_setpoint or first) or values["lease_holder"] != "none"
        if math.isfinite(wanted_kpa) and not self._done:
            self._done = not self._command(wanted_kpa, first)

    def _command(self, setpoint_kpa: float, first: bool) -> bool:
        """Write a setpoint. Return True if it was accepted."""
        self._commanded_kpa = (setpoint_kpa, self._commanded_kpa[0])
        try:
            with ModbusClient.connect(port=self._port) as plc:
                if first:
                    plc.write("mode", "vent")
                plc.write("setpoint_requested", setpoint_kpa)
                if first:
                    plc.write("mode", "hold")
        except ModbusClientError:
            return False
        return True


def _show(observer: Observer, ports: DemoPorts, seconds: float | None, stop: Event, processes: Stack) -> None:
    """Update the output and run the demo sequence until the end."""
    started_s = time.monotonic()
    sequence = DemoSequence(ports.modbus)
    with _display(observer.values, ports, processes) as (update, period_s):
        while not stop.wait(period_s):
            elapsed_s = time.monotonic() - started_s
            if seconds is not None and elapsed_s > seconds:
                return
            processes.check()
            if observer.failure is not None:
                raise ChildProcessFailed(str(observer.failure))
            sequence.step(observer.values.modbus, value_or_nan(observer.values.truth, "setpoint_kpa"))
            update(elapsed_s)


@contextmanager
def _display(
    values: ObservedValues, ports: DemoPorts, processes: Stack
) -> Iterator[tuple[Callable[[float], None], float]]:
    """Yield the function that shows the state at an elapsed time [s], and its period [s].

    The function draws a panel on a terminal. Otherwise it prints one line per second.
    """
    if not sys.stdout.isatty():
        print(ports.url, flush=True)
        yield lambda elapsed_s: print(format_line(values, elapsed_s, time.monotonic()), flush=True), 1.0
        return
    with Live(auto_refresh=False) as live:

        def draw(elapsed_s: float) -> None:
            events = list(processes.host.stderr_lines)[-MAX_EVENTS:]
            live.update(
                panel(values, ports, processes.control_port, events, elapsed_s, time.monotonic()),
                refresh=True,
            )

        yield draw, 1 / PANEL_HZ
