"""Benchmark of Modbus/TCP Security: `python -m tests.bench modbus_security`.

It measures the gaps between the commands to the board during 200 bad handshakes per second, and the time of a
request with and without TLS.
"""

import json
import os
import socket
import ssl
import subprocess
import sys
import time
from contextlib import ExitStack, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from pneuforce.instrument.commissioning.certificates import new_authority, new_client
from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.stack import free_port, toml
from tests.bench.keep_alive import gaps_ms as gaps_between
from tests.bench.keep_alive import start_relayed_rig
from tests.bench.latency import percentile
from tests.registers.modbus.serving import eventually, send_request
from tests.registers.modbus_security.serving import Pki

RATE_HZ = 200
SECONDS, BRIEF_SECONDS = 30.0, 1.0
REQUESTS, BRIEF_REQUESTS = 2000, 50
FORCE = "0001 0000 0006 01 04 0000 0002"


def client_context(folder):
    """Return the context of a client with a certificate of another authority."""
    context = ssl.create_default_context(cafile=folder / "ca.pem")
    context.load_cert_chain(folder / "foreign.pem", folder / "foreign.key")
    return context


def attack(port, context, seconds):
    """Attempt RATE_HZ handshakes per second that fail. Print the number."""
    begun_s, attempts = time.monotonic(), 0
    while (elapsed_s := time.monotonic() - begun_s) < seconds:
        if attempts > elapsed_s * RATE_HZ:
            time.sleep(0.001)
            continue
        attempts += 1
        with suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=10) as plain:
            context.wrap_socket(plain, server_hostname="localhost").recv(1)
    print(attempts)


def bench_modbus_security(brief=False):
    """Print the gaps between the commands, and the time of a request over TLS as a ratio."""
    seconds, count = (BRIEF_SECONDS, BRIEF_REQUESTS) if brief else (SECONDS, REQUESTS)
    with TemporaryDirectory() as name, ExitStack() as stack:
        folder = Path(name)
        pki = Pki(folder)
        pki.client("plc", "operator")
        pki.write("foreign", new_client(new_authority("other", pki.now), "plc", "operator", pki.now, 10))
        plain_port, secure_port = free_port(), free_port()
        relay, rig_port = start_relayed_rig(stack, folder / "rig")
        files = {"ca": "ca.pem", "certificate": "instrument.pem", "key": "instrument.key"}
        tables = {
            "rig": {"port": rig_port},
            "modbus": {"port": plain_port},
            "modbus_security": {"enabled": True, "port": secure_port, **files},
            "local": {"socket": "pneuforce.sock"},
        }
        file = folder / "instrument.toml"
        file.write_text(toml(tables))
        stack.enter_context(ChildProcess("host", ["pneuforce", "run", "--config", str(file)])).ready()
        _print_times(pki, plain_port, secure_port, count)
        quiet = measured(lambda: time.sleep(seconds))
        words = [sys.executable, "-m", "tests.bench.modbus_security", str(secure_port), name, str(seconds)]
        attacked = measured(lambda: int(subprocess.run(words, check=True, capture_output=True).stdout))
        heard_s = commands_heard_s(relay)
    print_gaps("without handshakes", quiet, heard_s)
    print_gaps(f"with {attacked['result'] / seconds:.0f} bad handshakes per s", attacked, heard_s)
    print(f"load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


def commands_heard_s(relay):
    """End a relay. Return the times at which commands passed."""
    return json.loads(relay.communicate("end\n")[0])["heard_s"]


def measured(work):
    """Return the result of a function, and the times of its begin and its end."""
    begun_s = time.monotonic()
    return {"result": work(), "begun_s": begun_s, "ended_s": time.monotonic()}


def _print_times(pki, plain_port, secure_port, count):
    with socket.create_connection(("127.0.0.1", plain_port), timeout=10) as plain:
        plain_ms = _times_ms(plain, count)
    assert eventually(lambda: socket.socket().connect_ex(("127.0.0.1", secure_port)) == 0)
    with socket.create_connection(("127.0.0.1", secure_port), timeout=10) as raw:
        secure_ms = _times_ms(pki.context("plc").wrap_socket(raw, server_hostname="localhost"), count)
    for name, times_ms in (("Modbus TCP", plain_ms), ("Modbus/TCP Security", secure_ms)):
        p50, p99 = percentile(times_ms, 0.5), percentile(times_ms, 0.99)
        print(f"{name}: {count} requests, p50 {p50:.2f} ms, p99 {p99:.2f} ms")
    print(f"ratio of the medians {percentile(secure_ms, 0.5) / percentile(plain_ms, 0.5):.1f}")


def _times_ms(client, count):
    times_ms = []
    for _ in range(count):
        begun_s = time.perf_counter()
        assert send_request(client, FORCE)
        times_ms.append((time.perf_counter() - begun_s) * 1e3)
    return sorted(times_ms)


def print_gaps(name, phase, heard_s):
    """Print the gaps between the commands that were heard during a phase."""
    gaps_ms = gaps_between([t for t in heard_s if phase["begun_s"] <= t <= phase["ended_s"]]) or [0.0]
    print(
        f"{name}: gaps between {len(gaps_ms)} commands: median {percentile(gaps_ms, 0.5):.1f} ms, "
        f"p99 {percentile(gaps_ms, 0.99):.1f} ms, longest {gaps_ms[-1]:.1f} ms (the inlet closes at 250)"
    )


if __name__ == "__main__":
    attack(int(sys.argv[1]), client_context(Path(sys.argv[2])), float(sys.argv[3]))
