"""Tests of the services and of the diagnostics with real ROS 2 messages."""

import math
import threading
import time

import pytest

pytest.importorskip("rclpy", reason="make test-ros installs ROS 2")

from diagnostic_msgs.msg import DiagnosticStatus
from pneuforce_ros.node import PneuforceNode
from rclpy.executors import SingleThreadedExecutor

import pneuforce
from pneuforce.registers.advice import FAULT_ADVICE, REJECT_REASON_ADVICE
from tests.ros.ros_client import answer_of

INFLATED = ("inflating", "settling", "holding")


def state_is(*states):
    return lambda _, values: values.get("state") in states


def rig_state(rig):
    return rig.read()["state"]


def test_hold_and_vent(pneuforce_rig, run_node, client):
    with run_node(pneuforce_rig.url, setpoint_kpa=6.0):
        client.hold()
        assert pneuforce_rig.read()["setpoint"] == pytest.approx(6.0)
        again = client.call("hold")
        assert not again.success
        assert rig_state(pneuforce_rig) == "holding"
        status, values = client.wait_for_diagnosis(state_is("holding"))
        assert status.level == DiagnosticStatus.WARN  # only because the rig is simulated
        assert "simulated" in values
        assert (values["force_valid"], values["calibrated"]) == ("true", "false")
        assert 0.0 <= float(values["age_s"]) < 0.1
        assert client.call("vent").success
        client.wait_for_diagnosis(state_is("vented"))
        registers = pneuforce_rig.read()
        assert (registers["state"], registers["lease_left"]) == ("vented", 0)


def test_a_vent_is_answered_at_once_during_a_hold_and_ends_the_hold(pneuforce_rig, run_node, client):
    with run_node(pneuforce_rig.url):
        client.wait_for_diagnosis(state_is("vented"))
        holding = client.request("hold")
        client.wait_for_diagnosis(state_is("inflating"))
        assert not client.call("hold").success  # a second request does not wait for the first
        assert rig_state(pneuforce_rig) != "holding"
        begun_s = time.monotonic()
        assert client.call("vent").success
        assert time.monotonic() - begun_s < 1.0
        assert not answer_of(holding).success
        pneuforce_rig.wait_for(lambda registers: registers["state"] == "vented")


def test_a_vent_has_priority_over_a_hold_that_is_requested_at_the_same_time(pneuforce_rig, run_node, client):
    with run_node(pneuforce_rig.url):
        client.wait_for_diagnosis(state_is("vented"))
        for names in (("vent", "hold"), ("hold", "vent"), ("hold", "hold", "vent", "hold")):
            answers = {f"{number} {name}": client.request(name) for number, name in enumerate(names)}
            answers = {name: answer_of(future).success for name, future in answers.items()}
            assert answers == {name: name.endswith("vent") for name in answers}
            assert not client.call("hold").success
            pneuforce_rig.wait_for(lambda registers: registers["state"] == "vented")
            time.sleep(1.2)
            assert rig_state(pneuforce_rig) == "vented"


@pytest.mark.parametrize(
    ("name", "value"),
    [("setpoint_kpa", 99.0), ("setpoint_kpa", math.nan), ("lease_s", 0.0), ("lease_s", math.nan)],
)
def test_an_invalid_parameter_is_rejected(run_node, client, name, value):
    with run_node("tcp://127.0.0.1:1"):
        assert not client.set_number(name, value).successful


def test_a_fault_is_shown_with_its_remedy_until_it_is_cleared(pneuforce_rig, run_node, client):
    fault = FAULT_ADVICE[1]  # sensor
    with run_node(pneuforce_rig.url):
        client.hold()
        with pneuforce_rig.inject_fault("sensor_open"):
            status, values = client.wait_for_diagnosis(lambda _, values: "fault" in values)
            assert status.level == DiagnosticStatus.ERROR
            assert fault.do in values["fault"]
            assert values["state"] == "tripped"
            assert "sensor_fault" in values
            rejected = client.call("clear")
            assert not rejected.success
            assert REJECT_REASON_ADVICE["cause_persists"] in rejected.message
        rejected = client.call("hold")
        assert not rejected.success
        assert REJECT_REASON_ADVICE["fault_latched"] in rejected.message or "(sensor)" in rejected.message
        assert client.call("clear").success
        client.wait_for_diagnosis(
            lambda s, values: s.level != DiagnosticStatus.ERROR and "fault" not in values
        )
        time.sleep(1.2)  # the failed hold has vented
        assert client.call("hold").success


def test_a_lease_of_another_client_rejects_the_hold(pneuforce_rig, run_node, client):
    with run_node(pneuforce_rig.url), pneuforce.connect(pneuforce_rig.can_url) as other:
        client.wait_for_diagnosis(state_is("vented"))
        with other.hold(6.0, lease_s=5.0):
            rejected = client.call("hold")
            assert rig_state(pneuforce_rig) == "holding"
        assert not rejected.success
        assert REJECT_REASON_ADVICE["lease"] in rejected.message


class CrashingNode(PneuforceNode):
    """Node whose thread for the measurements ends by an error of the program."""

    def _on_lost(self, error):
        raise RuntimeError("error of the program")


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_node_that_no_longer_measures_reports_an_error(client):
    executor = SingleThreadedExecutor()
    node = CrashingNode()
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    try:
        client.wait_for_diagnosis(lambda status, _: "no measurement has arrived" in status.message)
        assert client.diagnoses[-1][1].level == DiagnosticStatus.ERROR
    finally:
        executor.shutdown()
        thread.join(2.0)
        node.destroy_node()
