"""Benchmark of RDT: records without loss, and what four clients at 500 Hz cost: `python -m tests.bench rdt`.

One of the clients is pynetft, the others are plain sockets. A relay on the serial cable records the time of
each command to the board, first without clients and then with clients.
"""

import json
import os
import socket
import subprocess
import sys
import threading
import time
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil
import pynetft

from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.registers.rdt.record import COUNTS_PER_N, RDT_PORT, decode_record, encode_request
from pneuforce.registers.rdt.streams import MAX_STREAMS
from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.stack import free_port, toml
from tests.bench.keep_alive import gaps_ms as gaps_between
from tests.bench.keep_alive import start_relayed_rig
from tests.bench.latency import percentile
from tests.registers.rdt.serving import loopback_address
from tests.system.waiting import inflate

RECORDS, BRIEF_RECORDS, RATE_HZ = 10_000, 200, 500
TIMEOUT_S = 5.0


def pynetft_config(host, **settings):
    """Return a configuration of pynetft that needs no web page."""
    scale = {"counts_per_force_unit": COUNTS_PER_N, "counts_per_torque_unit": COUNTS_PER_N}
    units = {"force_unit": pynetft.ForceUnit.NEWTON, "torque_unit": pynetft.TorqueUnit.NEWTON_METER}
    calibration = pynetft.Calibration(**scale, **units)
    return pynetft.Config(sensor_host=host, calibration_override=calibration, **settings)


class Receiver(threading.Thread):
    """Client that counts its records, and the samples and records that are missing between them."""

    def __init__(self, host):
        super().__init__(daemon=True)
        self.records = self.lost_records = self.lost_samples = self.invalid = 0
        self.done = False
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect((host, RDT_PORT))
        self._socket.settimeout(0.2)
        self._socket.send(encode_request(2))
        self.start()

    def run(self):
        """Receive until `done` is set."""
        last = None
        while not self.done:
            try:
                record = decode_record(self._socket.recv(64))
            except TimeoutError:
                continue
            self.records += 1
            self.invalid += not record.is_valid
            if last is not None:
                self.lost_records += record.rdt_sequence - last.rdt_sequence - 1
                self.lost_samples += max(0, record.ft_sequence - last.ft_sequence - 1)
            last = record
        self._socket.send(encode_request(0))


def receive(host, count):
    """Receive `count` records with pynetft, beside three other clients. Print the counts as JSON."""
    others = [Receiver(host) for _ in range(MAX_STREAMS - 1)]
    with pynetft.Client(pynetft_config(host), queue_size=count) as client:
        begun_s, received = time.monotonic(), 0
        for received, _ in enumerate(client.samples(timeout=TIMEOUT_S), start=1):
            if received == count:
                break
        elapsed_s = time.monotonic() - begun_s
        health = client.health()
    for other in others:
        other.done = True
        other.join()
    names = ("records", "lost_records", "lost_samples", "invalid")
    sums = {name: sum(getattr(other, name) for other in others) for name in names}
    faults = ("lost_count", "duplicate_count", "out_of_order_count", "malformed_count", "reconnect_count")
    counts = {name: getattr(health, name) for name in (*faults, "python_queue_dropped_count")}
    print(json.dumps({"received": received, "elapsed_s": elapsed_s, "others": sums, **counts}))


def bench_rdt(brief=False):
    """Print losses, gaps between the commands, processor time and latency, with and without clients."""
    count, host = (BRIEF_RECORDS if brief else RECORDS), loopback_address()
    with TemporaryDirectory() as folder, ExitStack() as stack:
        modbus = free_port()
        relay, port = start_relayed_rig(stack, Path(folder) / "rig")
        file = Path(folder) / "instrument.toml"
        rdt = {"enabled": True, "host": host}
        safety = {"proof_test_s": 0}  # a proof test interrupts the force
        tables = {"rig": {"port": port}, "modbus": {"port": modbus}, "rdt": rdt, "safety": safety}
        file.write_text(toml(tables))
        # tests.bench.probe is not installed. The host process finds it only in this folder.
        os.environ["PYTHONPATH"] = str(Path(__file__).parents[2])
        instrument = stack.enter_context(ChildProcess("host", ["tests.bench.probe", str(file)]))
        instrument.ready()
        with ModbusClient.connect(port=modbus) as plc:
            inflate(plc, 8.0)
        phases = [
            _measured(instrument.pid, lambda: time.sleep(count / RATE_HZ)),
            _measured(instrument.pid, lambda: _received(host, count)),
        ]
        report = instrument.stop_and_read()
        heard_s = json.loads(relay.communicate("end\n")[0])["heard_s"]
    _print_losses(phases[1]["result"])
    for name, phase in zip(("without clients", f"with {MAX_STREAMS} clients"), phases, strict=True):
        _print_phase(name, phase, heard_s)
    _print_latencies(report["rdt_latencies_ms"])


def _received(host, count):
    words = [sys.executable, "-m", "tests.bench.rdt", "--receive", host, str(count)]
    return json.loads(subprocess.run(words, check=True, capture_output=True).stdout)


def _measured(pid, work):
    """Do the work. Return its result, its begin and end, and the processor time of the host process."""
    process = psutil.Process(pid)
    begun_s, used_s = time.monotonic(), sum(process.cpu_times()[:2])
    result = work()
    used_s, ended_s = sum(process.cpu_times()[:2]) - used_s, time.monotonic()
    return {"result": result, "begun_s": begun_s, "ended_s": ended_s, "used_s": used_s}


def _print_losses(result):
    others = result["others"]
    faults = ", ".join(f"{name.removesuffix('_count')} {n}" for name, n in result.items() if "_count" in name)
    print(
        f"pynetft: {result['received']} records in {result['elapsed_s']:.2f} s, "
        f"{result['received'] / result['elapsed_s']:.1f} per s; {faults} (targets 0)"
    )
    print(
        f"{MAX_STREAMS - 1} other clients: {others['records']} records, lost {others['lost_records']}, "
        f"samples without a record {others['lost_samples']} (targets 0), "
        f"records without a valid force {others['invalid']}"
    )


def _print_phase(name, phase, heard_s):
    gaps_ms = gaps_between([t for t in heard_s if phase["begun_s"] <= t <= phase["ended_s"]]) or [0.0]
    share = phase["used_s"] / (phase["ended_s"] - phase["begun_s"])
    print(
        f"{name}: gaps between {len(gaps_ms)} commands: median {percentile(gaps_ms, 0.5):.1f} ms, "
        f"p99 {percentile(gaps_ms, 0.99):.1f} ms, longest {gaps_ms[-1]:.1f} ms (the inlet closes at 250); "
        f"host process {share:.1%} of one core"
    )


def _print_latencies(ms):
    print(
        f"sample received → records sent to {MAX_STREAMS} clients, {len(ms)} samples: "
        f"p50 {percentile(ms, 0.5):.3f} ms, p99 {percentile(ms, 0.99):.3f} ms, worst {max(ms):.2f} ms; "
        f"load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    )


if __name__ == "__main__":
    receive(sys.argv[2], int(sys.argv[3]))
