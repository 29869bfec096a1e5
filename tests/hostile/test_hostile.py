"""Every hostile case against the instrument as it is sold, and no case that any bad server passes."""

import os
import re
import socket
import threading
from collections import Counter
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from tests.hostile.__main__ import play_all
from tests.hostile.cases import CASES
from tests.hostile.line import Server
from tests.hostile.play import FAIL, PASS, played
from tests.registers.modbus.serving import eventually

LIMITS = {"frame_s": 0.5, "idle_s": 1.0}
MOST_GROWTH_KB = 20_000
SCRIPTED = [case for case in CASES if not case.play]


@pytest.mark.pneuforce(instrument={"modbus": LIMITS})
def test_every_case_is_passed_and_nothing_is_left_behind(pneuforce_rig):
    server = Server(port=pneuforce_rig.modbus_port, patience_s=10.0, ours=True, **LIMITS)
    assert server.is_pneuforce()
    process = owner_of(server.port)
    before, before_kb = descriptors(process), resident_kb(process)
    outcomes = play_all(server)
    assert [(o.case.name, o.case.expected, o.got) for o in outcomes if o.verdict != PASS] == []
    assert len(outcomes) == len(CASES)
    assert eventually(lambda: descriptors(process) <= before)
    assert resident_kb(process) - before_kb < MOST_GROWTH_KB
    pneuforce_rig.inflate(5.0)


def owner_of(port):
    """The process that listens on a port of the loopback."""
    hex_port = f"0100007F:{port:04X} 00000000:0000 0A"
    with open("/proc/net/tcp") as table:
        inode = next(line.split()[9] for line in table if hex_port in line)
    return next(pid for pid in filter(str.isdigit, os.listdir("/proc")) if f"socket:[{inode}]" in opened(pid))


def opened(pid):
    try:
        return [os.readlink(f"/proc/{pid}/fd/{fd}") for fd in os.listdir(f"/proc/{pid}/fd")]
    except OSError:  # not ours, or gone
        return []


def descriptors(pid):
    return len(os.listdir(f"/proc/{pid}/fd"))


def resident_kb(pid):
    with open(f"/proc/{pid}/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmRSS:"))


def says_nothing(client):
    while client.recv(65536):
        pass


def echoes(client):
    while data := client.recv(65536):
        client.sendall(data)


def closes(client):
    client.recv(1)


@contextmanager
def bad(behaviour):
    """A server that does one wrong thing with each client."""

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
        yield Server(port=listener.getsockname()[1], patience_s=0.02, frame_s=0.02, ours=True)


@pytest.mark.parametrize("behaviour", [says_nothing, echoes, closes])
def test_no_case_is_passed_by_a_bad_server(behaviour):
    with bad(behaviour) as server:
        assert {case.name for case in SCRIPTED if played(case, server).verdict != FAIL} == set()


def test_cases_have_names_of_their_own():
    names = [(case.group, case.name) for case in CASES]
    assert len(set(names)) == len(names)


def test_the_page_was_measured_with_these_cases():
    page = (Path(__file__).parents[2] / "docs/hostile.md").read_text(encoding="utf-8")
    generic = Counter(case.group for case in CASES if not case.ours)
    told = re.findall(r"### (.*)\n\n(\d+) cases", page)
    assert {group.lower(): int(count) for group, count in told} == generic
    assert f"The {generic.total()} cases below" in page
