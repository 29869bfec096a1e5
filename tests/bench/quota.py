"""Benchmark of the instrument inside a CPU quota: does it hold the balloon without a trip?

The quota is a control group of Linux, version 1 or 2. To create one, the user needs the necessary rights.
"""

import os
import re
import statistics
import time
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil

from pneuforce.instrument.core.faults import name_of
from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.teststand.stack import free_port, start
from tests.bench.keep_alive import Browser
from tests.system.waiting import inflate

SHARE, PERIOD_US = 0.25, 100_000
SECONDS, POLL_HZ = 600, 20
GROUPS = Path("/sys/fs/cgroup")
HAS_VERSION_1 = (GROUPS / "cpu").is_dir()
PARENT = GROUPS / "cpu" if HAS_VERSION_1 else GROUPS
NAME = "pneuforce-bench"
STALLS = re.compile(r"did not run(?:, (\d+) times)?")


def is_permitted():
    """Return True if this user can limit the processor time of processes: see cgroups(7)."""
    if HAS_VERSION_1:
        return os.access(PARENT / "cgroup.procs", os.W_OK)
    controllers = PARENT / "cgroup.subtree_control"
    return os.access(controllers, os.W_OK) and "cpu" in controllers.read_text().split()


@contextmanager
def quota(pids):
    """Limit processes to a quarter of one processor together. Yield the folder of the control group."""
    group = PARENT / NAME
    group.mkdir(exist_ok=True)
    try:
        if HAS_VERSION_1:
            (group / "cpu.cfs_period_us").write_text(str(PERIOD_US))
            (group / "cpu.cfs_quota_us").write_text(str(round(SHARE * PERIOD_US)))
        else:
            (group / "cpu.max").write_text(f"{round(SHARE * PERIOD_US)} {PERIOD_US}")
        for pid in pids:
            (group / "cgroup.procs").write_text(str(pid))
        yield group
    finally:
        for pid in (group / "cgroup.procs").read_text().split():
            (group.parent / "cgroup.procs").write_text(pid)
        group.rmdir()


def throttled_periods(group):
    """Return the number of periods, and the number of periods in which the processes had to wait."""
    counts = dict(line.split() for line in (group / "cpu.stat").read_text().splitlines())
    return int(counts["nr_periods"]), int(counts["nr_throttled"])


def bench_quota(brief=False):
    """Print trips, stalls and round trips while the instrument holds the balloon inside the quota."""
    if not is_permitted():
        print("CPU quota: 0 runs, because this user cannot limit processes by a control group")
        return
    seconds, page = 1 if brief else SECONDS, free_port()
    tables = {"web": {"enabled": True, "port": page}, "can": {"force_rate_hz": 100}}
    with TemporaryDirectory() as folder, ExitStack() as stack:
        parts = start(stack, Path(folder) / "rig", ["--scenario", "taps"], tables)
        with ModbusClient.connect(port=parts.modbus_port) as plc:
            inflate(plc, 8.0)
        stack.enter_context(closing(Browser(page)))
        psutil.Process(parts.sim.pid).nice(-10)  # a real board does not compete for the processor
        instrument = psutil.Process(parts.host.pid)
        group = stack.enter_context(quota([parts.host.pid, *(p.pid for p in instrument.children())]))
        plc = stack.enter_context(ModbusClient.connect(port=parts.modbus_port, wait_s=10.0))
        trips_ms, trip = _poll(plc, seconds)
        stalls = sum(int(found[1] or 1) for found in map(STALLS.search, parts.host.stderr_lines) if found)
        periods, throttled = throttled_periods(group)
    print(
        f"instrument and web page on {SHARE:.0%} of one processor for {seconds} s, {len(trips_ms)} polls: "
        f"{trip} (target: no trip), {stalls} stalls of more than 0.1 s in the log; poll median "
        f"{statistics.median(trips_ms):.1f} ms, worst {max(trips_ms):.0f} ms; the quota was used up in "
        f"{throttled} of {periods} periods"
    )


def _poll(plc, seconds):
    """Poll until the rig trips or the time is over. Return the round trips [ms], and the trip as text."""
    trips_ms, start_s = [], time.monotonic()
    while time.monotonic() < start_s + seconds:
        begun_s = time.monotonic()
        if plc.read()["state"] == "tripped":
            fault = name_of(plc.read_all()["first_out_fault"])
            return trips_ms, f"tripped after {begun_s - start_s:.0f} s by {fault}"
        trips_ms.append((time.monotonic() - begun_s) * 1e3)
        time.sleep(max(0.0, begun_s + 1 / POLL_HZ - time.monotonic()))
    return trips_ms, "no trip"
