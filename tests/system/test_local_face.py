"""The local socket: page and recorders get the feed, the page's requests are a bus's, guests do no harm."""

import json
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

from instrument.rig.frames import Decoder as FrameDecoder
from instrument.rig.frames import Sample
from instrument.tape.checkpoint import thaw
from instrument.tape.entry import HEAD, Decoder, Entry, Kind, encode, told
from instrument.tape.measured import unpack
from registers.modbus.client import Plc
from tests.system.waiting import wait_for
from teststand.stack import start


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


class Guest:
    def __init__(self, path, want=None):
        self.link = socket.socket(socket.AF_UNIX)
        self.link.connect(str(path))
        self.link.settimeout(5.0)
        self.decoder, self.heard = Decoder(), []
        if want:
            self.say(told(Kind.WANT, 0.0, {"want": want}))

    def say(self, entry):
        self.link.sendall(encode(entry))

    def listen(self, seconds=0.0, to=None):
        """All that comes in some seconds, or until an entry of a kind has come."""
        until_s = time.monotonic() + (seconds or 5.0)
        while time.monotonic() < until_s:
            data = self.link.recv(65536)
            new = self.decoder.feed(data)
            self.heard += new
            if not data or any(e.kind is to for e in new):
                break
        return self.heard

    def ask(self, values, decided_s=0.0):
        """What is answered to a request that was decided upon so long ago."""
        seen_s = time.monotonic() - decided_s
        self.say(told(Kind.REQUEST, 0.0, {"id": 1, "values": values, "seen_s": seen_s}))
        self.listen(to=Kind.ANSWER)
        return [e.facts for e in self.heard if e.kind is Kind.ANSWER][-1]


@contextmanager
def guest(path, want=None):
    came = Guest(path, want)
    with closing(came.link):
        yield came


def turned_away(guest):
    try:
        while guest.link.recv(65536):
            pass
    except ConnectionError:
        pass
    return True


def test_the_socket_is_its_users_alone(path):
    assert stat.S_IMODE(os.stat(path).st_mode) == 0o600


def test_a_recorder_gets_every_sample_in_order_and_a_checkpoint_before(path):
    with guest(path, "record") as recorder:
        heard = recorder.listen(1.5)
    assert [e.kind for e in heard[:2]] == [Kind.BEGIN, Kind.CHECKPOINT]
    thaw(heard[1].body)
    came = FrameDecoder.of_board().feed(b"".join(e.body for e in heard if e.kind is Kind.RECEIVED))
    sent = [frame.sequence for frame in came if isinstance(frame.message, Sample)]
    measured = [unpack(e.body).sequence for e in heard if e.kind is Kind.MEASURED]
    assert len(measured) > 500
    assert measured[-500:] == [s for s in sent if s in set(measured)][-500:]
    assert set(sent) - set(measured) <= {sent[0], sent[-1]}
    counted = Counter(e.kind for e in heard)
    assert not {Kind.SNAPSHOT, Kind.HEALTH} & set(counted)
    assert counted[Kind.BEAT] > 60


def test_the_page_gets_snapshots_and_health(stack, path):
    with Plc.connect(port=stack.modbus_port) as plc, guest(path, "page") as page:
        for _ in range(20):
            plc.read()
        heard = page.listen(2.5)
        health = next(e for e in reversed(heard) if e.kind is Kind.HEALTH).facts
        seen = plc.read()
    snapshot = next(e for e in reversed(heard) if e.kind is Kind.SNAPSHOT).facts
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


def test_the_begin_masks_the_operators_token(tmp_path):
    from instrument.cli.begin import begin_of
    from instrument.config import parse

    secret = "correct-horse-battery"
    own = parse({"page": {"token": secret}}, "test")
    assert secret not in json.dumps(begin_of(own, simulated=False, faults=()))


def test_a_request_obeys_the_rules_of_every_bus(stack, path):
    with guest(path, "page") as page, Plc.connect(port=stack.modbus_port) as plc:
        wait_for(lambda: plc.read()["status"], lambda seen: "not_zeroed" not in seen)
        assert page.ask({"mode": "hold"})["refusal"] == "state"  # no setpoint yet
        assert page.ask({"mode": "vent"})["refusal"] == "none"
        assert page.ask({"setpoint_requested": 6.0, "mode": "hold"})["refusal"] == "none"
        wait_for(lambda: plc.read()["state"], "holding".__eq__)
        assert page.ask({"lease": 60000, "force_limit": 5.0})["refusal"] == "none"
        assert plc.read()["lease_holder"] == "page"
        assert page.ask({"setpoint_requested": 12.5})["refusal"] == "malformed"
        assert page.ask({"setpoint_requested": float("nan")})["refusal"] == "malformed"
        assert plc.read()["setpoint_requested"] == 6.0
        plc.write("mode", "vent")  # of whoever it is, whoever holds the lease
        wait_for(lambda: plc.read()["state"], "vented".__eq__)
        page.ask({"lease": 0})


def test_an_order_that_was_decided_upon_long_ago_is_not_carried_out_but_a_vent_is(stack, path):
    with guest(path, "page") as page, Plc.connect(port=stack.modbus_port) as plc:
        for decided_s in (1.6, 20.0, -1.6, 1e9):
            answer = page.ask({"setpoint_requested": 7.0}, decided_s)
            assert (answer["refusal"], "s old" in answer["why"]) == ("malformed", True)
        for seen_s in (None, "1", True, 10**400):
            page.say(told(Kind.REQUEST, 0.0, {"id": 2, "values": {"mode": "hold"}, "seen_s": seen_s}))
            page.listen(to=Kind.ANSWER)
            assert [e.facts["refusal"] for e in page.heard if e.kind is Kind.ANSWER][-1] == "malformed"
        assert plc.read()["setpoint_requested"] != 7.0
        assert page.ask({"mode": "vent"}, 1e6)["refusal"] == "none"
        assert page.ask({"mode": 0}, 1e6)["refusal"] == "none"


def test_a_flood_of_requests_delays_nobody(stack, path):
    request = encode(told(Kind.REQUEST, 0.0, {"id": 1, "values": {"mode": "vent"}}))
    with Plc.connect(port=stack.modbus_port) as plc:
        counted = plc.read()["sample_counter"]
        for _ in range(5):
            with guest(path, "page") as page, suppress(OSError):
                page.link.sendall(request * 30_000)
            plc.read()
        assert "link_lost" not in plc.read()["status"]
        assert plc.read()["sample_counter"] > counted
    with guest(path, "page") as page:
        assert page.ask({"mode": "vent"})["refusal"] == "none"


def test_as_many_requests_as_may_wait_are_all_answered(path):
    with guest(path, "page") as page:
        for number in range(30):
            page.say(told(Kind.REQUEST, 0.0, {"id": number, "values": {"mode": "vent"}}))
        heard = page.listen(1.0)
    answers = [e.facts["id"] for e in heard if e.kind is Kind.ANSWER]
    assert answers == list(range(30))


def test_who_says_nothing_is_let_go(path):
    with guest(path) as silent:
        begun_s = time.monotonic()
        silent.link.settimeout(20.0)
        assert turned_away(silent)
        assert time.monotonic() - begun_s > 1.0


def test_a_name_that_was_taken_away_is_had_again(path):
    path.rename(path.with_name("elsewhere"))
    wait_for(path.exists, bool)
    with guest(path, "page") as page:
        assert page.ask({"mode": "vent"})["refusal"] == "none"


@pytest.mark.parametrize(
    "said",
    [
        b"GET / HTTP/1.1\r\n\r\n",
        bytes(64),
        encode(told(Kind.WANT, 0.0, {"want": "everything"})),
        encode(told(Kind.WANT, 0.0, ["record"])),
        encode(Entry(Kind.WANT, 0.0, b"{")),
        encode(Entry(Kind.WANT, 0.0, b"[" * 100_000)),
        encode(Entry(Kind.WANT, 0.0, b"\xff\xfe")),
        encode(told(Kind.REQUEST, 0.0, {"id": 1, "values": {"mode": "hold"}})),
        encode(told(Kind.WANT, 0.0, {"want": "record"})) + encode(told(Kind.REQUEST, 0.0, {"values": {}})),
        encode(told(Kind.WANT, 0.0, {"want": "page"})) + encode(told(Kind.REQUEST, 0.0, [1])),
        encode(told(Kind.WANT, 0.0, {"want": "page"})) * 2,
        encode(Entry(Kind.MEASURED, 0.0, b"")),
        encode(Entry(Kind.TROUBLE, 0.0, b"a lie")),
        encode(told(Kind.WANT, 0.0, {"want": "page"})) + encode(Entry(Kind.TROUBLE, 0.0, b"a lie")),
        encode(told(Kind.WANT, 0.0, {"want": "page"})) + HEAD.pack(20_000, Kind.REQUEST, 0.0),
    ],
)
def test_who_says_anything_else_is_turned_away_and_the_instrument_goes_on(stack, path, said):
    with guest(path) as stranger:
        stranger.link.sendall(said)
        assert turned_away(stranger)
    with guest(path, "page") as page:
        assert page.ask({"mode": "vent"})["refusal"] == "none"
    stack.check()


def test_a_crowd_harms_nobody_and_leaves_room_when_it_has_gone(stack, path):
    with ExitStack() as crowd:
        for _ in range(40):
            crowd.enter_context(guest(path))
        time.sleep(0.2)
        stack.check()
    time.sleep(0.2)
    with guest(path, "page") as page:
        assert page.ask({"mode": "vent"})["refusal"] == "none"


def test_a_recorder_that_fails_asks_for_maintenance_until_the_next_begins(stack, path):
    with Plc.connect(port=stack.modbus_port) as plc:
        with guest(path, "record") as recorder:
            recorder.say(Entry(Kind.TROUBLE, 0.0, b"the disk is full"))
            wait_for(lambda: plc.read()["status"], lambda seen: "maintenance" in seen)
        assert "maintenance" in plc.read()["status"]
        assert plc.read()["pressure"] == pytest.approx(0.0, abs=0.5)
        with guest(path, "record") as recorder:
            recorder.listen(to=Kind.BEGIN)
            wait_for(lambda: plc.read()["status"], lambda seen: "maintenance" not in seen)


def test_a_second_instrument_does_not_take_the_socket_of_one_that_runs(path, tmp_path):
    config = tmp_path / "instrument.toml"
    config.write_text(f'[rig]\nport = "/dev/null"\n[local]\nsocket = "{path}"\n')
    second = subprocess.run(
        [sys.executable, "-m", "instrument", "run", "--config", str(config)],
        capture_output=True, text=True, timeout=20,
    )  # fmt: skip
    assert second.returncode != 0
    assert "another running instrument" in second.stderr
    assert "Traceback" not in second.stderr
    with guest(path, "page") as page:
        assert page.listen(to=Kind.BEGIN)


def test_the_end_is_told_and_the_socket_gone(tmp_path):
    with ExitStack() as children:
        own = start(children, tmp_path / "rig", ["--no-hand"])
        path = tmp_path / "pneuforce.sock"
        with guest(path, "record") as recorder:
            recorder.listen(to=Kind.MEASURED)
            own.host.send(signal.SIGTERM)
            while recorder.listen(0.5)[-1].kind is not Kind.END:
                pass
            kinds = [e.kind for e in recorder.heard]
        assert Kind.LEAVING in kinds
        assert recorder.heard[-1].facts["why"]
        wait_for(path.exists, lambda there: not there)
