"""Benchmark of the web page over HTTPS: `python -m tests.bench https`.

It measures the gaps between the commands to the board during 200 bad handshakes per second, and the time of a
vent with and without TLS. The page never delays a vent, and serves vents also without TLS.
"""

import os
import ssl
import subprocess
import sys
import time
from contextlib import ExitStack, closing
from http.client import HTTPConnection, HTTPSConnection
from pathlib import Path
from tempfile import TemporaryDirectory

from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.stack import free_port, toml
from tests.bench.keep_alive import start_relayed_rig
from tests.bench.latency import percentile
from tests.bench.modbus_security import attack, commands_heard_s, measured, print_gaps
from tests.registers.modbus_security.serving import Pki

SECONDS, BRIEF_SECONDS = 30.0, 1.0
REQUESTS, BRIEF_REQUESTS = 500, 20


def bench_https(brief=False):
    """Print the time of a request over HTTP and HTTPS, and the gaps between the commands to the board."""
    seconds, count = (BRIEF_SECONDS, BRIEF_REQUESTS) if brief else (SECONDS, REQUESTS)
    with TemporaryDirectory() as name, ExitStack() as stack:
        folder = Path(name)
        pki, port = Pki(folder), free_port()
        relay, rig_port = start_relayed_rig(stack, folder / "rig")
        tables = {
            "rig": {"port": rig_port},
            "modbus": {"port": free_port()},
            "web": {"enabled": True, "port": port, "recordings": "", **pki.own},
            "local": {"socket": "pneuforce.sock"},
        }
        file = folder / "instrument.toml"
        file.write_text(toml(tables))
        stack.enter_context(ChildProcess("host", ["pneuforce", "run", "--config", str(file)])).ready()
        _print_times(pki, port, count)
        quiet = measured(lambda: time.sleep(seconds))
        words = [sys.executable, "-m", "tests.bench.https", str(port), str(seconds)]
        attacked = measured(lambda: int(subprocess.run(words, check=True, capture_output=True).stdout))
        heard_s = commands_heard_s(relay)
    print_gaps("without handshakes", quiet, heard_s)
    print_gaps(f"with {attacked['result'] / seconds:.0f} bad handshakes per s", attacked, heard_s)
    print(f"load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


def _print_times(pki, port, count):
    options = {"port": port, "timeout": 10}
    connections = {
        "HTTP": lambda: closing(HTTPConnection("localhost", **options)),
        "HTTPS": lambda: closing(HTTPSConnection("localhost", context=pki.context(), **options)),
    }
    for name, connect in connections.items():
        with connect() as connection:
            kept_ms = sorted(_vent_ms(connection) for _ in range(count))
        new_ms = []
        for _ in range(count):
            with connect() as connection:
                new_ms.append(_vent_ms(connection))
        for what, times_ms in (("one connection", kept_ms), ("new connections", sorted(new_ms))):
            p50, p99 = percentile(times_ms, 0.5), percentile(times_ms, 0.99)
            print(f"{name}: {count} vents over {what}, p50 {p50:.2f} ms, p99 {p99:.2f} ms")


def _vent_ms(connection):
    begun_s = time.perf_counter()
    connection.request("POST", "/api/vent")
    answer = connection.getresponse()
    answer.read()
    assert answer.status == 200
    return (time.perf_counter() - begun_s) * 1e3


if __name__ == "__main__":
    attack(int(sys.argv[1]), ssl.create_default_context(), float(sys.argv[2]))
