"""The control server alone, in virtual time: what clients send, what they are answered, and what it costs."""

import json
import socket
import threading
import time
from contextlib import closing, contextmanager

import pytest

from instrument.rig.frames import Identify
from sim.control import MOST_CLIENTS, Control
from sim.hand import Hand
from sim.orders import ORDERS
from sim.published import PublishedPlant
from sim.rig import Rig
from sim.world import World
from tests.sim.test_sim_server import Control as Client
from tests.sim.test_sim_server import Host, cpu_s, simulator

DIGITS = 10**400


@pytest.fixture
def control():
    with closing(Control(0, World(Rig(PublishedPlant(), Hand(False))))) as control:
        yield control


@contextmanager
def connected(control):
    with closing(socket.create_connection(("127.0.0.1", control.port), timeout=5)) as client:
        control.serve(control.filenos()[:1])
        yield client


def answers(control, client, *requests):
    """One answer to each request."""
    client.sendall(b"".join(json.dumps(request).encode() + b"\n" for request in requests))
    client.settimeout(0.001)
    heard, until_s = b"", time.monotonic() + 5
    while heard.count(b"\n") < len(requests) and time.monotonic() < until_s:
        control.serve(control.filenos()[1:])
        control.publish()
        try:
            heard += client.recv(65536)
        except TimeoutError:
            continue
    return [json.loads(line) for line in heard.splitlines()]


@pytest.mark.parametrize(
    "order",
    [
        {"press": DIGITS},
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
def test_numbers_beyond_all_measure_are_refused_in_a_short_sentence(control, order):
    with connected(control) as client:
        refused, alive = answers(control, client, order, {"faults": True})
    assert set(refused) == {"error"}
    assert len(refused["error"]) < 300
    assert "error of the simulator" not in refused["error"]
    assert alive == {"faults": []}


def test_an_order_that_ends_in_an_error_of_ours_is_answered_and_logged_and_the_next_is_obeyed(
    control, monkeypatch, caplog
):
    def broken(world, value):
        raise ZeroDivisionError("of ours")

    monkeypatch.setitem(ORDERS, "release", ORDERS["release"]._replace(act=broken))
    with connected(control) as client:
        failed, alive = answers(control, client, {"release": True}, {"faults": True})
    assert "error of the simulator's own, which it has survived: ZeroDivisionError" in failed["error"]
    assert '{"release": true}' in caplog.text
    assert alive == {"faults": []}


def test_everyone_is_answered_in_turn_though_one_talks_without_end(control):
    slow = {"contact": {"kind": "tap", "force_n": {"from": 0, "to": 19, "step": 0.02}}}
    with connected(control) as talker, connected(control) as other:
        talker.sendall(5 * (json.dumps(slow).encode() + b"\n"))
        assert answers(control, other, {"faults": True}, {"faults": True}) == 2 * [{"faults": []}]


def test_a_line_that_comes_in_pieces_is_one_order_and_one_without_end_is_dropped(control):
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
    while not ended.is_set():
        try:
            client.sendall(b"1\n" * 1000)
            client.recv(65536)
        except OSError:
            return


def test_clients_that_send_without_end_cost_the_rig_a_share_of_its_time_and_no_more(tmp_path):
    ended = threading.Event()
    with simulator(tmp_path / "rig", hand=False) as (process, told):
        host = Host(told["port"])
        host.send(Identify())
        assert host.run(2, lambda: host.samples)
        clients = [Client(told["control"]).connection for _ in range(MOST_CLIENTS // 2)]
        threads = [threading.Thread(target=flood, args=(client, ended)) for client in clients]
        for thread in threads:
            thread.start()
        try:
            begun_s, used_s = board_s_of(told), cpu_s(process.pid)
            time.sleep(1.5)
            board_time_s, used_s = board_s_of(told) - begun_s, cpu_s(process.pid) - used_s
        finally:
            ended.set()
            for client in clients:
                client.close()
            for thread in threads:
                thread.join()
            host.port.close()
    assert used_s / board_time_s < 1.0, (used_s, board_time_s)  # of a core


def board_s_of(told):
    """The board's time, by the truth."""
    with closing(Client(told["control"])) as client:
        client.ask({"truth": 1})
        return client.line()["t_s"]
