"""Tests of the topic ~/wrench with real ROS 2 messages, a real instrument and a simulated rig."""

import math
import statistics
import threading
import time

import pytest

pytest.importorskip("rclpy", reason="make test-ros installs ROS 2")

from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.teststand.stack import free_port
from tests.ros.ros_client import DEADLINE_S, stamp_s

RESOLUTION_N = 1e-6  # larger than the distance of two float32 numbers below 8 N
SAME_SAMPLE_S = 0.01  # distance of two equal values in time; the sample period is 2 ms
DELAY_S = 0.05


class ModbusReader:
    """Thread that reads the force over Modbus as fast as possible."""

    def __init__(self, port):
        self.samples = {}  # by sample counter: (time of the sample [s since 1970], force [N])
        self._port, self._stop = port, threading.Event()
        self._thread = threading.Thread(target=self._read)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._stop.set()
        self._thread.join()

    def _read(self):
        with ModbusClient.connect(port=self._port) as plc:
            while not self._stop.is_set():
                values = plc.read_block(range(26))
                sample_s = time.time() - values["sample_age"]
                self.samples.setdefault(values["sample_counter"], (sample_s, values["force"]))


def test_the_force_and_its_time_are_those_of_the_sample_that_modbus_shows(pneuforce_rig, run_node, client):
    with run_node(pneuforce_rig.url, frame_id="tip"):
        client.hold()
        with ModbusReader(pneuforce_rig.modbus_port) as reader:
            pneuforce_rig.press(1.5)
            client.forget()
            time.sleep(2.0)
            messages = [message for _, message in client.wrenches]
    differences = []
    for message in messages:
        force_n, time_s = message.wrench.force.z, stamp_s(message)
        differences += [
            time_s - sample_s
            for sample_s, modbus_n in reader.samples.values()
            if abs(time_s - sample_s) <= SAME_SAMPLE_S and abs(force_n - modbus_n) <= RESOLUTION_N
        ]
    assert len(messages) > 60
    assert len(differences) > 0.5 * len(messages)  # this reader misses some samples
    assert abs(statistics.median(differences)) < 0.001
    assert all(abs(message.wrench.force.z - 1.5) < 0.4 for message in messages)


def test_only_force_z_is_measured(pneuforce_rig, run_node, client):
    with run_node(pneuforce_rig.url, frame_id="tip"):
        client.hold()
        pneuforce_rig.press(1.0)
        message = client.wait_for_wrench(lambda m: m.wrench.force.z > 0.5)
    torque = message.wrench.torque
    others = (message.wrench.force.x, message.wrench.force.y, torque.x, torque.y, torque.z)
    assert (message.header.frame_id, others) == ("tip", (0.0,) * 5)


def test_the_node_also_uses_can(pneuforce_rig, run_node, client):
    with run_node(pneuforce_rig.can_url):
        client.hold()
        pneuforce_rig.press(1.5)
        client.wait_for_wrench(lambda message: abs(message.wrench.force.z - 1.5) < 0.4)
        assert client.call("vent").success
        pneuforce_rig.wait_for(lambda registers: registers["state"] == "vented")


RDT_PORT = free_port()


@pytest.mark.pneuforce(instrument={"rdt": {"enabled": True, "port": RDT_PORT}})
def test_the_node_reads_over_rdt_but_commands_nothing(pneuforce_rig, run_node, client):
    with run_node(f"rdt://127.0.0.1:{RDT_PORT}"):
        client.wait_for_diagnosis(lambda _, values: values.get("force_valid") == "false")
        for name in ("hold", "vent", "clear"):
            assert not client.call(name).success
        pneuforce_rig.inflate(6.0)
        pneuforce_rig.press(1.5)
        client.wait_for_wrench(lambda message: abs(message.wrench.force.z - 1.5) < 0.4)
        pneuforce_rig.vent()
        client.forget()
        time.sleep(1.0)
        assert client.wrenches == []


def test_proof_tests_are_forbidden_on_request(pneuforce_rig, run_node, client):
    with run_node(pneuforce_rig.url, proof_tests=False):
        client.hold()
        assert pneuforce_rig.read()["proof_test"] == "forbidden"


def test_the_time_stamp_includes_the_age_of_the_sample(
    pneuforce_rig, pneuforce_serial_proxy, run_node, client
):
    with run_node(pneuforce_rig.url):
        client.hold()
        latencies_s = []
        for pneuforce_serial_proxy.noise.delay_s in (0.0, DELAY_S):
            time.sleep(0.5)
            client.forget()
            time.sleep(1.0)
            latencies_s.append(statistics.median(at_s - stamp_s(m) for at_s, m in client.wrenches))
        stamps_s = [stamp_s(message) for _, message in client.wrenches]
    assert 0.0 <= latencies_s[0] < DELAY_S
    assert latencies_s[1] - latencies_s[0] >= 0.8 * DELAY_S
    assert stamps_s == sorted(stamps_s)


def test_an_invalid_force_is_silence_and_a_missed_deadline(pneuforce_rig, run_node, client):
    with run_node(pneuforce_rig.url):
        time.sleep(0.5)
        assert client.missed_deadlines == []  # a deadline begins with the first message
        client.hold()
        with pneuforce_rig.inject_fault("sensor_open"):
            client.wait_for_diagnosis(lambda _, values: values.get("force_valid") == "false")
            client.forget()
            time.sleep(1.0)
            assert client.wrenches == []
            assert client.missed_deadlines
            assert client.missed_deadlines[1] - client.missed_deadlines[0] < 2 * DEADLINE_S


def test_an_invalid_force_is_nan_on_request(pneuforce_rig, run_node, client):
    def is_nan(message):
        wrench = message.wrench
        return all(
            math.isnan(value)
            for vector in (wrench.force, wrench.torque)
            for value in (vector.x, vector.y, vector.z)
        )

    with run_node(pneuforce_rig.url, publish_nan=True):
        client.wait_for_wrench(is_nan)  # vented
        client.hold()
        client.wait_for_wrench(lambda message: math.isfinite(message.wrench.force.z))
        with pneuforce_rig.inject_fault("sensor_open"):
            client.wait_for_wrench(is_nan)
            client.forget()
            time.sleep(1.0)
            assert len(client.wrenches) > 5
            assert all(is_nan(message) for _, message in client.wrenches)


def test_a_node_with_an_invalid_parameter_ends_with_a_message(start_node):
    for parameters in ({"publish_nan": "zero"}, {"setpoint_kpa": 13.0}, {"lease_s": "long"}):
        process, log = start_node("tcp://127.0.0.1:1", **parameters)
        assert process.wait(20.0) == 1
        (name,) = parameters
        assert name in log.read_text()
        assert "Traceback" not in log.read_text()
