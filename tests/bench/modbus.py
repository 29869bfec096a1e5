"""Comparison of Modbus servers with clients written in C: `python -m tests.bench.modbus [SECONDS]`.

The server of the instrument runs with the simulated rig at 500 samples/s. The servers of pymodbus and
libmodbus serve constant values.
"""

import json
import os
import re
import socket
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.teststand.stack import free_port, start
from tests.system.waiting import inflate

OURS = Path(__file__).parent / "libmodbus"
SERVERS = Path(__file__).parents[1] / "hostile/other_servers/servers"
START_S = 10.0
SECONDS = 4
ROUNDS = 5
CLIENTS = (1, 8, 32)
FLOODERS, RIG_HZ = 4, 500
REQUESTS, CONNECTIONS = 10**6, 10**4
READ = bytes.fromhex("0001 0000 0006 01 04 0000 0014")


def built(folder, name, sources=OURS):
    """Compile a C program that uses libmodbus, and return its path."""
    flags = subprocess.check_output(["pkg-config", "--cflags", "--libs", "libmodbus"], text=True).split()
    source, program = sources / f"{name}.c", Path(folder) / name
    subprocess.run(["gcc", "-O2", "-o", program, source, *flags, "-lpthread"], check=True)
    return program


def load(program, port, clients, seconds, hz=()):
    """Run the clients and return their measurements."""
    answer = subprocess.run(
        [program, *map(str, (port, clients, seconds, *hz))], check=True, capture_output=True, text=True
    )
    return json.loads(answer.stdout)


@contextmanager
def listening(command):
    """Start a server process that prints one line when it listens."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        server.stdout.readline()
        try:
            yield
        finally:
            server.kill()


@contextmanager
def serving(*command):
    """Start a server of another project and yield its port, which is appended to its command."""
    port = free_port()
    with subprocess.Popen([*command, str(port)], stderr=subprocess.DEVNULL) as server:
        try:
            until_s = time.monotonic() + START_S
            while not accepts(port):
                assert time.monotonic() < until_s, f"{command} does not listen"
                time.sleep(0.05)
            yield port
        finally:
            server.kill()


def accepts(port):
    with socket.socket() as client:
        return client.connect_ex(("127.0.0.1", port)) == 0


@contextmanager
def rivals(folder):
    """Start the servers of pymodbus and libmodbus. Yield their ports."""
    in_c = built(folder, "stock_libmodbus", SERVERS)
    with serving(sys.executable, SERVERS / "stock_pymodbus.py") as pymodbus, serving(in_c) as libmodbus:
        yield {"pymodbus": pymodbus, "libmodbus, C": libmodbus}


@contextmanager
def instrument(folder):
    """Start the instrument and inflate its balloon to 8 kPa."""
    with ExitStack() as children:
        stack = start(children, Path(folder) / "rig", tables={"modbus": {"max_connections": 200}})
        with ModbusClient.connect(port=stack.modbus_port) as plc:
            inflate(plc, 8.0)
        yield stack


def bench_modbus(brief=False, seconds=SECONDS):
    """Print the speed of fast clients, and the delays of slow clients and of one client during a flood."""
    seconds = 0.3 if brief else seconds
    with TemporaryDirectory() as folder, instrument(folder) as stack, rivals(folder) as others:
        program = built(folder, "load")
        servers = {"pneuforce": stack.modbus_port, **others}
        for clients in CLIENTS[:1] if brief else CLIENTS:
            _bench_speed(program, servers, clients, *((1, 0.2) if brief else (ROUNDS, 1)))
        _bench_calm(program, stack, seconds if brief else 3 * seconds)
        _bench_endurance(program, stack, *((10**3, 10**2, 0.1) if brief else (REQUESTS, CONNECTIONS, 5)))


def _bench_speed(program, servers, clients, rounds, seconds):
    """Print the medians of interleaved rounds. A round measures each server once, for some seconds."""
    seen = {name: [] for name in servers}
    for _ in range(rounds):
        for name, port in servers.items():
            seen[name].append(load(program, port, clients, seconds))
    ours = seen["pneuforce"]
    for name, reports in seen.items():
        rate, p50_ms, p99_ms = (
            median(report[key] for report in reports) for key in ("requests_per_s", "p50_ms", "p99_ms")
        )
        ratio = median(a["requests_per_s"] / b["requests_per_s"] for a, b in zip(ours, reports, strict=True))
        print(
            f"FC4 × 20, {clients:2} clients, {name}: {rate:6.0f} requests/s, p50 {p50_ms:.3f} ms, "
            f"p99 {p99_ms:.3f} ms; pneuforce is {ratio:.2f} × as fast"
        )


def _bench_calm(program, stack, seconds):
    begun_s, before = time.monotonic(), samples(stack)
    report = load(program, stack.modbus_port, 32, seconds, (50,))
    print(f"32 clients at 50 Hz: p99 {report['p99_ms']:.2f} ms (target 5), worst {report['worst_ms']:.1f} ms")
    flood = [sys.executable, "-m", "tests.bench.flood", str(stack.modbus_port), str(FLOODERS)]
    with listening(flood):
        report = load(program, stack.modbus_port, 1, seconds, (100,))
    print(
        f"1 client at 100 Hz while {FLOODERS} other clients send garbage: p99 {report['p99_ms']:.2f} ms "
        f"(target 20), worst {report['worst_ms']:.1f} ms"
    )
    used, due = samples(stack) - before, round((time.monotonic() - begun_s) * RIG_HZ)
    print(f"samples used in this time: {used} of {due} (±3)")


def _bench_endurance(program, stack, requests, connections, seconds):
    """Print the growth of memory and open descriptors during many requests and connections."""
    load(program, stack.modbus_port, 32, seconds / 5)
    before, begun_s, asked = occupied(stack.host.pid), time.monotonic(), 0
    while asked < requests:
        asked += load(program, stack.modbus_port, 32, seconds)["trips"]
    for n in range(connections):
        with socket.create_connection(("127.0.0.1", stack.modbus_port)) as client:
            client.sendall(READ[: n % len(READ)])  # most connections close in the middle of a request
    time.sleep(1.0)
    memory_kb, descriptors = (b - a for a, b in zip(before, occupied(stack.host.pid), strict=True))
    print(
        f"{asked} requests and {connections} connections in {time.monotonic() - begun_s:.0f} s: memory "
        f"{memory_kb / 1024:+.1f} MB (target 5), open descriptors {descriptors:+d}"
    )


def occupied(pid):
    """Return resident memory [kB] and number of open descriptors of a process."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+)", status)[1]), len(os.listdir(f"/proc/{pid}/fd"))


def samples(stack):
    with ModbusClient.connect(port=stack.modbus_port) as plc:
        return plc.read()["sample_counter"]


if __name__ == "__main__":
    bench_modbus(False, *map(int, sys.argv[1:]))
