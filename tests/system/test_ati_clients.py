"""Tests of RDT with clients of other projects: pynetft and netft read the running instrument."""

import math
import re
import shlex
import time
from collections import deque
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import NetFT
import pynetft
import pytest

from pneuforce.registers.map import COMMAND_KEY, REGISTERS
from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.registers.rdt.record import (
    COUNTS_PER_N,
    FULL_SCALE_COUNTS,
    STATUS_INVALID,
    RdtCommand,
    encode_request,
)
from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.rig import LiveRig
from pneuforce.teststand.stack import free_port, start
from tests.registers.rdt.serving import loopback_address
from tests.registers.rdt.test_server import REFUSED
from tests.system.waiting import wait_for

GUIDE = Path(__file__).parents[2] / "docs/how-to/ati-clients.md"
RECORDS = 1000
FORCE_N = 1.5
TIMEOUT_S = 2.0
#: Errors that tell a user of pynetft that there is no force.
NO_FORCE = (pynetft.SensorFaultError, TimeoutError)


def blocks(language):
    """Return the code blocks of the guide in this language."""
    return re.findall(rf"```{language}\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)


class Bench:
    """Running instrument with RDT and web page at one loopback address, as clients of ATI sensors need it."""

    def __init__(self, children, folder):
        self.host, page = loopback_address(), free_port()
        listener = {"enabled": True, "host": self.host}
        tables = {"rdt": listener, "web": {**listener, "port": page}}
        self.stack = start(children, folder / "rig", ["--no-hand"], tables=tables)
        self.rig = LiveRig(self.stack)
        policy = pynetft.RecoveryPolicy.FAIL_STOP
        self.config = pynetft.Config(sensor_host=self.host, http_port=page, recovery_policy=policy)
        self._children = children
        self.netft = self.new_netft()

    def new_netft(self):
        """Return a client of the package netft, which has no time-out of its own."""
        sensor = NetFT.Sensor(self.host)
        sensor.sock.settimeout(TIMEOUT_S)
        self._children.callback(sensor.sock.close)
        return sensor

    def pynetft_sample(self):
        """Return one sample. Raises one of NO_FORCE if there is no valid force."""
        with pynetft.Client(self.config) as client:
            return next(client.samples(timeout=TIMEOUT_S))

    def check_no_client_gets_a_force(self):
        """Check one record of each client. Both clients send their requests without reading the state."""
        assert self.netft.getMeasurement() == [0, 0, FULL_SCALE_COUNTS, 0, 0, 0]
        with pytest.raises(NO_FORCE):
            self.pynetft_sample()

    def clear_faults(self):
        """Clear the faults of a rig whose cause of the trip is gone."""
        for name, value in (("key", COMMAND_KEY), ("code", "clear_faults"), ("sequence", 1)):
            self.rig.write(f"command_{name}", value)
        self.rig.wait_for(lambda registers: registers["state"] == "vented", allow_trip=True)

    def state_while(self, check):
        """Run a check. Return the state of the rig if it was the same before and after, otherwise None."""
        before = self.rig.read()["state"]
        check()
        return before if before == self.rig.read()["state"] else None


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    with ExitStack() as children:
        started = Bench(children, tmp_path_factory.mktemp("ati"))
        started.rig.wait_for(lambda r: {"vented", "not_zeroed"} & r["status"] == {"vented"})
        yield started


@pytest.fixture
def pressed(bench):
    """Return the bench with a held balloon and a constant force on it. An earlier test may have made both."""
    if bench.rig.read()["state"] != "holding":
        bench.rig.inflate(8.0)
        bench.rig.press(FORCE_N)
    return bench


def test_without_a_balloon_under_pressure_no_client_gets_a_force(bench):
    """States vented, inflating, settling and venting, and a hold below the range of the model."""
    rig, seen = bench.rig, set()
    seen.add(bench.state_while(bench.check_no_client_gets_a_force))
    rig.write("mode", "vent")
    rig.write("setpoint_requested", 4.0)
    rig.write("mode", "hold")
    while "holding" not in seen:
        seen.add(bench.state_while(bench.check_no_client_gets_a_force))
    rig.write("mode", "vent")
    seen.add(bench.state_while(bench.check_no_client_gets_a_force))
    assert {"vented", "inflating", "holding"} <= seen


def test_pynetft_and_modbus_show_the_same_force(pressed):
    forces_n, shown = {}, []
    config = replace(pressed.config, recovery_policy=pynetft.RecoveryPolicy.RECONNECT)
    with pynetft.Client(config, callback=lambda s: forces_n.update({s.ft_sequence: s.force})):
        wait_for(lambda: len(forces_n), lambda count: count > 0, 10.0)  # the stream has begun
        for _ in range(20):
            shown.append(pressed.rig.read())
            time.sleep(0.01)  # a few samples
        last = shown[-1]["sample_counter"]
        wait_for(lambda: max(forces_n, default=0), lambda latest: latest >= last, 10.0)
    pairs = [(forces_n[r["sample_counter"]], r["force"]) for r in shown if r["sample_counter"] in forces_n]
    assert len(pairs) > 10
    for (fx, fy, fz), force_n in pairs:
        assert (fx, fy) == (0.0, 0.0)
        assert math.isclose(fz, force_n, abs_tol=0.5 / COUNTS_PER_N + 1e-7)  # Modbus: 32-bit float
        assert math.isclose(fz, FORCE_N, rel_tol=0.1)


def test_pynetft_receives_a_record_for_each_sample(pressed):
    with pynetft.Client(pressed.config, queue_size=RECORDS) as client:
        stream = client.samples(timeout=TIMEOUT_S)
        begun_s = time.monotonic()
        samples = [next(stream) for _ in range(RECORDS)]
        elapsed_s = time.monotonic() - begun_s
        health = client.health()
    first = samples[0].ft_sequence
    assert [s.rdt_sequence for s in samples] == list(range(1, RECORDS + 1))
    assert [s.ft_sequence for s in samples] == list(range(first, first + RECORDS))
    assert {s.status for s in samples} == {0}
    assert (health.lost_count, health.duplicate_count, health.malformed_count) == (0, 0, 0)
    assert "simulated" in health.sensor_configuration.product_name
    assert RECORDS / elapsed_s == pytest.approx(500, rel=0.1)


def run_program(number, host, http_port, capsys):
    """Run a Python program of the guide. Return the forces that it prints [N]."""
    program = blocks("python")[number].replace("192.168.1.20", host).replace("=80", f"={http_port}")
    exec(compile(program, GUIDE.name, "exec"), {})
    return [float(line.removesuffix(" N")) for line in capsys.readouterr().out.splitlines()]


def test_the_commands_of_the_guide_serve_a_simulated_rig_to_pynetft(tmp_path, capsys):
    """The ports and the link differ from those of the guide, because other tests use the same ones."""
    host, http_port, modbus_port = loopback_address(), free_port(), free_port()
    own = {
        "enabled = true": f'enabled = true\nhost = "{host}"',
        "/tmp/": f"{tmp_path}/",
        "rdt.toml": f"{tmp_path}/rdt.toml",
    }

    def local(text):
        for theirs, ours in own.items():
            text = text.replace(theirs, ours)
        return text

    (tmp_path / "rdt.toml").write_text(
        local(blocks("toml")[0]) + f"port = {http_port}\n[modbus]\nport = {modbus_port}\n"
    )
    lines = [local(line.partition("  #")[0]) for line in blocks("sh")[0].splitlines()]
    simulator, instrument, hold = ([*shlex.split(line)][1:] for line in lines[:3])
    with ExitStack() as children:
        children.enter_context(ChildProcess("simulator", ["pneuforce", *simulator, "--no-hand"])).ready()
        children.enter_context(ChildProcess("instrument", ["pneuforce", *instrument])).ready()
        children.enter_context(ChildProcess("hold", ["pneuforce", *hold, "--port", str(modbus_port)]))
        with ModbusClient.connect(port=modbus_port) as plc:
            wait_for(
                plc.read, lambda v: v["state"] == "holding" and "force_valid" in v["condensed_status"], 20.0
            )
        assert run_program(0, host, http_port, capsys) == [0.0] * 10


@pytest.mark.parametrize("number", [0, 1], ids=["pynetft", "netft"])
def test_the_programs_of_the_guide_print_the_force(pressed, capsys, number):
    forces_n = run_program(number, pressed.host, pressed.config.http_port, capsys)
    assert forces_n == pytest.approx([FORCE_N] * (10, 1)[number], rel=0.1)


def test_netft_shows_the_force(pressed):
    fx, fy, fz, *torques = pressed.netft.getMeasurement()
    assert fz / COUNTS_PER_N == pytest.approx(FORCE_N, rel=0.1)
    assert [fx, fy, *torques] == [0] * 5


def test_bias_does_not_change_the_force(pressed):
    with pynetft.Client(pressed.config) as client:
        stream = client.samples(timeout=TIMEOUT_S)
        next(stream)
        client.bias()
        after = [next(stream).force[2] for _ in range(50)]
    pressed.netft.sock.send(encode_request(RdtCommand.SET_BIAS))
    after.append(pressed.netft.getForce()[2] / COUNTS_PER_N)
    assert after == pytest.approx([FORCE_N] * len(after), rel=0.1)


def test_malformed_requests_change_nothing_of_the_instrument(pressed):
    """Only what a client can write is compared, because the measured values change with each sample."""
    before = pressed.rig.read()
    written = [register.name for register in REGISTERS if register.writable and register.name in before]
    with pynetft.Client(pressed.config, queue_size=RECORDS) as client:
        stream = client.samples(timeout=TIMEOUT_S)
        samples = [next(stream)]
        for datagram in REFUSED.values():
            pressed.netft.sock.send(datagram)
            samples.append(next(stream))
        assert client.health().lost_count == 0
    after = pressed.rig.read()
    assert [s.rdt_sequence for s in samples] == list(range(1, len(REFUSED) + 2))
    assert "mode" in written
    assert {name: str(after[name]) for name in written} == {name: str(before[name]) for name in written}
    assert (after["state"], after["reject_reason"]) == ("holding", "none")


def test_a_burst_ends_the_stream_of_pynetft_with_an_error(pressed):
    with pynetft.Client(pressed.config, queue_size=10_000) as client:
        next(client.samples(timeout=TIMEOUT_S))
        pressed.rig.inject_fault("burst")
        with pytest.raises(pynetft.SensorFaultError):
            deque(client.samples(timeout=TIMEOUT_S), maxlen=0)
        assert client.health().last_status == STATUS_INVALID
    pressed.rig.wait_for(lambda registers: registers["state"] == "tripped")
    pressed.check_no_client_gets_a_force()
    pressed.rig.remove_fault("burst")
    pressed.clear_faults()


def test_after_the_rig_is_unplugged_no_client_shows_the_last_force(pressed):
    """The threads of netft only receive. Without records, netft would show the last force for ever."""
    sensor = pressed.new_netft()
    sensor.startStreaming()
    wait_for(lambda: getattr(sensor, "data", None), bool)
    with ModbusClient.connect(port=pressed.stack.modbus_port) as plc:
        pressed.stack.sim.stop()
        wait_for(plc.read, lambda registers: "stale" in registers["status"])
    pressed.check_no_client_gets_a_force()
    assert sensor.force()[2] == FULL_SCALE_COUNTS
    sensor.stream = False  # the thread ends at the next record
    sensor.thread.join(TIMEOUT_S)
    sensor.stopStreaming()
