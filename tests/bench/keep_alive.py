"""Longest gap between two commands to the board: `python -m tests.bench.keep_alive [SECONDS]`.

The complete instrument runs on the simulated rig, with its web page in browsers and a recorder, while 32
Modbus clients poll. A relay on the serial cable records the time of each command to the board.
"""

import json
import select
import subprocess
import sys
import time
from contextlib import ExitStack, closing, suppress
from itertools import pairwise
from os import cpu_count, getloadavg
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Thread
from urllib.request import urlopen

from pneuforce.protocol.frames import Command, FrameDecoder
from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.sim.line.pty_link import PtyLink
from pneuforce.support.serial_port import SerialPort
from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.stack import free_port, toml
from tests.system.waiting import inflate

POLLERS, POLL_HZ, BROWSERS, SECONDS = 32, 20, 4, 20
TARGET_S = 0.1
WARM_S = 2.0  #: time at the start that is not measured, because the clients are starting


class Browser(Thread):
    """Reader of the event stream of the web page."""

    def __init__(self, port):
        super().__init__(daemon=True)
        self._stream = urlopen(f"http://127.0.0.1:{port}/api/live", timeout=10.0)
        self.start()

    def run(self):
        """Read until the stream is closed."""
        with suppress(OSError, ValueError, AttributeError):
            while self._stream.readline():
                pass

    def close(self):
        """Close the stream."""
        self._stream.close()


class Relay:
    """Relay between board and host that records the times of the commands."""

    def __init__(self, board, host):
        self._board, self._host = board, host
        self._decoder = FrameDecoder.for_host_frames()
        self.heard_s = []
        self.looked_s = []  # times at which the relay ran: every 10 ms or more often, if a processor is free

    def carry(self, until):
        """Relay until `until()` is true."""
        while not until():
            readable, _, _ = select.select([self._board, self._host], [], [], 0.01)
            self.looked_s.append(time.monotonic())
            if self._board in readable:
                self._host.write(self._board.read())
            if self._host in readable:
                data = self._host.read()
                now_s = time.monotonic()
                commands = [f for f in self._decoder.feed(data) if isinstance(f.message, Command)]
                self.heard_s += [now_s] * len(commands)
                self._board.write(data)


def relay_process(link):
    """Relay between the simulator at `link` and a host until stdin closes. Then print the recorded times."""
    with closing(SerialPort(link)) as board, closing(PtyLink()) as host:
        print(json.dumps({"port": host.port}), flush=True)
        relay = Relay(board, host)
        relay.carry(lambda: bool(select.select([sys.stdin], [], [], 0)[0]))
    print(json.dumps({"heard_s": relay.heard_s, "looked_s": relay.looked_s}))


def start_relayed_rig(stack, link):
    """Start a simulated rig, and a relay on its serial cable. Return the relay and its port."""
    simulator = ["pneuforce", "sim", "run", "--link", str(link)]
    stack.enter_context(ChildProcess("simulator", simulator)).ready()
    relay = subprocess.Popen(
        [sys.executable, "-m", "tests.bench.keep_alive", "--relay", str(link)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    stack.callback(relay.kill)
    return relay, json.loads(relay.stdout.readline())["port"]


def bench_keep_alive(brief=False, seconds=SECONDS):
    """Print the longest gap between two commands."""
    seconds = 2.5 if brief else seconds
    with TemporaryDirectory() as folder, ExitStack() as stack:
        modbus, page = free_port(), free_port()
        relay, port = start_relayed_rig(stack, Path(folder) / "rig")
        file = Path(folder) / "instrument.toml"
        tables = {"rig": {"port": port}, "modbus": {"port": modbus}, "web": {"enabled": True, "port": page}}
        file.write_text(toml(tables))
        words = ["pneuforce", "run", "--config", str(file), "--record", str(Path(folder) / "a.recording")]
        stack.enter_context(ChildProcess("host", words)).ready()
        with ModbusClient.connect(port=modbus) as plc:
            inflate(plc, 8.0)
        for _ in range(BROWSERS):
            stack.callback(Browser(page).close)
        begun_s = time.monotonic()
        polls = [sys.executable, "-m", "tests.bench.pollers", *map(str, (modbus, POLLERS, POLL_HZ, seconds))]
        subprocess.run(polls, check=True, capture_output=True)
        ended_s = time.monotonic()
        noted = json.loads(relay.communicate("end\n")[0])
    heard_ms, looked_ms = (
        gaps_ms([t for t in noted[what] if begun_s + WARM_S <= t <= ended_s])
        for what in ("heard_s", "looked_s")
    )
    _print_gaps(heard_ms, looked_ms, seconds)


def gaps_ms(times_s):
    return sorted((b - a) * 1e3 for a, b in pairwise(times_s))


def _print_gaps(heard_ms, looked_ms, seconds):
    late = sum(gap_ms > TARGET_S * 1e3 for gap_ms in heard_ms)
    print(
        f"commands at the board, {POLLERS} Modbus clients at {POLL_HZ} Hz, {BROWSERS} browsers and a "
        f"recorder, {seconds} s, "
        f"{len(heard_ms)} commands: "
        f"longest gap {heard_ms[-1]:.0f} ms (target {TARGET_S * 1e3:.0f}, the inlet closes at 250), "
        f"{late} gaps above the target, "
        f"p99 {heard_ms[int(0.99 * len(heard_ms))]:.0f} ms, median {heard_ms[len(heard_ms) // 2]:.0f} ms; "
        f"longest time in which the relay itself did not run {looked_ms[-1]:.0f} ms; "
        f"load of the machine {getloadavg()[2]:.1f} on {cpu_count()} cores"
    )


if __name__ == "__main__":
    if sys.argv[1:2] == ["--relay"]:
        relay_process(sys.argv[2])
    else:
        bench_keep_alive(False, *(int(argument) for argument in sys.argv[1:]))
