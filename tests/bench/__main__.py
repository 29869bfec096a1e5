"""All benchmarks in one run: `make bench`."""

import json
import os
import statistics
import subprocess
import sys
import time
import timeit
from contextlib import ExitStack
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

from pneuforce.protocol.frames import Command, CommandFlag, Identify, Mode, encode
from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.sim.hand import Hand
from pneuforce.sim.plants.membrane.plant import MembranePlant
from pneuforce.sim.plants.published import PublishedPlant
from pneuforce.sim.pneumatics import PneumaticSettings
from pneuforce.sim.rig import STEP_S, Rig
from pneuforce.sim.sensor import SensorSettings
from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.stack import free_port
from tests.bench.avr import bench_avr
from tests.bench.can import bench_burst, bench_can
from tests.bench.keep_alive import bench_keep_alive
from tests.bench.model import bench_arrays, bench_chain
from tests.system.waiting import inflate

CLIENTS, POLL_HZ, SECONDS = 8, 50, 20


def percentile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def seconds_of(command):
    begun_s = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - begun_s


def bench_estimate():
    """Print the duration of the command `pneuforce estimate`, and of an empty Python process."""
    command = [sys.executable, "-m", "pneuforce", "estimate", "--dpi", "8", "--dpf", "9"]
    mine = [seconds_of(command) for _ in range(10)]
    bare = [seconds_of([sys.executable, "-c", "pass"]) for _ in range(10)]
    print(
        f"pneuforce estimate in a new process: median {statistics.median(mine):.3f} s, "
        f"worst {max(mine):.3f} s (target 0.5 s); "
        f"for comparison, an empty Python process {statistics.median(bare):.3f} s"
    )


def bench_latency(force_hz=500):
    """Print the time from a sample to its CAN frame, while Modbus clients poll."""
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
            f'interface = "socketcand"\nport = {hub_port}\nforce_rate_hz = {force_hz}\n'
        )
        # The module tests.bench.probe is not installed.
        os.environ["PYTHONPATH"] = str(Path(__file__).parents[2])
        host = stack.enter_context(ChildProcess("host", ["tests.bench.probe", str(file)]))
        host.ready()
        with ModbusClient.connect(port=modbus) as plc:
            inflate(plc, 8.0)
        polls = subprocess.run(
            [sys.executable, "-m", "tests.bench.pollers", *map(str, (modbus, CLIENTS, POLL_HZ, SECONDS))],
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


def _us_per_step(rig, steps=500):
    """Return the time [µs] per step in the fastest of many runs, with a command every 50 ms."""
    command = encode(Command(Mode.HOLD, CommandFlag.ZEROED, 8000, 250), 1)

    def run():
        for n in range(steps):
            rig.step(b"" if n % 25 else command)

    return min(timeit.repeat(run, number=1, repeat=50)) / steps * 1e6


def _held(plant, pneumatics=None, sensor=None):
    """Return a rig that holds 8 kPa."""
    rig = Rig(plant, Hand(False), 1, pneumatics, sensor)
    rig.step(encode(Identify(), 0))
    for n in range(4000):
        mode = Mode.VENT if n < 1000 else Mode.HOLD
        rig.step(b"" if n % 25 else encode(Command(mode, CommandFlag.ZEROED, 8000, 250), n))
    assert rig.board.is_holding
    return rig


def bench_rig():
    """Print the speed of the simulated rig in virtual time: each balloon, without and with all effects."""
    effects = (
        PneumaticSettings(polytropic=1.2, creep=0.01, ambient_swing_kpa=0.05, reference_kpa=0.2),
        SensorSettings(gain_error=0.005, bow_kpa=0.2, ripple_mv=20.0),
    )
    for plant, settings in product((PublishedPlant(), MembranePlant()), ((), effects)):
        rig = _held(plant, *settings)
        if settings:
            rig.pneumatics.balloon_temperature.target_k = 15.0
            rig.pneumatics.circuit_temperature.target_k = 2.0
        idle_us = _us_per_step(rig)
        rig.hand.press(2.0)
        pressed_us = _us_per_step(rig)
        print(
            f"headless rig, {type(plant).__name__}{', with all effects' if settings else ''}: idle "
            f"{STEP_S * 1e6 / idle_us:.0f} × real time ({idle_us:.1f} µs per step), in contact "
            f"{STEP_S * 1e6 / pressed_us:.0f} × ({pressed_us:.1f} µs; target 100 ×)"
        )


if __name__ == "__main__":
    bench_arrays()
    bench_chain()
    bench_rig()
    bench_avr()
    bench_estimate()
    bench_latency()
    bench_keep_alive()
    bench_can()
    bench_burst()
