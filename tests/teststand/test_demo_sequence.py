"""Tests of the decisions of the demo: when does it send commands?"""

import math

import pytest

from pneuforce.registers.modbus.client import NoAnswerError, WriteRejectedError
from pneuforce.teststand.demo_sequence import DemoSequence

IDLE = {"status": set(), "state": "vented", "mode": "vent", "lease_holder": "none"}
UNSET = IDLE | {"setpoint_requested": math.nan}
HOLDING = IDLE | {"state": "holding", "mode": "hold", "setpoint_requested": 8.0}
VENTED = HOLDING | {"state": "vented", "mode": "vent"}
TRIPPED = VENTED | {"state": "tripped"}


class RecordingPlc:
    """Modbus client that records the writes and reports an overload fault."""

    def __init__(self):
        self.writes = []
        self.rejects = False
        self.fault = 34
        self.latched_faults = (0, 1 << 2)
        self.answers_left = math.inf  #: number of writes until the connection is lost

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def write(self, name, value):
        if self.answers_left == 0:
            raise NoAnswerError("the connection is lost")
        self.answers_left -= 1
        if self.rejects:
            raise WriteRejectedError("rejected", self.rejects)
        self.writes.append((name, value))

    def read_all(self):
        board, host = self.latched_faults
        return {"first_out_fault": self.fault, "latched_faults_1": board, "latched_faults_2": host}

    def run_command(self, code, timeout_s):
        self.write("command_code", code)
        return "none"


@pytest.fixture
def plc():
    return RecordingPlc()


@pytest.fixture
def demo(plc):
    """Demo that has inflated the balloon to 8 kPa."""
    demo = DemoSequence(lambda: plc)
    demo.step(UNSET, 8.0)
    assert plc.writes == [("mode", "vent"), ("setpoint_requested", 8.0), ("mode", "hold")]
    plc.writes.clear()
    return demo


def test_no_command_is_sent_before_the_zero_adjustment(plc):
    DemoSequence(lambda: plc).step(UNSET | {"status": {"not_zeroed"}}, 8.0)
    assert not plc.writes


def test_a_new_setpoint_of_the_scenario_is_written_without_a_vent(demo, plc):
    demo.step(HOLDING, 10.0)
    assert plc.writes == [("setpoint_requested", 10.0)]


def test_after_a_trip_by_an_overload_the_demo_clears_the_fault_and_inflates_again(demo, plc):
    demo.step(HOLDING, 8.0)
    demo.step(TRIPPED, 8.0)
    assert ("command_code", "clear_faults") in plc.writes
    assert plc.writes[-1] == ("mode", "hold")


def test_a_trip_with_another_fault_beside_an_overload_is_not_cleared_and_names_both(demo, plc):
    demo.step(HOLDING, 8.0)
    plc.latched_faults = (1 << 10, 1 << 2)
    demo.step(TRIPPED | plc.read_all(), 8.0)
    assert "link lost (fault 34), occlusion (fault 10); remove the cause" in demo.report
    assert not plc.writes


def test_a_balloon_that_a_user_vented_before_the_trip_stays_vented(demo, plc):
    for values in (HOLDING, VENTED, TRIPPED, TRIPPED):
        demo.step(values, 8.0)
    assert not plc.writes


@pytest.mark.parametrize("change", [{"setpoint_requested": 9.0}, {"lease_holder": "modbus_tcp"}])
def test_the_demo_ends_when_another_client_takes_over(demo, plc, change):
    demo.step(HOLDING | change, 10.0)
    demo.step(HOLDING, 12.0)
    assert not plc.writes


@pytest.mark.parametrize("change", [{"setpoint_requested": 9.0}, {"lease_holder": "modbus_tcp"}])
def test_the_demo_does_not_inflate_after_a_trip_if_another_client_had_taken_over(demo, plc, change):
    for values in (HOLDING, HOLDING | change, HOLDING, TRIPPED):
        demo.step(values, 8.0)
    assert not plc.writes


def test_a_rejected_command_ends_the_demo(demo, plc):
    plc.rejects = "write_protect"
    demo.step(HOLDING, 10.0)
    plc.rejects = False
    demo.step(HOLDING, 10.0)
    assert not plc.writes


def test_after_a_trip_the_demo_tries_again_until_its_commands_are_accepted(demo, plc):
    demo.step(HOLDING, 8.0)
    plc.rejects = "vent_fault"
    for _ in range(3):
        demo.step(TRIPPED, 8.0)
    assert not plc.writes
    plc.rejects = False
    demo.step(TRIPPED, 8.0)
    assert plc.writes[-1] == ("mode", "hold")


INFLATION = [("mode", "vent"), ("setpoint_requested", 8.0), ("mode", "hold")]
RECOVERY = [("command_code", "clear_faults"), *INFLATION]


def test_a_trip_before_the_demo_has_seen_its_own_hold_is_cleared(demo, plc):
    """A computer that is suspended during the inflation delays the observed values."""
    demo.step(TRIPPED, 8.0)
    assert plc.writes == RECOVERY


def test_a_trip_before_the_first_command_is_cleared(plc):
    DemoSequence(lambda: plc).step(UNSET | {"state": "tripped"}, 8.0)
    assert plc.writes == RECOVERY


def test_a_recovered_demo_recovers_again(demo, plc):
    for _ in range(2):
        plc.writes.clear()
        demo.step(TRIPPED, 8.0)
        assert plc.writes == RECOVERY


def test_nothing_is_cleared_while_no_samples_arrive(demo, plc):
    demo.step(TRIPPED | {"status": {"stale"}}, 8.0)
    assert not plc.writes
    demo.step(TRIPPED, 8.0)
    assert plc.writes == RECOVERY


@pytest.mark.parametrize("answers", range(3))
def test_an_interrupted_inflation_is_repeated_from_its_first_step(plc, answers):
    demo, plc.answers_left = DemoSequence(lambda: plc), answers
    demo.step(UNSET, 8.0)
    requested_kpa = dict(plc.writes).get("setpoint_requested", math.nan)
    plc.answers_left = math.inf
    plc.writes.clear()
    demo.step(IDLE | {"setpoint_requested": requested_kpa}, 8.0)
    demo.step(HOLDING, 8.0)
    assert plc.writes == INFLATION


@pytest.mark.parametrize("answers", range(4))
def test_an_interrupted_recovery_is_repeated(demo, plc, answers):
    plc.answers_left = answers
    demo.step(TRIPPED, 8.0)
    plc.answers_left = math.inf
    plc.writes.clear()
    demo.step(VENTED if answers else TRIPPED, 8.0)
    assert plc.writes == (INFLATION if answers else RECOVERY)


def test_a_setpoint_that_was_not_written_is_written_later_without_a_vent(demo, plc):
    demo.step(HOLDING, 8.0)
    plc.answers_left = 0
    demo.step(HOLDING, 10.0)
    plc.answers_left = math.inf
    demo.step(HOLDING, 10.0)
    assert plc.writes == [("setpoint_requested", 10.0)]


def test_a_trip_between_an_observation_and_a_command_does_not_end_the_demo(demo, plc):
    demo.step(HOLDING, 8.0)
    plc.rejects = "fault_latched"
    demo.step(HOLDING, 10.0)
    plc.rejects = False
    demo.step(TRIPPED, 10.0)
    assert ("setpoint_requested", 10.0) in plc.writes
    assert plc.writes[-1] == ("mode", "hold")


def test_the_demo_reports_a_trip_and_whether_the_demo_clears_it(demo, plc):
    demo.step(HOLDING, 8.0)
    assert demo.report == ""
    demo.step(TRIPPED | {"first_out_fault": 34}, 8.0)
    assert "(fault 34)" in demo.report
    assert "cable" in demo.report  # a pulled cable is not reported as a busy computer
    by_overload = demo.report
    demo.step(HOLDING, 8.0)
    assert demo.report == ""
    plc.fault = 4
    plc.writes.clear()
    demo.step(TRIPPED | {"first_out_fault": 4}, 8.0)
    assert "(fault 4)" in demo.report
    assert demo.report.partition(")")[2] != by_overload.partition(")")[2]
    assert not plc.writes


@pytest.mark.parametrize("fault", [4, 34])
def test_a_trip_is_reported_also_after_another_client_has_taken_over(demo, plc, fault):
    demo.step(HOLDING, 8.0)
    taken_over = {"setpoint_requested": 9.0}
    tripped = TRIPPED | taken_over | {"first_out_fault": fault}
    for _ in range(2):
        demo.step(tripped, 8.0)
        assert f"(fault {fault})" in demo.report
        assert "inflates again" not in demo.report
    demo.step(HOLDING | taken_over, 8.0)
    assert "no more commands" in demo.report
    assert not plc.writes
