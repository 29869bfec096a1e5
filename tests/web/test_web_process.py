"""Tests of the web process: start, heartbeat, end, and operation with a real instrument."""

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

from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.teststand.stack import free_port, start
from tests.system.waiting import inflate, wait_for
from tests.web.entries import header, snapshot
from tests.web.process import cookies, event_stream, request, web_process
from tests.web.serving import FakeInstrument, until
from tests.web.users import OPERATOR, users_file

END = [
    pytest.param(lambda process: process.stdin.close(), id="stdin is closed"),
    pytest.param(lambda process: process.send_signal(signal.SIGTERM), id="SIGTERM"),
]


@pytest.mark.parametrize("end", END)
def test_the_process_ends_at_once_even_if_streams_are_open(instrument, end):
    with (
        web_process(socket=str(instrument.path)) as (process, ready),
        event_stream(ready["port"]) as stream,
    ):
        assert next(stream)[0] == "link"
        end(process)
        assert process.wait(60) == 0
        assert list(stream) is not None  # the stream ends, too
        assert process.stderr.read() == ""


def heartbeat(process):
    return json.loads(process.stdout.readline())["heartbeat"]


def test_a_stopped_process_sends_no_heartbeat():
    with web_process() as (process, _):
        assert [heartbeat(process), heartbeat(process)] == [1, 2]
        process.send_signal(signal.SIGSTOP)
        while select.select([process.stdout], [], [], 1.5)[0]:
            heartbeat(process)
        process.send_signal(signal.SIGCONT)
        assert heartbeat(process) > 2


def test_the_process_serves_even_if_its_output_is_not_read():
    with web_process() as (process, ready):
        pipe = os.open(f"/proc/{process.pid}/fd/1", os.O_WRONLY | os.O_NONBLOCK)
        with contextlib.suppress(BlockingIOError):
            while os.write(pipe, b"x" * 4096):
                pass
        os.close(pipe)
        for action in (lambda: None, process.stdout.close):
            action()
            time.sleep(1.5)  # longer than the heartbeat period
            assert request(ready["port"], "GET", "/api/about")[0] == 200


def test_a_port_in_use_is_reported_with_the_setting_to_change():
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with web_process(port=port) as (process, ready):
            assert ready["port"] is None
            assert f"127.0.0.1:{port}" in ready["why"]
            assert "[web] port" in ready["why"]
            assert process.wait(60) == 1


def test_the_process_waits_for_an_instrument_that_starts_later(tmp_path):
    path = tmp_path / "late.sock"
    with web_process(socket=str(path)) as (_, ready), event_stream(ready["port"]) as stream:
        until(stream, "link", lambda link: str(path) in link["reason"] and not link["up"])
        instrument = FakeInstrument(path)
        wait_for(lambda: instrument.subscriptions, bool)
        instrument.send(header(), snapshot(time.monotonic()))
        assert until(stream, "link")["up"] is True
        instrument.close()


# ---- with a real instrument


class RigWithWeb:
    """Simulated rig, its instrument, and the web process."""

    def __init__(self, children, folder):
        self.port = free_port()
        web = {"enabled": True, "port": self.port, "users_file": users_file(folder)}
        self.stack = start(children, folder / "rig", ["--no-hand"], {"web": web})

    def plc(self):
        return ModbusClient.connect(port=self.stack.modbus_port)

    def connect(self):
        return http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)

    def web_pid(self):
        """Return the process id of the web process; None if the process is not running."""
        host = self.stack.host.pid
        pids = Path(f"/proc/{host}/task/{host}/children").read_text().split()
        return next((int(pid) for pid in pids if command_of(pid).endswith("-m pneuforce.web")), None)


def command_of(pid):
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ").strip()
    return ""


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    with contextlib.ExitStack() as children:
        yield RigWithWeb(children, tmp_path_factory.mktemp("web"))


def test_the_web_page_shows_what_a_plc_reads_and_can_vent(rig):
    with rig.plc() as plc, event_stream(rig.port) as stream:
        registers = inflate(plc, 8.0)
        state = until(stream, "state", lambda state: state["state"] == "holding")
        assert state["pressure_kpa"] == pytest.approx(registers["pressure"], abs=0.1)
        assert state["setpoint_kpa"] == registers["setpoint"] == 8.0
        words = request(rig.port, "GET", "/api/registers")[1]["blocks"][1]["words"]
        assert struct.unpack(">f", struct.pack(">HH", *words[:2])) == (8.0,)
        status, answer = request(rig.port, "POST", "/api/vent", {})
        assert (status, answer["reject_reason"]) == (200, "none")
        wait_for(plc.read, lambda registers: registers["state"] == "vented")
        event = until(stream, "event", lambda event: "vent" in event["text"])
        assert "web page 127.0.0.1: mode hold → vent: accepted" in event["text"]


def test_a_failed_login_is_in_the_event_log_and_in_the_log_of_the_host(rig):
    with event_stream(rig.port) as stream:
        wrong = {"name": OPERATOR, "password": "wrong"}
        assert request(rig.port, "POST", "/api/login", wrong)[0] == 401
        event = until(stream, "event", lambda event: "wrong password" in event["text"])
    assert event["kind"] == "login"
    assert "web page 127.0.0.1" in event["text"]
    wait_for(lambda: [line for line in rig.stack.host.stderr_lines if "login from 127.0.0.1" in line], bool)


def test_an_operator_is_subject_to_the_rules_of_a_plc(rig):
    def write(**values):
        return request(rig.port, "POST", "/api/write", write_body(values), operator)

    operator = cookies(rig.port)
    with rig.plc() as plc:
        wait_for(plc.read, lambda v: "not_zeroed" not in v["status"] and "vented" in v["status"])
        plc.write("lease", 5.0)
        status, answer = write(setpoint_requested=6.0)
        assert (status, answer["reject_reason"]) == (200, "lease")
        plc.write("lease", 0)
        assert write(mode="vent")[1]["reject_reason"] == "none"
        assert write(setpoint_requested=6.0, mode="hold")[1]["reject_reason"] == "none"
        assert wait_for(plc.read, lambda v: v["state"] == "holding")["setpoint"] == 6.0
        plc.write("mode", "vent")


def write_body(values):
    """Return a write request that is based on the current state. Test and host have the same clock."""
    return {"values": values, "seen_s": time.monotonic()}


def test_an_old_write_request_is_rejected_after_a_stop_of_the_web_process(rig):
    login = cookies(rig.port)
    hold = write_body({"setpoint_requested": 6.0, "mode": "hold"})
    with rig.plc() as plc, contextlib.closing(rig.connect()) as operator:
        wait_for(plc.read, lambda v: "vented" in v["status"])
        pid = rig.web_pid()
        os.kill(pid, signal.SIGSTOP)
        try:
            operator.request("POST", "/api/write", json.dumps(hold), login)
            time.sleep(2.0)  # longer than a write request is valid
            plc.write("mode", "vent")
        finally:
            os.kill(pid, signal.SIGCONT)
        response = operator.getresponse()
        assert response.status == 400
        assert " s old" in json.loads(response.read())["text"]
        assert plc.read()["mode"] == "vent"


def test_a_killed_web_process_is_restarted_at_the_same_port_and_shows_the_earlier_events(rig):
    with rig.plc() as plc:
        plc.write("mode", "vent")
    first = wait_for(rig.web_pid, bool)
    os.kill(first, signal.SIGKILL)
    wait_for(rig.web_pid, lambda pid: pid not in (None, first))
    with rig.plc() as plc:
        assert plc.read()["state"] in ("vented", "venting")

    def read_status():
        with contextlib.suppress(OSError):
            return request(rig.port, "GET", "/api/registers")[0]

    wait_for(read_status, lambda status: status == 200)
    with event_stream(rig.port) as stream:
        events = until(stream, "events", lambda events: events["rows"])["rows"]
    assert events[0]["kind"] == "start"
    assert any("mode vent: accepted" in event["text"] for event in events), events
    assert events == sorted(events, key=lambda event: event["at"])


def test_the_web_process_ends_when_the_host_process_is_killed(rig):  # last test: it ends the shared rig
    pid = rig.web_pid()
    rig.stack.host.send(signal.SIGKILL)
    wait_for(lambda: command_of(pid), lambda command: not command)
