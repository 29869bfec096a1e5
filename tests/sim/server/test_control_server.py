"""Tests of the control server without a process: requests, answers and computing time."""

import json
import socket
import threading
import time
from contextlib import closing, contextmanager

import pytest

from pneuforce.protocol.frames import Identify
from pneuforce.sim.hand import Hand
from pneuforce.sim.plants.published import PublishedPlant
from pneuforce.sim.rig import Rig
from pneuforce.sim.server.control_requests import REQUESTS
from pneuforce.sim.server.control_server import MAX_CLIENTS, ControlServer
from pneuforce.sim.world import World
from tests.sim.server.test_sim_server import ControlClient, MinimalHost, cpu_s, simulator

DIGITS = 10**400


@pytest.fixture
def control():
    with closing(ControlServer(0, World(Rig(PublishedPlant(), Hand(False))))) as control:
        yield control


@contextmanager
def connected(control):
    with closing(socket.create_connection(("127.0.0.1", control.port), timeout=5)) as client:
        control.serve(control.filenos()[:1])
        yield client


def answers(control, client, *requests):
    """Send the requests. Return one answer to each request."""
    client.sendall(b"".join(json.dumps(request).encode() + b"\n" for request in requests))
    client.settimeout(0.001)
    received, until_s = b"", time.monotonic() + 5
    while received.count(b"\n") < len(requests) and time.monotonic() < until_s:
        control.serve(control.filenos()[1:])
        control.publish()
        try:
            received += client.recv(65536)
        except TimeoutError:
            continue
    return [json.loads(line) for line in received.splitlines()]


@pytest.mark.parametrize(
    "invalid",
    [
        {"press": DIGITS},
        {"robot": {"distance_mm": DIGITS}},
        {"robot": {"distance_mm": -1}},
        {"robot": {"tissue": {"law": "hertz", "modulus_kpa": 0}}},
        {"robot": 5},
        {"speed_mm_per_s": 101},
        {"speed_mm_per_s": float("nan")},
        {"speed_mm_per_s": 1},
        {"truth": DIGITS},
        {"contact": {"kind": "press", "force_n": DIGITS}},
        {"contact": {"kind": "press", "force_n": {"from": 0, "to": 1, "step": DIGITS}}},
        {"contact": {"kind": "press", "force_n": {"from": -DIGITS, "to": 1, "step": 1}}},
        {"contact": {"kind": "press", "force_n": {"from": 0, "to": 1, "step": 1e-300}}},
        {"contact": {"kind": "sine", "force_n": 1, "amplitude_n": DIGITS, "frequency_hz": 1}},
        {"contact": {"kind": DIGITS}},
        {"contact": {"kind": "press", "travel_mm": 1, "tissue": {"law": "hertz", "modulus_kpa": DIGITS}}},
        {"fault": {"name": "leak", "kpa_per_s": DIGITS}},
    ],
)
def test_extreme_numbers_are_rejected_with_a_short_error_message(control, invalid):
    with connected(control) as client:
        rejected, alive = answers(control, client, invalid, {"faults": True})
    assert set(rejected) == {"error"}
    assert len(rejected["error"]) < 300
    assert "internal error" not in rejected["error"]
    assert alive == {"faults": []}


def test_an_internal_error_is_answered_and_logged_and_the_next_request_is_executed(
    control, monkeypatch, caplog
):
    def broken(world, value):
        raise ZeroDivisionError("broken")

    monkeypatch.setitem(REQUESTS, "release", REQUESTS["release"]._replace(execute=broken))
    with connected(control) as client:
        failed, alive = answers(control, client, {"release": True}, {"faults": True})
    assert "internal error" in failed["error"]
    assert "ZeroDivisionError" in failed["error"]
    assert '{"release": true}' in caplog.text
    assert alive == {"faults": []}


def test_all_clients_are_answered_in_turn_even_if_one_sends_continuously(control):
    slow = {"contact": {"kind": "tap", "force_n": {"from": 0, "to": 19, "step": 0.02}}}
    with connected(control) as busy, connected(control) as other:
        busy.sendall(5 * (json.dumps(slow).encode() + b"\n"))
        assert answers(control, other, {"faults": True}, {"faults": True}) == 2 * [{"faults": []}]


def test_a_line_in_pieces_is_one_request_and_a_line_that_is_too_long_ends_the_connection(control):
    with connected(control) as client:
        client.sendall(b'{"fau')
        control.serve(control.filenos()[1:])
        client.sendall(b'lts": tr')
        control.serve(control.filenos()[1:])
        client.sendall(b"ue}\n\n \n")
        assert answers(control, client) == []
        control.serve(control.filenos()[1:])
        control.publish()
        assert json.loads(client.recv(4096)) == {"faults": []}
        client.sendall(b"x" * 5000)
        for _ in range(20):
            control.serve(control.filenos()[1:])
        assert len(control.filenos()) == 1


def flood(client, ended):
    client.sendall(b'{"truth": 0}\n')
    while not ended.is_set():
        try:
            client.sendall(b"1\n" * 1000)
            client.recv(65536)
        except OSError:
            return


def test_clients_that_send_continuously_do_not_take_all_of_the_computing_time(tmp_path):
    ended = threading.Event()
    with simulator(tmp_path / "rig", hand=False) as (process, ports):
        host = MinimalHost(ports["port"])
        host.send(Identify())
        assert host.run(2, lambda: host.samples)
        clients = [ControlClient(ports["control"]).connection for _ in range(MAX_CLIENTS // 2)]
        threads = [threading.Thread(target=flood, args=(client, ended)) for client in clients]
        for thread in threads:
            thread.start()
        try:
            start_s, used_s = board_s_of(ports), cpu_s(process.pid)
            time.sleep(1.5)
            board_time_s, used_s = board_s_of(ports) - start_s, cpu_s(process.pid) - used_s
        finally:
            ended.set()
            for client in clients:
                client.close()
            for thread in threads:
                thread.join()
            host.port.close()
    assert used_s / board_time_s < 1.0, (used_s, board_time_s)  # the simulator uses less than one core


def board_s_of(ports):
    """Return the time of the board [s], as reported by the control port."""
    with closing(ControlClient(ports["control"])) as client:
        client.send({"truth": 1})
        return client.read()["t_s"]
