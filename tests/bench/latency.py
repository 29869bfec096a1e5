"""Benchmark of the time from a sample to its CAN frame, in the host process."""

import json
import os
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.stack import free_port
from tests.system.waiting import inflate

CLIENTS, POLL_HZ, SECONDS, FORCE_HZ = 8, 50, 20, 500


def percentile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def bench_latency(brief=False):
    """Print the time from a sample to its CAN frame, while Modbus clients poll."""
    seconds = 1 if brief else SECONDS
    with TemporaryDirectory() as folder, ExitStack() as stack:
        link, modbus, hub_port = Path(folder) / "rig", free_port(), free_port()
        sim = stack.enter_context(ChildProcess("simulator", ["pneuforce", "sim", "run", "--link", str(link)]))
        hub_command = ["pneuforce.registers.can.hub", "--port", str(hub_port)]
        hub = stack.enter_context(ChildProcess("hub", hub_command))
        sim.ready()
        hub.ready()
        file = Path(folder) / "instrument.toml"
        file.write_text(
            f'[rig]\nport = "{link}"\n[modbus]\nport = {modbus}\n[can]\nenabled = true\n'
            f'interface = "socketcand"\nport = {hub_port}\nforce_rate_hz = {FORCE_HZ}\n'
        )
        # tests.bench.probe is not installed. The host process finds it only in this folder.
        os.environ["PYTHONPATH"] = str(Path(__file__).parents[2])
        host = stack.enter_context(ChildProcess("host", ["tests.bench.probe", str(file)]))
        host.ready()
        with ModbusClient.connect(port=modbus) as plc:
            inflate(plc, 8.0)
        polls = subprocess.run(
            [sys.executable, "-m", "tests.bench.pollers", *map(str, (modbus, CLIENTS, POLL_HZ, seconds))],
            check=True,
            capture_output=True,
        )
        report = host.stop_and_read()
    _print_latency(report, json.loads(polls.stdout))


def _print_latency(report, polls_ms):
    ms = report["latencies_ms"]
    print(
        f"sample received → CAN frame sent, 500 samples/s, {CLIENTS} Modbus clients at {POLL_HZ} Hz, "
        f"{len(ms)} frames: p50 {percentile(ms, 0.5):.3f} ms (target 1), p99 {percentile(ms, 0.99):.3f} ms "
        f"(target 5), worst {max(ms):.2f} ms"
    )
    print(f"samples used {report['samples']}, lost {report['lost']} (target 0)")
    print(
        f"round trips of these Modbus clients, {len(polls_ms)} polls: "
        f"p50 {percentile(polls_ms, 0.5):.3f} ms, "
        f"p99 {percentile(polls_ms, 0.99):.3f} ms, worst {max(polls_ms):.2f} ms"
    )
    print(f"host process: {report['cpu_s'] / (report['samples'] / 500):.0%} of one core")
