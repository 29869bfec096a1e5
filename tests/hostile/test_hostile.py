"""Tests of the hostile cases.

The instrument passes all cases. Defective servers fail all cases that consist of steps.
"""

import os
import re
import socket
import threading
from collections import Counter
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from tests.hostile.__main__ import run_all
from tests.hostile.cases import CASES
from tests.hostile.connection import ServerUnderTest
from tests.hostile.runner import FAIL, PASS, run_case
from tests.registers.modbus.serving import eventually

LIMITS = {"frame_timeout_s": 0.5, "idle_timeout_s": 1.0}
MAX_GROWTH_KB = 20_000
STEP_CASES = [case for case in CASES if not case.run]


@pytest.mark.pneuforce(instrument={"modbus": LIMITS})
def test_the_instrument_passes_every_case_without_leaking_files_or_memory(pneuforce_rig):
    server = ServerUnderTest(
        port=pneuforce_rig.modbus_port, answer_timeout_s=10.0, is_pneuforce_server=True, **LIMITS
    )
    assert server.shows_test_pattern()
    process = owner_of(server.port)
    before, before_kb = descriptors(process), resident_kb(process)
    results = run_all(server)
    assert [(o.case.name, o.case.expected, o.got) for o in results if o.verdict != PASS] == []
    assert len(results) == len(CASES)
    assert eventually(lambda: descriptors(process) <= before)
    assert resident_kb(process) - before_kb < MAX_GROWTH_KB
    pneuforce_rig.inflate(5.0)


def owner_of(port):
    """Return the id of the process that listens on a port of the loopback interface."""
    hex_port = f"0100007F:{port:04X} 00000000:0000 0A"
    with open("/proc/net/tcp") as table:
        inode = next(line.split()[9] for line in table if hex_port in line)
    return next(
        pid for pid in filter(str.isdigit, os.listdir("/proc")) if f"socket:[{inode}]" in open_files(pid)
    )


def open_files(pid):
    try:
        return [os.readlink(f"/proc/{pid}/fd/{fd}") for fd in os.listdir(f"/proc/{pid}/fd")]
    except OSError:  # a process of another user, or a process that has ended
        return []


def descriptors(pid):
    return len(os.listdir(f"/proc/{pid}/fd"))


def resident_kb(pid):
    with open(f"/proc/{pid}/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmRSS:"))


def never_answers(client):
    while client.recv(65536):
        pass


def echoes_requests(client):
    while data := client.recv(65536):
        client.sendall(data)


def closes_at_once(client):
    client.recv(1)


@contextmanager
def defective_server(behaviour):
    """Run a server with the given behaviour towards each client."""

    def serve(client):
        with client, suppress(OSError):
            behaviour(client)

    def accept():
        while True:
            try:
                client, _ = listener.accept()
            except OSError:
                return
            threading.Thread(target=serve, args=(client,), daemon=True).start()

    with socket.create_server(("127.0.0.1", 0), backlog=128) as listener:
        threading.Thread(target=accept, daemon=True).start()
        yield ServerUnderTest(
            port=listener.getsockname()[1],
            answer_timeout_s=0.02,
            frame_timeout_s=0.02,
            is_pneuforce_server=True,
        )


@pytest.mark.parametrize("behaviour", [never_answers, echoes_requests, closes_at_once])
def test_a_defective_server_passes_no_case(behaviour):
    with defective_server(behaviour) as server:
        assert {case.name for case in STEP_CASES if run_case(case, server).verdict != FAIL} == set()


def test_names_of_cases_are_unique():
    names = [(case.group, case.name) for case in CASES]
    assert len(set(names)) == len(names)


def test_the_page_contains_these_cases():
    page = (Path(__file__).parents[2] / "docs/hostile.md").read_text(encoding="utf-8")
    generic = Counter(case.group for case in CASES if not case.needs_pneuforce)
    listed = re.findall(r"### (.*)\n\n(\d+) cases", page)
    assert {group.lower(): int(count) for group, count in listed} == generic
    assert f"The {generic.total()} cases below" in page
