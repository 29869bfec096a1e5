"""Modbus servers side by side, under clients in C: `python -m tests.bench.modbus [SECONDS]`.

Ours is the whole instrument on the simulated rig at 500 samples/s; those of pymodbus and libmodbus serve
constants.
"""

import json
import os
import subprocess
import sys
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from registers.modbus.client import Plc
from tests.system.waiting import inflate
from teststand.stack import free_port, start

HERE = Path(__file__).parent
SECONDS = 4
CLIENTS = (1, 8, 32)
FLOODERS = 4
GARBAGE = os.urandom(4096)


def built(folder, name):
    """A program of this folder's libmodbus/, compiled."""
    flags = subprocess.check_output(["pkg-config", "--cflags", "--libs", "libmodbus"], text=True).split()
    source, program = HERE / "libmodbus" / f"{name}.c", Path(folder) / name
    subprocess.run(["gcc", "-O2", "-o", program, source, *flags, "-lpthread"], check=True)
    return program


def load(program, port, clients, seconds, hz=()):
    """What the clients saw."""
    answer = subprocess.run(
        [program, *map(str, (port, clients, seconds, *hz))], check=True, capture_output=True, text=True
    )
    return json.loads(answer.stdout)


@contextmanager
def listening(command):
    """A server process that says one line when it listens."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        server.stdout.readline()
        try:
            yield
        finally:
            server.kill()


@contextmanager
def rivals(folder):
    """Ports of pymodbus's and libmodbus's servers."""
    mine, theirs = free_port(), free_port()
    stock = [sys.executable, "-m", "tests.bench.stock", str(mine)]
    with listening(stock), listening([built(folder, "server"), str(theirs)]):
        yield {"pymodbus": mine, "libmodbus, C": theirs}


@contextmanager
def instrument(folder):
    """The instrument, which holds 8 kPa."""
    with ExitStack() as children:
        stack = start(children, Path(folder) / "rig", tables={"modbus": {"connections": 200}})
        with Plc.connect(port=stack.modbus_port) as plc:
            inflate(plc, 8.0)
        yield stack


def bench_modbus(seconds=SECONDS):
    """Print requests/s and round trips, then what calm clients see, alone and beside a flood of garbage."""
    with TemporaryDirectory() as folder, instrument(folder) as stack, rivals(folder) as others:
        program = built(folder, "load")
        servers = {"pneuforce": stack.modbus_port, **others}
        for clients in CLIENTS:
            seen = {name: load(program, port, clients, seconds) for name, port in servers.items()}
            for name, report in seen.items():
                ours = seen["pneuforce"]["requests_per_s"] / report["requests_per_s"]
                print(
                    f"FC4 × 20, {clients:2} clients, {name}: {report['requests_per_s']:6} requests/s, "
                    f"p50 {report['p50_ms']:.3f} ms, p99 {report['p99_ms']:.3f} ms; ours is {ours:.2f} ×"
                )
        _bench_calm(program, stack, seconds)


def _bench_calm(program, stack, seconds):
    before = samples(stack)
    report = load(program, stack.modbus_port, 32, 3 * seconds, (50,))
    print(
        f"32 clients at 50 Hz: p99 {report['p99_ms']:.2f} ms (target 10), worst {report['worst_ms']:.1f} ms"
    )
    flood = [sys.executable, "-m", "tests.bench.flood", str(stack.modbus_port), str(FLOODERS)]
    with listening(flood):
        report = load(program, stack.modbus_port, 1, 3 * seconds, (100,))
    print(
        f"1 client at 100 Hz beside {FLOODERS} peers that send garbage: p99 {report['p99_ms']:.2f} ms "
        f"(target 20), worst {report['worst_ms']:.1f} ms"
    )
    after = samples(stack)
    print(f"rig samples used meanwhile {after - before}")


def samples(stack):
    with Plc.connect(port=stack.modbus_port) as plc:
        return plc.read()["sample_counter"]


if __name__ == "__main__":
    bench_modbus(*map(int, sys.argv[1:]))
