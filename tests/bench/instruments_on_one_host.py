"""Several instruments on one computer: `python -m tests.bench.instruments_on_one_host [NUMBER] [SECONDS]`.

Each instrument is complete, with its web process and its event log, and runs on its own simulated rig. It
holds 8 kPa while two Modbus clients read at 20 Hz and Prometheus metrics are read every 5 s. The figures come
from the counters of each instrument. The rigs, the clients and the instruments share the computer.
"""

import os
import subprocess
import sys
import time
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.request import urlopen

import psutil
from prometheus_client.parser import text_string_to_metric_families

from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.stack import free_port, toml
from tests.system.waiting import inflate

NUMBER, BRIEF_NUMBER = 8, 1
SECONDS, BRIEF_SECONDS = 60.0, 1.0
CLIENTS, POLL_HZ, SCRAPE_S = 2, 20, 5.0
SETPOINT_KPA = 8.0
REALTIME_PRIORITY = 10  #: as in the systemd unit, for the event loop only
GAPS = "pneuforce_command_gap_seconds"


@dataclass(frozen=True)
class Running:
    """One instrument with its rig."""

    host: ChildProcess
    rig: ChildProcess
    modbus_port: int
    web_port: int

    def metrics(self):
        """Return the samples of all metrics."""
        with closing(urlopen(f"http://127.0.0.1:{self.web_port}/metrics", timeout=10.0)) as answer:
            families = text_string_to_metric_families(answer.read().decode())
        return [sample for family in families for sample in family.samples]

    def gaps(self):
        """Return the number of gaps between commands up to each bound [s], as text."""
        return {m.labels["le"]: m.value for m in self.metrics() if m.name == GAPS + "_bucket"}

    def usage(self):
        """Return processor time [s] and memory [MB] of the instrument, its web process, and its rig."""
        host = psutil.Process(self.host.pid)
        web = host.children(recursive=True)
        groups = [host], web, [psutil.Process(self.rig.pid)]
        return [(sum(map(_cpu_s, group)), sum(map(_memory_mb, group))) for group in groups]


def _cpu_s(process):
    times = process.cpu_times()
    return times.user + times.system


def _memory_mb(process):
    return process.memory_full_info().pss / 1e6


def bench_instruments_on_one_host(brief=False, number=NUMBER, seconds=SECONDS):
    """Print processor time, memory and gaps between commands, without and with real-time priority."""
    number, seconds = (BRIEF_NUMBER, BRIEF_SECONDS) if brief else (number, seconds)
    with TemporaryDirectory() as folder, ExitStack() as stack:
        instruments = [_start(stack, Path(folder) / str(n)) for n in range(number)]
        for instrument in instruments:
            with ModbusClient.connect(port=instrument.modbus_port) as plc:
                inflate(plc, SETPOINT_KPA)
        _measure("default priority", instruments, seconds)
        try:
            for instrument in instruments:
                policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
                os.sched_setscheduler(instrument.host.pid, policy, os.sched_param(REALTIME_PRIORITY))
        except PermissionError:
            print("real-time priority: not measured, because it needs a privilege")
        else:
            _measure("real-time priority", instruments, seconds)


def _start(stack, folder):
    """Start a rig and an instrument in `folder`."""
    folder.mkdir()
    link, modbus_port, web_port = folder / "rig", free_port(), free_port()
    rig = stack.enter_context(ChildProcess("rig", ["pneuforce", "sim", "run", "--link", str(link)]))
    rig.ready()
    tables = {
        "rig": {"port": str(link)},
        "modbus": {"port": modbus_port},
        "web": {"enabled": True, "port": web_port},
        "events": {"file": str(folder / "events.sqlite")},
        "local": {"socket": str(folder / "pneuforce.sock")},
    }
    file = folder / "instrument.toml"
    file.write_text(toml(tables))
    host = stack.enter_context(ChildProcess("host", ["pneuforce", "run", "--config", str(file)]))
    host.ready()
    instrument = Running(host, rig, modbus_port, web_port)
    _wait_for_metrics(instrument)
    return instrument


def _wait_for_metrics(instrument, timeout_s=30.0):
    until_s = time.monotonic() + timeout_s
    while True:
        with suppress(OSError):
            if instrument.gaps():
                return
        assert time.monotonic() < until_s, "the instrument serves no metrics"
        time.sleep(0.1)


def _measure(name, instruments, seconds):
    gaps_before, usage_before = ([getattr(i, what)() for i in instruments] for what in ("gaps", "usage"))
    begun_s = time.monotonic()
    words = [sys.executable, "-m", "tests.bench.pollers"]
    pollers = [
        subprocess.Popen(
            [*words, *map(str, (i.modbus_port, CLIENTS, POLL_HZ, seconds))], stdout=subprocess.DEVNULL
        )
        for i in instruments
    ]
    while (left_s := begun_s + seconds - time.monotonic()) > 0:
        time.sleep(min(SCRAPE_S, left_s))
        for instrument in instruments:
            instrument.metrics()
    for poller in pollers:
        assert poller.wait(60) == 0
    elapsed_s = time.monotonic() - begun_s
    usage = [i.usage() for i in instruments]
    gaps = [i.gaps() for i in instruments]
    _print_gaps(name, [_difference(a, b) for a, b in zip(gaps, gaps_before, strict=True)])
    _print_usage(usage_before, usage, elapsed_s)


def _difference(after, before):
    return {bound: after[bound] - before[bound] for bound in after}


def _print_gaps(name, gaps):
    print(f"{len(gaps)} instruments, {name}; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    total = {bound: int(sum(one[bound] for one in gaps)) for bound in gaps[0]}
    count = total["+Inf"]
    shares = ", ".join(f"up to {bound} s {100 * n / count:.2f} %" for bound, n in total.items())
    print(f"  {count} gaps between two commands: {shares}")
    longest = [min((b for b, n in one.items() if n == one["+Inf"]), key=float) for one in gaps]
    print(f"  longest gap of each instrument, at most [s]: {', '.join(longest)} (the inlet closes at 0.25)")


def _print_usage(before, after, elapsed_s):
    for index, part in enumerate(("instrument", "web process", "simulated rig")):
        cores = [(a[index][0] - b[index][0]) / elapsed_s for a, b in zip(after, before, strict=True)]
        memory_mb = [a[index][1] for a in after]
        print(
            f"  {part}: {100 * sum(cores) / len(cores):.1f} % of a core each "
            f"({100 * min(cores):.1f} to {100 * max(cores):.1f}), {sum(memory_mb) / len(memory_mb):.0f} MB"
        )


if __name__ == "__main__":
    bench_instruments_on_one_host(False, *(int(word) for word in sys.argv[1:]))
