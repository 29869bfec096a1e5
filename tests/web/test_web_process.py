"""The page as the process that the host starts."""

import contextlib
import http.client
import json
import os
import select
import signal
import socket
import struct
import time
from pathlib import Path

import pytest

from registers.modbus.client import Plc
from tests.page.entries import begin, snapshot
from tests.page.process import ask, browser, page
from tests.page.serving import TOKEN, Station, until
from tests.system.waiting import inflate, wait_for
from teststand.stack import free_port, start

END = [
    pytest.param(lambda process: process.stdin.close(), id="its stdin ends"),
    pytest.param(lambda process: process.send_signal(signal.SIGTERM), id="SIGTERM"),
]


@pytest.mark.parametrize("end", END)
def test_it_ends_at_once_though_browsers_listen(station, end):
    with page(socket=str(station.path)) as (process, ready), browser(ready["page"]) as stream:
        assert next(stream)[0] == "link"
        end(process)
        assert process.wait(5) == 0
        assert list(stream) is not None  # the stream has an end, too
        assert process.stderr.read() == ""


def beat(process):
    return json.loads(process.stdout.readline())["beat"]


def test_a_page_that_hangs_is_silent_and_one_that_runs_is_not():
    with page() as (process, _):
        assert [beat(process), beat(process)] == [1, 2]
        process.send_signal(signal.SIGSTOP)
        while select.select([process.stdout], [], [], 1.5)[0]:
            beat(process)
        process.send_signal(signal.SIGCONT)
        assert beat(process) > 2


def test_it_serves_on_when_nobody_hears_it():
    with page() as (process, ready):
        pipe = os.open(f"/proc/{process.pid}/fd/1", os.O_WRONLY | os.O_NONBLOCK)
        with contextlib.suppress(BlockingIOError):
            while os.write(pipe, b"x" * 4096):
                pass
        os.close(pipe)
        for nobody in (lambda: None, process.stdout.close):
            nobody()
            time.sleep(1.5)  # past a beat
            assert ask(ready["page"], "GET", "/api/about")[0] == 200


def test_a_taken_port_is_said_in_a_sentence():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with page(port=port) as (process, ready):
            assert ready["page"] is None
            why = "it is in use by another program; change [page] port"
            assert ready["why"] == f"the page cannot listen on 127.0.0.1:{port}: {why}"
            assert process.wait(5) == 1


def test_it_waits_for_an_instrument_that_comes_later(tmp_path):
    with page(socket=str(tmp_path / "late.sock")) as (_, ready), browser(ready["page"]) as stream:
        assert "does not run here" in until(stream, "link", lambda link: "run" in link["why"])["why"]
        station = Station(tmp_path / "late.sock")
        wait_for(lambda: station.wanted, bool)
        station.say(begin(), snapshot(time.monotonic()))
        assert until(stream, "link")["up"] is True
        station.close()


# ---- on a real instrument


class Rig:
    """A simulated rig, its instrument, and the page."""

    def __init__(self, children, folder):
        self.port = free_port()
        page = {"enabled": True, "port": self.port, "token": TOKEN}
        self.stack = start(children, folder / "rig", ["--no-hand"], {"page": page})

    def plc(self):
        return Plc.connect(port=self.stack.modbus_port)

    def connect(self):
        return http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)

    def page_pid(self):
        """The process of the page, None where there is none now."""
        host = self.stack.host.pid
        pids = Path(f"/proc/{host}/task/{host}/children").read_text().split()
        return next((int(pid) for pid in pids if command_of(pid).endswith("-m page")), None)


def command_of(pid):
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ").strip()
    return ""


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    with contextlib.ExitStack() as children:
        yield Rig(children, tmp_path_factory.mktemp("page"))


def test_the_page_shows_what_a_plc_reads_and_its_vent_vents(rig):
    with rig.plc() as plc, browser(rig.port) as stream:
        held = inflate(plc, 8.0)
        state = until(stream, "state", lambda state: state["state"] == "holding")
        assert state["pressure_kpa"] == pytest.approx(held["pressure"], abs=0.1)
        assert state["setpoint_kpa"] == held["setpoint"] == 8.0
        words = ask(rig.port, "GET", "/api/registers")[1]["blocks"][1]["words"]
        assert struct.unpack(">f", struct.pack(">HH", *words[:2])) == (8.0,)
        assert ask(rig.port, "POST", "/api/vent", {}) == (200, {"refusal": "none", "text": "Accepted."})
        wait_for(plc.read, lambda registers: registers["state"] == "vented")
        assert (
            "page: mode hold → vent: accepted"
            in until(stream, "event", lambda e: "vent" in e["text"])["text"]
        )


def test_an_operator_obeys_the_rules_of_a_plc(rig):
    def write(**values):
        return ask(rig.port, "POST", "/api/write", order(values))

    with rig.plc() as plc:
        wait_for(plc.read, lambda v: "not_zeroed" not in v["status"] and "vented" in v["status"])
        plc.write("lease", 5.0)
        status, answer = write(setpoint_requested=6.0)
        assert (status, answer["refusal"]) == (200, "lease")
        assert answer["text"].startswith("Somebody else holds the lease")
        plc.write("lease", 0)
        assert write(mode="vent")[1]["refusal"] == "none"
        assert write(setpoint_requested=6.0, mode="hold")[1]["refusal"] == "none"
        assert wait_for(plc.read, lambda v: v["state"] == "holding")["setpoint"] == 6.0
        plc.write("mode", "vent")


def order(values):
    """An operator's, who looks at the instrument now; its page has the host's clock."""
    return {"token": TOKEN, "values": values, "seen_s": time.monotonic()}


def test_an_order_that_was_given_up_is_not_carried_out_when_the_page_wakes(rig):
    hold = order({"setpoint_requested": 6.0, "mode": "hold"})
    with rig.plc() as plc, contextlib.closing(rig.connect()) as operator:
        wait_for(plc.read, lambda v: "vented" in v["status"])
        pid = rig.page_pid()
        os.kill(pid, signal.SIGSTOP)
        try:
            operator.request("POST", "/api/write", json.dumps(hold))
            time.sleep(2.0)  # longer than an order stands
            plc.write("mode", "vent")
        finally:
            os.kill(pid, signal.SIGCONT)
        response = operator.getresponse()
        assert response.status == 400
        assert "old: look again" in json.loads(response.read())["text"]
        assert plc.read()["mode"] == "vent"


def test_a_page_that_dies_is_begun_again_at_the_same_port(rig):
    first = rig.page_pid()
    os.kill(first, signal.SIGKILL)
    wait_for(rig.page_pid, lambda pid: pid not in (None, first))
    with rig.plc() as plc:
        assert plc.read()["state"] in ("vented", "venting")

    def up():
        with contextlib.suppress(OSError):
            return ask(rig.port, "GET", "/api/registers")[0]

    wait_for(up, lambda status: status == 200)


def test_a_host_that_is_killed_takes_its_page_with_it(rig):  # the last: it ends the rig that all share
    pid = rig.page_pid()
    rig.stack.host.send(signal.SIGKILL)
    wait_for(lambda: command_of(pid), lambda command: not command)
