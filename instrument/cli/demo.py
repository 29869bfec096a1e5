"""`pneuforce demo`: simulator, CAN hub and instrument as processes, watched as a PLC and a robot would."""

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

from instrument.cli.observe import NodeAt, Observer, Seen, number
from instrument.cli.panel import EVENTS, Ports, panel, plain_line
from instrument.errors import FaceError
from registers.can.bus import BusAt
from registers.modbus.client import Plc, PlcError
from teststand.children import ChildFailed, Stopped
from teststand.stack import Stack, start

PANEL_HZ = 5


def refuse_taken(ports: Mapping[str, int]) -> None:
    """Raises FaceError, naming the option, where one of these TCP ports is another program's."""
    for option, port in ports.items():
        try:
            socket.create_server(("127.0.0.1", port)).close()
        except OSError as error:
            busy = error.errno == errno.EADDRINUSE
            why = "is in use by another program" if busy else "may not be listened on by you"
            raise FaceError(f"--{option} {port} {why}: choose another") from None


def run_demo(seconds: float | None, ports: Ports, rig: Sequence[str]) -> int:
    """Run the demo until `seconds` have passed, Ctrl-C or SIGTERM; returns the exit code.

    `rig` is what the simulator is started with.

    Raises ChildFailed where a part cannot start or ends by itself.
    """
    stop = Event()
    for number_ in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number_, lambda *_: stop.set())
    with ExitStack() as stack, suppress(Stopped):
        folder = Path(stack.enter_context(TemporaryDirectory(prefix="pneuforce-")))
        tables: dict[str, dict[str, Any]] = {
            "modbus": {"port": ports.modbus},
            "can": {"port": ports.can},
            "page": {"enabled": True, "port": ports.page, "token": ports.token},
        }
        parts = start(stack, folder / "rig", rig, tables, stop=stop)
        plc = stack.enter_context(Plc.connect(port=ports.modbus))
        observer = Observer(plc, NodeAt(BusAt(interface="socketcand", port=ports.can)), parts.control_port)
        observer.start()
        stack.callback(observer.stop)
        _show(observer, ports, seconds, stop, parts)
    return 0


class Script:
    """The demo's own commands: vent, setpoint, hold, then the scenario's setpoints; none after a client's."""

    def __init__(self, port: int) -> None:
        self._port = port
        self._told_kpa = (math.nan, math.nan)  # the last two: what is seen may be older than what was told
        self._done = False

    def step(self, seen: dict[str, Any], wanted_kpa: float) -> None:
        """Inflate as soon as the sensor has its zero; a refusal means that a client has taken over."""
        if (
            self._done
            or "not_zeroed" in seen.get("status", {"not_zeroed"})
            or wanted_kpa == self._told_kpa[0]
        ):
            return
        requested_kpa = number(seen, "setpoint_requested")
        ours = any(math.isclose(requested_kpa, told_kpa, rel_tol=1e-6) for told_kpa in self._told_kpa)
        first = math.isnan(requested_kpa) and math.isnan(self._told_kpa[0])
        self._done = not (ours or first) or seen["lease_holder"] != "none"
        if math.isfinite(wanted_kpa) and not self._done:
            self._done = not self._tell(wanted_kpa, first)

    def _tell(self, wanted_kpa: float, first: bool) -> bool:
        """Write what is wanted; whether it was accepted."""
        self._told_kpa = (wanted_kpa, self._told_kpa[0])
        try:
            with Plc.connect(port=self._port) as plc:
                if first:
                    plc.write("mode", "vent")
                plc.write("setpoint_requested", wanted_kpa)
                if first:
                    plc.write("mode", "hold")
        except PlcError:
            return False
        return True


def _show(observer: Observer, ports: Ports, seconds: float | None, stop: Event, parts: Stack) -> None:
    begun_s = time.monotonic()
    script = Script(ports.modbus)
    with _display(observer.seen, ports, parts) as (update, period_s):
        while not stop.wait(period_s):
            elapsed_s = time.monotonic() - begun_s
            if seconds is not None and elapsed_s > seconds:
                return
            parts.check()
            if observer.failure is not None:
                raise ChildFailed(str(observer.failure))
            script.step(observer.seen.modbus, number(observer.seen.truth, "setpoint_kpa"))
            update(elapsed_s)


@contextmanager
def _display(seen: Seen, ports: Ports, parts: Stack) -> Iterator[tuple[Callable[[float], None], float]]:
    """What to call with the time that has passed, and how often: a panel, or one line a second."""
    if not sys.stdout.isatty():
        print(ports.url, flush=True)
        yield lambda elapsed_s: print(plain_line(seen, elapsed_s, time.monotonic()), flush=True), 1.0
        return
    with Live(auto_refresh=False) as live:

        def draw(elapsed_s: float) -> None:
            events = list(parts.host.said)[-EVENTS:]
            live.update(
                panel(seen, ports, parts.control_port, events, elapsed_s, time.monotonic()), refresh=True
            )

        yield draw, 1 / PANEL_HZ
