"""Tests of the node when the connection, the instrument or the node itself ends."""

import signal
import time

import pytest

pytest.importorskip("rclpy", reason="make test-ros installs ROS 2")

from diagnostic_msgs.msg import DiagnosticStatus

import pneuforce.testing
from pneuforce.teststand.stack import free_port

LEASE_S = 1.0


def disconnected(status, values):
    return status.level == DiagnosticStatus.ERROR and values.get("connected") == "false"


def state_is(*states):
    return lambda _, values: values.get("state") in states


def rig_state(rig):
    return rig.read()["state"]


def inflates_within(rig, time_s):
    """Return True if the balloon is inflated within the next `time_s`."""
    until_s = time.monotonic() + time_s
    while time.monotonic() < until_s:
        if rig_state(rig) in ("inflating", "settling", "holding"):
            return True
        time.sleep(0.02)
    return False


def test_a_restarted_instrument_is_found_again_and_stays_vented(run_node, client):
    port = free_port()
    with run_node(f"tcp://127.0.0.1:{port}?unit=1", lease_s=LEASE_S):
        client.wait_for_diagnosis(disconnected)
        with pneuforce.testing.simulated_rig(instrument={"modbus": {"port": port}}):
            client.hold()
        client.wait_for_diagnosis(disconnected)
        client.forget()
        for name in ("vent", "hold", "clear"):
            answer = client.call(name, timeout_s=5.0)
            assert not answer.success
            assert answer.message
        assert client.wrenches == []
        with pneuforce.testing.simulated_rig(instrument={"modbus": {"port": port}}) as rig:
            client.wait_for_diagnosis(state_is("vented"))
            assert not inflates_within(rig, 3.0)
            assert client.call("vent").success
            time.sleep(1.2)
            assert client.call("hold").success


def test_a_pulled_cable_vents_by_the_lease_and_nothing_inflates_after_the_reconnection(
    pneuforce_rig, pneuforce_tcp_proxy, run_node, client
):
    with run_node(f"tcp://127.0.0.1:{pneuforce_tcp_proxy.port}", lease_s=LEASE_S):
        client.hold()
        pneuforce_tcp_proxy.noise.cut = True
        client.wait_for_diagnosis(lambda status, _: status.level == DiagnosticStatus.ERROR, 1.0)
        client.wait_for_diagnosis(disconnected)
        pneuforce_rig.wait_for(lambda r: r["state"] == "tripped", LEASE_S + 3.0)
        client.forget()
        pneuforce_tcp_proxy.noise.cut = False
        status, values = client.wait_for_diagnosis(state_is("tripped"))
        assert status.level == DiagnosticStatus.ERROR
        assert "lease_expired" in values
        assert not inflates_within(pneuforce_rig, 2.0)
        assert client.wrenches == []
        assert client.call("clear").success
        assert client.call("hold").success


def test_a_balloon_with_a_long_lease_is_vented_after_the_reconnection(
    pneuforce_rig, pneuforce_tcp_proxy, run_node, client
):
    with run_node(f"tcp://127.0.0.1:{pneuforce_tcp_proxy.port}", lease_s=60.0):
        client.hold()
        pneuforce_tcp_proxy.noise.cut = True
        client.wait_for_diagnosis(disconnected)
        time.sleep(3.0)  # the node has closed the connection, and could not vent
        assert rig_state(pneuforce_rig) == "holding"
        pneuforce_tcp_proxy.noise.cut = False
        registers = pneuforce_rig.wait_for(lambda registers: registers["state"] == "vented")
        assert registers["lease_left"] > 0
        assert client.call("hold").success


def test_a_lost_rig_is_an_error_while_the_instrument_answers(
    pneuforce_rig, pneuforce_serial_proxy, run_node, client
):
    with run_node(pneuforce_rig.url):
        client.hold()
        pneuforce_serial_proxy.noise.cut = True
        status, values = client.wait_for_diagnosis(lambda _, values: "link_lost" in values)
        assert (status.level, values["connected"]) == (DiagnosticStatus.ERROR, "true")
        client.forget()
        time.sleep(3.0)
        assert client.wrenches == []
        assert {status.level for _, status in client.diagnoses} == {DiagnosticStatus.ERROR}
        assert not any(disconnected(s, {v.key: v.value for v in s.values}) for _, s in client.diagnoses)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_end_of_the_node_vents_the_balloon_that_it_holds(pneuforce_rig, run_node, client, number):
    with run_node(pneuforce_rig.url) as process:
        client.hold()
        process.send_signal(number)
        assert process.wait(5.0) == 0
        registers = pneuforce_rig.wait_for(lambda r: r["state"] == "vented")
        assert (registers["lease_left"], registers["first_out_fault"]) == (0, 0)


def test_the_end_of_the_node_during_a_hold_request_vents(pneuforce_rig, run_node, client):
    with run_node(pneuforce_rig.url) as process:
        client.wait_for_diagnosis(state_is("vented"))
        client.request("hold")
        pneuforce_rig.wait_for(lambda r: r["state"] == "inflating")
        process.send_signal(signal.SIGINT)
        assert process.wait(10.0) == 0
        registers = pneuforce_rig.wait_for(lambda r: r["state"] == "vented")
        assert (registers["lease_left"], registers["first_out_fault"]) == (0, 0)


def test_the_end_of_the_node_does_not_vent_a_balloon_of_another_client(pneuforce_rig, run_node, client):
    with run_node(pneuforce_rig.url) as process:
        pneuforce_rig.inflate(6.0)
        client.wait_for_wrench(lambda message: True)
        process.send_signal(signal.SIGINT)
        assert process.wait(5.0) == 0
        assert rig_state(pneuforce_rig) == "holding"


def test_the_lease_vents_if_the_node_is_killed(pneuforce_rig, run_node, client):
    with run_node(pneuforce_rig.url, lease_s=LEASE_S) as process:
        client.hold()
        process.kill()
        registers = pneuforce_rig.wait_for(lambda r: r["state"] == "tripped", LEASE_S + 3.0)
        assert "lease_expired" in registers["status"]
