"""Tests of the Python package with a running instrument: each bus, each refusal, each lost connection."""

import asyncio
import json
import math
import signal
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from functools import partial
from itertools import permutations
from urllib.parse import parse_qsl, urlsplit

import can
import pytest

import pneuforce
from pneuforce import State, Status
from tests.client.instruments import FACES, running_instrument
from tests.command_runner import pneuforce as pneuforce_command
from tests.system.waiting import wait_for

#: Low setpoints, because their inflation is short. The force of a contact is valid only at the first.
SETPOINT_KPA, LOW_KPA = 5.3, 2.0


@pytest.fixture(scope="module")
def instrument(tmp_path_factory):
    with running_instrument(tmp_path_factory.mktemp("client")) as instrument:
        yield instrument


@pytest.fixture(scope="module")
def open_sensors(instrument):
    with ExitStack() as sensors:
        yield {face: sensors.enter_context(pneuforce.connect(instrument.url(face))) for face in FACES}


@pytest.fixture
def sensors(instrument, open_sensors):
    """Return a sensor for each bus. At the end, the rig is vented, without a fault and without a lease."""
    yield open_sensors
    open_sensors["tcp"].vent()
    wait_for(instrument.registers, lambda r: r["lease_holder"] == "none", 5.0)
    open_sensors["tcp"].clear()


@pytest.mark.parametrize("face", FACES)
def test_without_pressure_no_force_can_be_used(sensors, face):
    measurement = sensors[face].read()
    assert not measurement.valid
    assert measurement.setpoint_kpa is None
    assert math.isnan(measurement.force_or_nan)
    if face != "rdt":
        assert measurement.state in (State.VENTED, State.VENTING)
        assert measurement.pressure_kpa is not None
        assert "function_check" in measurement.reasons
    with pytest.raises(pneuforce.InvalidForce) as caught:
        measurement.force_n  # noqa: B018
    assert caught.value.reasons == measurement.reasons


def proof_test_of(sensor):
    """Return the register proof_test as the peer of this sensor reads it."""
    return sensor._connection._client.read_block(range(546, 547))["proof_test"]


def test_a_hold_on_a_serial_line_renews_its_lease_and_ends_it(instrument, sensors):
    sensor = sensors["rtu"]
    with sensor.hold(LOW_KPA, lease_s=0.6, proof_tests=False):
        time.sleep(0.7)
        registers = instrument.registers()
        assert (registers["state"], registers["lease_holder"]) == ("holding", "modbus_rtu")
        assert proof_test_of(sensor) == "forbidden"
        details = sensor.details()
        assert (details.lease_holder, details.setpoint_requested_kpa) == ("modbus_rtu", LOW_KPA)
        assert 0.0 < details.lease_left_s <= 0.6
        sensor.set_setpoint(LOW_KPA + 0.1)
        assert instrument.registers()["setpoint_requested"] == pytest.approx(LOW_KPA + 0.1)
        for limit_n in (4.5, 5.0):
            sensor.set_force_limit(limit_n)
            assert sensor.details().force_limit_n == limit_n
        with pytest.raises(pneuforce.VentNotConfirmed) as caught:
            sensor.wait_until_vented(0.1)
        assert caught.value.pressure_kpa == pytest.approx(LOW_KPA, abs=0.3)
    assert sensor.wait_until_vented().pressure_kpa < 0.3
    assert sensor.details().lease_left_s is None
    assert proof_test_of(sensor) == "allowed"
    registers = instrument.registers()
    assert (registers["mode"], registers["lease_holder"]) == ("vent", "none")


def test_the_command_line_uses_a_serial_line_and_names_the_holder_of_the_lease(instrument, sensors):
    line = urlsplit(instrument.url("rtu"))
    words = ["--device", line.path, *(w for k, v in parse_qsl(line.query) for w in (f"--{k}", v))]
    sensors["rtu"]._connection._client.close()  # only one program can open the port
    shown = pneuforce_command("status", *words, "--json")
    assert shown.returncode == 0, shown.stderr
    assert json.loads(shown.stdout)["state"] == "vented"
    sensors["can"]._connection.prepare_hold(5.0)
    rejected = pneuforce_command("set", "5", *words, "--json")
    sensors["can"].release()
    assert (rejected.returncode, json.loads(rejected.stdout)["reason"]) == (3, "lease")


def hold_until_it_fails(sensor, setpoint_kpa, act, **options):
    """Hold, call `act()`, and use the sensor as a program does, until an exception ends the hold."""
    with sensor.hold(setpoint_kpa, **options):
        act()
        for _ in sensor.stream():
            pass


@pytest.mark.parametrize("face", ["tcp", "can"])
def test_a_trip_is_raised_at_the_next_call_and_can_be_cleared(instrument, sensors, face):
    sensor = sensors[face]
    try:
        with pytest.raises(pneuforce.Tripped) as caught:
            hold_until_it_fails(sensor, 3.0, lambda: instrument.rig.inject_fault("burst"))
    finally:
        instrument.rig.remove_fault("burst")
    assert caught.value.fault == "burst"
    assert caught.value.remedy
    fault = sensor.details().first_out_fault
    assert (fault.name, fault.remedy) == ("burst", caught.value.remedy)
    with pytest.raises(pneuforce.Rejected) as rejected:
        hold_until_it_fails(sensor, 3.0, lambda: None)
    assert rejected.value.reason == "fault_latched"
    assert "clear" in rejected.value.remedy
    sensor.clear()
    assert instrument.registers()["active_fault_count"] == 0


def test_a_trip_that_the_program_has_received_is_not_raised_again_at_the_end(instrument, sensors):
    sensor = sensors["tcp"]
    try:
        with sensor.hold(3.0, lease_s=0.6) as hold:
            instrument.rig.inject_fault("burst")
            wait_for(lambda: hold._failure, lambda failure: failure is not None)  # noted by the lease thread
            with pytest.raises(pneuforce.Tripped):
                sensor.read()
    finally:
        instrument.rig.remove_fault("burst")
    sensor.clear()


def test_another_peer_cannot_hold_but_can_vent(instrument, sensors):
    robot, plc = sensors["can"], sensors["tcp"]

    def interfere():
        with pytest.raises(pneuforce.Rejected) as caught:
            plc.hold(LOW_KPA).__enter__()
        assert caught.value.reason == "lease"
        time.sleep(0.2)
        registers = instrument.registers()
        assert (registers["mode"], registers["state"]) == ("hold", "holding")
        with pytest.raises(pneuforce.Rejected) as caught:
            plc.set_setpoint(LOW_KPA)
        assert caught.value.reason == "lease"
        with pytest.raises(pneuforce.Rejected):  # the lease stays, but the rig vents
            plc.release()

    with pytest.raises(pneuforce.HoldEnded):
        hold_until_it_fails(robot, LOW_KPA, interfere)


@pytest.mark.parametrize(("holder", "operator"), [("tcp", "can"), ("can", "tcp")])
def test_a_program_that_does_not_read_after_the_vent_of_another_client_causes_no_trip(
    instrument, sensors, holder, operator
):
    def vent():
        sensors[operator].vent()
        time.sleep(1.0)  # longer than the lease
        registers = instrument.registers()
        assert (registers["lease_holder"], registers["active_fault_count"]) == ("none", 0)

    with pytest.raises(pneuforce.HoldEnded):
        hold_until_it_fails(sensors[holder], LOW_KPA, vent, lease_s=0.5)


def test_on_can_the_renewal_never_undoes_a_vent_of_another_node(instrument, sensors):
    def renewal_is_refused():
        try:
            sensors["can"]._connection.renew_lease(60.0)
        except pneuforce.HoldEnded:
            return True
        assert instrument.registers()["mode"] == "vent"
        return False

    def vent():
        assert instrument.registers()["lease_holder"] == "can"
        with can.Bus(**instrument.rig.can_arguments) as other:
            other.send(can.Message(arbitration_id=0x205, data=bytes(8), is_extended_id=False))
            wait_for(instrument.registers, lambda r: r["mode"] == "vent", 3.0)
            wait_for(renewal_is_refused, bool)  # the vent may reach the instrument before this program
        for _ in range(10):
            time.sleep(0.03)
            assert instrument.registers()["mode"] == "vent"

    with pytest.raises(pneuforce.HoldEnded):
        hold_until_it_fails(sensors["can"], LOW_KPA, vent, lease_s=60.0)  # the test renews it
    assert instrument.registers()["active_fault_count"] == 0


@pytest.mark.parametrize("face", ["tcp", "can"])
def test_the_renewal_never_undoes_the_own_vent_and_ends_its_lease(instrument, sensors, face):
    with sensors[face].hold(LOW_KPA, lease_s=0.5), suppress(pneuforce.HoldEnded):
        sensors[face]._connection.vent()
        time.sleep(0.8)
        registers = instrument.registers()
        assert (registers["mode"], registers["lease_holder"]) == ("vent", "none")
        assert registers["active_fault_count"] == 0
        sensors[face].read()


@pytest.mark.parametrize(("holder", "second"), list(permutations(["tcp", "rtu", "can"], 2)))
def test_a_hold_that_is_rejected_changes_nothing(instrument, sensors, holder, second):
    def interfere():
        before = instrument.registers()
        with pytest.raises(pneuforce.Rejected) as caught:
            sensors[second].hold(LOW_KPA + 1).__enter__()
        assert caught.value.reason == "lease"
        time.sleep(0.1)
        after = instrument.registers()
        unchanged = ("state", "mode", "lease_holder", "setpoint_requested", "inflation_count")
        assert [after[name] for name in unchanged] == [before[name] for name in unchanged]

    with sensors[holder].hold(LOW_KPA):
        interfere()


def test_a_connection_that_the_instrument_has_closed_is_opened_again(sensors):
    sensor = sensors["tcp"]
    sensor._connection._client._client.socket.shutdown(socket.SHUT_RDWR)
    assert sensor.read().sample_counter is not None


def test_a_second_hold_is_an_error_and_an_exception_vents(instrument, sensors):
    sensor = sensors["tcp"]

    def use():
        with pytest.raises(pneuforce.AlreadyHeld):
            sensor.hold(4.0).__enter__()
        assert sensor.read().state is State.HOLDING
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        hold_until_it_fails(sensor, LOW_KPA, use)
    registers = instrument.registers()
    assert (registers["mode"], registers["lease_holder"]) == ("vent", "none")


def test_a_vent_of_another_thread_wins_over_a_hold_that_is_just_requested(instrument, sensors, monkeypatch):
    """Stop the hold at the worst moment: after all checks, and before the request to inflate is sent."""
    sensor = sensors["tcp"]
    connection = sensor._connection
    begin_hold, requested, vented = connection.begin_hold, threading.Event(), threading.Event()

    def begin_hold_late(*arguments):
        requested.set()
        vented.wait(0.3)
        begin_hold(*arguments)

    monkeypatch.setattr(connection, "begin_hold", begin_hold_late)
    with ThreadPoolExecutor(1) as executor:
        entering = executor.submit(sensor.hold(LOW_KPA).__enter__)
        assert requested.wait(10.0)
        sensor.vent()
        vented.set()
        with pytest.raises(pneuforce.HoldEnded):
            entering.result(10.0)
    registers = instrument.registers()
    assert (registers["mode"], registers["lease_holder"]) == ("vent", "none")


@pytest.mark.parametrize(
    "arguments",
    [{"setpoint_kpa": 99}, {"setpoint_kpa": 1.9}, {"setpoint_kpa": math.nan}]
    + [{"setpoint_kpa": 8, "lease_s": s} for s in (0, 0.1, 61, math.nan)]
    + [{"setpoint_kpa": 8, "timeout_s": s} for s in (0, "20", None)]
    + [{"setpoint_kpa": s} for s in ("8", None)]
    + [{"setpoint_kpa": 8, "lease_s": "2"}],
    ids=str,
)
def test_a_hold_with_a_wrong_argument_sends_nothing(instrument, sensors, arguments):
    before = instrument.registers()["mode"]
    with pytest.raises(pneuforce.ConfigurationError):
        sensors["tcp"].hold(**arguments)
    assert instrument.registers()["mode"] == before


def test_a_closed_sensor_raises_and_closes_again_without_an_error(instrument):
    sensor = pneuforce.connect(instrument.url("tcp"))
    stream = sensor.stream()
    next(stream)
    sensor.close()
    sensor.close()
    for use in (sensor.read, sensor.vent, sensor.stream, lambda: sensor.hold(8.0), lambda: next(stream)):
        with pytest.raises(pneuforce.SensorClosed):
            use()


KILLED = """
import os, signal, sys, pneuforce
with pneuforce.connect(sys.argv[1]) as sensor, sensor.hold(2.0, lease_s=1.0):
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_if_the_process_dies_the_instrument_vents(instrument, sensors):
    done = subprocess.run([sys.executable, "-c", KILLED, instrument.url("tcp")], timeout=60, check=False)
    assert done.returncode == -signal.SIGKILL
    registers = wait_for(instrument.registers, lambda r: r["state"] == "tripped", 3.0)
    assert "lease_expired" in registers["status"]


WITHOUT_POSIX = """
import socket, sys
sys.modules |= dict.fromkeys(["fcntl", "grp", "pty", "pwd", "resource", "syslog", "termios", "tty"])
del socket.AF_UNIX
import pneuforce
with pneuforce.connect(sys.argv[1]) as sensor:
    print(sensor.read().sample_counter is not None)
"""
WATCH_WITHOUT_POSIX = (
    WITHOUT_POSIX.partition("import pneuforce")[0]
    + """
from pneuforce.instrument.cli import main
main()
"""
)


@pytest.mark.parametrize("face", ["tcp", "rdt"])
def test_a_sensor_on_a_network_needs_no_module_that_windows_lacks(instrument, face):
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_POSIX, instrument.url(face)],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert (done.stdout, done.stderr) == ("True\n", "")


def test_watching_modbus_tcp_needs_no_module_that_windows_lacks(instrument):
    port = instrument.url("tcp").rpartition(":")[2].partition("?")[0]
    done = subprocess.run(
        [sys.executable, "-c", WATCH_WITHOUT_POSIX, "watch", "modbus", "--port", port, "--seconds", "0.1"],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert "sample_age" in done.stdout


def test_a_cancelled_task_vents(instrument, sensors):
    async def hold_and_cancel():
        async with pneuforce.aio.connect(instrument.url("tcp")) as sensor:
            begin = asyncio.ensure_future(sensor.hold(9.0).__aenter__())
            while instrument.registers()["mode"] != "hold":
                await asyncio.sleep(0.02)
            begin.cancel()
            with pytest.raises(asyncio.CancelledError):
                await begin
            registers = instrument.registers()
            assert (registers["mode"], registers["lease_holder"]) == ("vent", "none")

    asyncio.run(hold_and_cancel())


def test_a_stream_over_a_dead_line_becomes_invalid_then_raises_and_the_sensor_recovers(instrument, sensors):
    sensor = pneuforce.connect(instrument.url("proxy"))
    stream = sensor.stream(timeout_s=0.5)
    samples = [next(stream)]
    instrument.proxy.noise.cut = True
    try:
        with pytest.raises(pneuforce.ConnectionLost):
            samples.extend(stream)
    finally:
        instrument.proxy.noise.cut = False
    assert samples[0].sample_counter is not None
    assert samples[-1].sample_counter is None
    assert Status.STALE in samples[-1].status
    assert sensor.read().sample_counter is not None  # over a new connection
    sensor.close()


def test_can_cannot_write_single_values(sensors):
    sensor = sensors["can"]
    for call in (partial(sensor.set_setpoint, 5.0), partial(sensor.set_force_limit, 5.0)):
        with pytest.raises(pneuforce.UsageError, match=r"tcp://"):
            call()


def test_rdt_can_command_nothing(sensors):
    sensor = sensors["rdt"]
    writes = [partial(sensor.set_setpoint, 5.0), partial(sensor.set_force_limit, 5.0)]
    for call in (sensor.vent, sensor.release, sensor.clear, sensor.zero, sensor.hold(5.0).__enter__, *writes):
        with pytest.raises(pneuforce.ReadOnlySensor):
            call()
    assert sensor.details() == pneuforce.Details()
    assert sensor.read().sample_counter is not None


@pytest.mark.parametrize("face", ["tcp", "can", "rdt"])
def test_a_pulled_cable_of_the_rig_makes_the_stream_invalid(instrument, sensors, face):
    samples, stream = [], sensors[face].stream(timeout_s=0.6)
    samples.append(next(stream))
    instrument.stack.line.noise.cut = True
    try:
        with pytest.raises(pneuforce.ConnectionLost):
            samples.extend(stream)
        samples.append(sensors[face].read())
    finally:
        instrument.stack.line.noise.cut = False
    assert samples[-2].sample_counter is None
    assert all("stale" in sample.reasons for sample in samples[-2:])
    assert face == "rdt" or Status.LINK_LOST in samples[-1].status
    assert all((sample.status_or_none is None) == (face == "rdt") for sample in samples)
    assert not any(sample.valid for sample in samples)
    wait_for(instrument.registers, lambda r: "link_lost" not in r["status"], 5.0)


def test_a_hold_continues_after_a_stall_of_the_instrument_that_is_longer_than_the_lease(instrument, sensors):
    host = instrument.stack.host
    with sensors["can"].hold(LOW_KPA, lease_s=0.8):
        host.send(signal.SIGSTOP)
        time.sleep(1.2)
        host.send(signal.SIGCONT)
        time.sleep(1.2)
        assert sensors["can"].read().state is State.HOLDING
        assert instrument.registers()["active_fault_count"] == 0


def test_a_wrong_node_and_a_wrong_unit_are_reported(instrument):
    with pytest.raises(pneuforce.ConnectionFailed):
        pneuforce.connect(instrument.url("can").replace("node=5", "node=6"))
    with pytest.raises(pneuforce.ConnectionFailed):
        pneuforce.connect(instrument.url("tcp").replace("unit=1", "unit=7"))


def test_every_bus_shows_the_same_contact_and_new_samples_only(instrument, sensors):
    with sensors["tcp"].hold(SETPOINT_KPA, lease_s=1.0):
        instrument.rig.press(1.5)
        registers = instrument.registers()
        for face, sensor in sensors.items():
            measurement = sensor.read()
            assert measurement.force_n == pytest.approx(registers["force"], abs=0.15)
            if face == "rdt":
                assert (measurement.force_std_n, measurement.pressure_kpa, measurement.state) == (None,) * 3
                assert measurement.status_or_none is None
            else:
                assert measurement.force_std_n == pytest.approx(registers["force_uncertainty"], abs=0.15)
                assert measurement.pressure_kpa == pytest.approx(registers["pressure"], abs=0.05)
                assert measurement.radius_mm == pytest.approx(registers["radius"], abs=0.01)
                assert measurement.setpoint_kpa == pytest.approx(SETPOINT_KPA)
                assert Status.IN_CONTACT in measurement.status
            samples = [sample for sample, _ in zip(sensor.stream(), range(20), strict=False)]
            counters = [sample.sample_counter for sample in samples if sample.sample_counter is not None]
            assert len(counters) > 5
            assert counters == sorted(set(counters))
        instrument.rig.release()
        sensors["tcp"].vent()  # the hold ends without an error
        wait_for(sensors["tcp"].read, lambda measurement: measurement.state is not State.HOLDING, 3.0)
    registers = instrument.registers()
    assert (registers["mode"], registers["lease_holder"]) == ("vent", "none")
    assert registers["active_fault_count"] == 0


def test_a_killed_instrument_is_reported_by_every_call(instrument, open_sensors):
    """This test is the last, because it kills the instrument of this file."""
    sensors = [open_sensors[face] for face in ("tcp", "can", "rdt")]
    streams = [sensor.stream(timeout_s=0.3) for sensor in sensors]
    for stream in streams:
        next(stream)
    instrument.stack.host.send(signal.SIGKILL)
    for stream in streams:
        with pytest.raises(pneuforce.ConnectionLost):
            list(stream)
    for sensor in sensors:
        with pytest.raises(pneuforce.ConnectionLost):
            wait_for(sensor.read, lambda measurement: measurement.valid, 3.0)
    for sensor in sensors[:2]:
        for call in (sensor.vent, sensor.clear, sensor.hold(5.0).__enter__):
            with pytest.raises(pneuforce.ConnectionLost):
                call()
