"""Tests of the local socket of a running instrument: entries, requests of the web page, bad clients."""

import os
import signal
import socket
import stat
import subprocess
import sys
import time
from collections import Counter
from contextlib import ExitStack, closing, contextmanager, suppress

import pytest

from pneuforce.instrument.recording.checkpoint import restore_session
from pneuforce.instrument.stream.entry import HEAD, EntryDecoder, EntryKind, StreamEntry, encode, json_entry
from pneuforce.instrument.stream.sample_record import unpack
from pneuforce.protocol.frames import FrameDecoder, Sample
from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.teststand.stack import start
from tests.system.waiting import wait_for

SUBSCRIBE_WEB, SUBSCRIBE_RECORD = (
    encode(json_entry(EntryKind.SUBSCRIBE, 0.0, {"want": name})) for name in ("web", "record")
)


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    folder = tmp_path_factory.mktemp("local")
    with ExitStack() as children:
        yield start(children, folder / "rig", ["--no-hand"]), folder / "pneuforce.sock"


@pytest.fixture(scope="module")
def stack(running):
    return running[0]


@pytest.fixture(scope="module")
def path(running):
    return running[1]


class Client:
    def __init__(self, path, want=None):
        self.link = socket.socket(socket.AF_UNIX)
        self.link.connect(str(path))
        self.link.settimeout(5.0)
        self.decoder, self.received = EntryDecoder(), []
        if want:
            self.send(json_entry(EntryKind.SUBSCRIBE, 0.0, {"want": want}))

    def send(self, entry):
        self.link.sendall(encode(entry))

    def receive(self, seconds=0.0, until=None):
        """Receive for a time, or until an entry of the kind `until`. Return all entries received so far."""
        until_s = time.monotonic() + (seconds or 5.0)
        while time.monotonic() < until_s:
            data = self.link.recv(65536)
            new = self.decoder.feed(data)
            self.received += new
            if not data or any(e.kind is until for e in new):
                break
        return self.received

    def request(self, values, age_s=0.0):
        """Return the answer to a request that is based on a state of the given age."""
        seen_s = time.monotonic() - age_s
        self.send(json_entry(EntryKind.REQUEST, 0.0, {"id": 1, "values": values, "seen_s": seen_s}))
        self.receive(until=EntryKind.ANSWER)
        return [e.json_body for e in self.received if e.kind is EntryKind.ANSWER][-1]


@contextmanager
def connected(path, want=None):
    client = Client(path, want)
    with closing(client.link):
        yield client


def accepts_connections(path):
    with socket.socket(socket.AF_UNIX) as probe:
        return probe.connect_ex(str(path)) == 0


def disconnected(client):
    try:
        while client.link.recv(65536):
            pass
    except ConnectionError:
        pass
    return True


def test_only_the_user_may_connect(path):
    assert stat.S_IMODE(os.stat(path).st_mode) == 0o600


def test_a_recorder_receives_a_checkpoint_and_then_every_sample_in_order(path):
    with connected(path, "record") as recorder:
        entries = recorder.receive(1.5)
    assert [e.kind for e in entries[:2]] == [EntryKind.HEADER, EntryKind.CHECKPOINT]
    restore_session(entries[1].body)
    frames = FrameDecoder.for_board_frames().feed(
        b"".join(e.body for e in entries if e.kind is EntryKind.RECEIVED)
    )
    sent = [frame.sequence for frame in frames if isinstance(frame.message, Sample)]
    measured = [unpack(e.body).sequence for e in entries if e.kind is EntryKind.SAMPLE]
    assert len(measured) > 500
    assert measured[-500:] == [s for s in sent if s in set(measured)][-500:]
    assert set(sent) - set(measured) <= {sent[0], sent[-1]}
    counted = Counter(e.kind for e in entries)
    assert not {EntryKind.SNAPSHOT, EntryKind.HEALTH} & set(counted)
    assert counted[EntryKind.TICK] > 60


def test_the_web_page_receives_snapshots_and_health(stack, path):
    with ModbusClient.connect(port=stack.modbus_port) as plc, connected(path, "web") as web:
        for _ in range(20):
            plc.read()
        entries = web.receive(2.5)
        health = next(e for e in reversed(entries) if e.kind is EntryKind.HEALTH).json_body
        seen = plc.read()
    snapshot = next(e for e in reversed(entries) if e.kind is EntryKind.SNAPSHOT).json_body
    assert snapshot["state"] == seen["state"]
    assert snapshot["pressure_kpa"] == pytest.approx(seen["pressure"], abs=0.02)
    assert health["rig"]["phase"] == "ready"
    assert [c["requests"] for c in health["modbus_tcp"]["clients"]] >= [20]
    assert {f["name"] for f in health["can"]["frames"] if f["out"]} >= {
        "Force",
        "State",
        "Status",
        "Heartbeat",
    }
    assert health["modbus_rtu"] is None


def test_a_request_follows_the_rules_of_every_bus(stack, path):
    with connected(path, "web") as web, ModbusClient.connect(port=stack.modbus_port) as plc:
        wait_for(lambda: plc.read()["status"], lambda seen: "not_zeroed" not in seen)
        assert web.request({"mode": "hold"})["reject_reason"] == "state"  # no setpoint yet
        assert web.request({"mode": "vent"})["reject_reason"] == "none"
        assert web.request({"setpoint_requested": 6.0, "mode": "hold"})["reject_reason"] == "none"
        wait_for(lambda: plc.read()["state"], "holding".__eq__)
        assert web.request({"lease": 60000, "force_limit": 5.0})["reject_reason"] == "none"
        assert plc.read()["lease_holder"] == "web"
        assert web.request({"setpoint_requested": 12.5})["reject_reason"] == "malformed"
        assert web.request({"setpoint_requested": float("nan")})["reject_reason"] == "malformed"
        assert plc.read()["setpoint_requested"] == 6.0
        plc.write("mode", "vent")  # a vent is accepted although another peer holds the lease
        wait_for(lambda: plc.read()["state"], "vented".__eq__)
        web.request({"lease": 0})


def test_a_request_based_on_an_old_state_is_rejected_except_a_vent(stack, path):
    with connected(path, "web") as web, ModbusClient.connect(port=stack.modbus_port) as plc:
        for age_s in (1.6, 20.0, -1.6, 1e9):
            answer = web.request({"setpoint_requested": 7.0}, age_s)
            assert (answer["reject_reason"], "s old" in answer["why"]) == ("malformed", True)
        for seen_s in (None, "1", True, 10**400):
            web.send(
                json_entry(EntryKind.REQUEST, 0.0, {"id": 2, "values": {"mode": "hold"}, "seen_s": seen_s})
            )
            web.receive(until=EntryKind.ANSWER)
            assert [e.json_body["reject_reason"] for e in web.received if e.kind is EntryKind.ANSWER][
                -1
            ] == "malformed"
        assert plc.read()["setpoint_requested"] != 7.0
        assert web.request({"mode": "vent"}, 1e6)["reject_reason"] == "none"
        assert web.request({"mode": 0}, 1e6)["reject_reason"] == "none"


def test_a_flood_of_requests_delays_no_other_client(stack, path):
    request = encode(json_entry(EntryKind.REQUEST, 0.0, {"id": 1, "values": {"mode": "vent"}}))
    with ModbusClient.connect(port=stack.modbus_port) as plc:
        counted = plc.read()["sample_counter"]
        for _ in range(5):
            with connected(path, "web") as web, suppress(OSError):
                web.link.sendall(request * 30_000)
            plc.read()
        assert "link_lost" not in plc.read()["status"]
        assert plc.read()["sample_counter"] > counted
    with connected(path, "web") as web:
        assert web.request({"mode": "vent"})["reject_reason"] == "none"


def test_all_requests_that_may_wait_are_answered(path):
    with connected(path, "web") as web:
        for number in range(30):
            web.send(json_entry(EntryKind.REQUEST, 0.0, {"id": number, "values": {"mode": "vent"}}))
        entries = web.receive(1.0)
    answers = [e.json_body["id"] for e in entries if e.kind is EntryKind.ANSWER]
    assert answers == list(range(30))


def test_a_silent_client_is_disconnected(path):
    with connected(path) as silent:
        start_s = time.monotonic()
        silent.link.settimeout(20.0)
        assert disconnected(silent)
        assert time.monotonic() - start_s > 1.0


def test_a_removed_socket_is_created_again(path):
    path.rename(path.with_name("elsewhere"))
    wait_for(lambda: accepts_connections(path), bool)
    with connected(path, "web") as web:
        assert web.request({"mode": "vent"})["reject_reason"] == "none"


@pytest.mark.parametrize(
    "said",
    [
        b"GET / HTTP/1.1\r\n\r\n",
        bytes(64),
        encode(json_entry(EntryKind.SUBSCRIBE, 0.0, {"want": "everything"})),
        encode(json_entry(EntryKind.SUBSCRIBE, 0.0, ["record"])),
        encode(StreamEntry(EntryKind.SUBSCRIBE, 0.0, b"{")),
        encode(StreamEntry(EntryKind.SUBSCRIBE, 0.0, b"[" * 100_000)),
        encode(StreamEntry(EntryKind.SUBSCRIBE, 0.0, b"\xff\xfe")),
        encode(json_entry(EntryKind.REQUEST, 0.0, {"id": 1, "values": {"mode": "hold"}})),
        SUBSCRIBE_RECORD + encode(json_entry(EntryKind.REQUEST, 0.0, {"values": {}})),
        SUBSCRIBE_WEB + encode(json_entry(EntryKind.REQUEST, 0.0, [1])),
        SUBSCRIBE_WEB * 2,
        encode(StreamEntry(EntryKind.SAMPLE, 0.0, b"")),
        encode(StreamEntry(EntryKind.FAILURE, 0.0, b"false")),
        SUBSCRIBE_WEB + encode(StreamEntry(EntryKind.FAILURE, 0.0, b"false")),
        SUBSCRIBE_WEB + HEAD.pack(20_000, EntryKind.REQUEST, 0.0),
    ],
)
def test_invalid_data_disconnect_only_their_client(stack, path, said):
    with connected(path) as client:
        client.link.sendall(said)
        assert disconnected(client)
    with connected(path, "web") as web:
        assert web.request({"mode": "vent"})["reject_reason"] == "none"
    stack.check()


def test_too_many_clients_do_not_disturb_the_instrument(stack, path):
    with ExitStack() as clients:
        for _ in range(40):
            clients.enter_context(connected(path))
        time.sleep(0.2)
        stack.check()
    time.sleep(0.2)
    with connected(path, "web") as web:
        assert web.request({"mode": "vent"})["reject_reason"] == "none"


def test_a_failed_recording_requires_maintenance_until_the_next_begins(stack, path):
    with ModbusClient.connect(port=stack.modbus_port) as plc:
        with connected(path, "record") as recorder:
            recorder.send(StreamEntry(EntryKind.FAILURE, 0.0, b"the disk is full"))
            wait_for(lambda: plc.read()["status"], lambda seen: "maintenance_required" in seen)
        assert "maintenance_required" in plc.read()["status"]
        assert plc.read()["pressure"] == pytest.approx(0.0, abs=0.5)
        with connected(path, "record") as recorder:
            recorder.receive(until=EntryKind.HEADER)
            wait_for(lambda: plc.read()["status"], lambda seen: "maintenance_required" not in seen)


def test_a_second_instrument_does_not_take_the_socket(path, tmp_path):
    config = tmp_path / "instrument.toml"
    config.write_text(f'[rig]\nport = "/dev/null"\n[local]\nsocket = "{path}"\n')
    second = subprocess.run(
        [sys.executable, "-m", "pneuforce", "run", "--config", str(config)],
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert second.returncode != 0
    assert "another running instrument" in second.stderr
    assert "Traceback" not in second.stderr
    with connected(path, "web") as web:
        assert web.receive(until=EntryKind.HEADER)


def test_the_end_is_sent_and_the_socket_removed(tmp_path):
    with ExitStack() as children:
        stack = start(children, tmp_path / "rig", ["--no-hand"])
        path = tmp_path / "pneuforce.sock"
        with connected(path, "record") as recorder:
            recorder.receive(until=EntryKind.SAMPLE)
            stack.host.send(signal.SIGTERM)
            while recorder.receive(0.5)[-1].kind is not EntryKind.END:
                pass
            kinds = [e.kind for e in recorder.received]
        assert EntryKind.SHUTDOWN in kinds
        assert recorder.received[-1].json_body["why"]
        wait_for(path.exists, lambda exists: not exists)
