"""The command block: run once for each new sequence, answered, and never in the way of safety."""

import math

import pytest

from instrument.faults import HostFault
from instrument.rig.frames import Fault
from tests.instrument.driving import HOLD_8, KEY, PLC, ROBOT, VENT, Drive

CLEAR = KEY | {"command_code": "clear_faults"}


def fault_of(drive):
    return drive.see().first_fault


def test_the_same_sequence_repeats_the_answer_and_does_not_run_again():
    drive = Drive.zeroed()
    request = KEY | {"command_code": "new_balloon", "command_argument": 7, "command_sequence": 5}
    drive.must(request)
    drive.instrument.balloon_id = 99
    drive.must(request)
    seen = drive.see()
    assert (seen.balloon_id, seen.answer_sequence, seen.answer_state) == (99, 5, "done")
    drive.must(request | {"command_sequence": 6})
    assert drive.see().balloon_id == 7


@pytest.mark.parametrize("wrong", [{}, {"command_code": "clear_faults"}, KEY, KEY | {"command_code": "none"}])
def test_without_key_or_code_nothing_runs_and_the_answer_says_failed(wrong):
    drive = Drive.zeroed()
    drive.instrument.trip(HostFault.BOARD_RESET)
    drive.must(wrong | {"command_sequence": 1})
    drive.run(0.6)
    assert drive.see().answer_state == "failed"
    assert fault_of(drive) == HostFault.BOARD_RESET


def test_the_key_is_used_up_by_each_run():
    drive = Drive.zeroed()
    drive.must(KEY | {"command_code": "self_test", "command_sequence": 1})
    assert drive.see().answer_state == "done"
    drive.must({"command_sequence": 2})
    assert drive.see().answer_state == "failed"


def test_the_key_is_used_up_by_a_repetition_too():
    drive = Drive.zeroed()
    order = {"command_code": "new_balloon", "command_argument": 77, "command_sequence": 1}
    drive.must(KEY | order)
    drive.must(KEY | order)
    drive.must({"command_argument": 99, "command_sequence": 2})
    assert (drive.see().answer_state, drive.see().balloon_id) == ("failed", 77)


def test_what_one_peer_has_prepared_is_not_run_by_another():
    drive = Drive.zeroed()
    drive.must(KEY | {"command_code": "new_balloon", "command_argument": 77})
    drive.must({"command_sequence": 1}, ("modbus_tcp", "10.0.0.2"))
    assert (drive.see().answer_state, drive.see().balloon_id) == ("failed", 0)


def test_the_words_may_be_written_one_by_one():
    drive = Drive.zeroed()
    for word in (KEY, {"command_code": "new_balloon"}, {"command_argument": 3}, {"command_sequence": 9}):
        drive.must(word)
    assert (drive.see().answer_state, drive.see().balloon_id) == ("done", 3)


def test_a_clear_is_busy_until_the_board_has_answered():
    drive = Drive.zeroed()
    drive.causes.add(Fault.SENSOR)
    drive.run(0.1)
    drive.causes.clear()
    drive.must(CLEAR | {"command_sequence": 1})
    assert drive.see().answer_state == "busy"
    drive.run(1.0, lambda: drive.see().answer_state == "done")
    assert fault_of(drive) == 0


def test_while_one_is_busy_another_is_refused_and_its_answer_is_not_mistaken():
    drive = Drive.zeroed()
    drive.instrument.trip(HostFault.BOARD_RESET)
    drive.must(CLEAR | {"command_sequence": 1})
    another = KEY | {"command_code": "undo_zero", "command_sequence": 2}
    assert drive.write(another, ROBOT) == "state"
    drive.must(CLEAR | {"command_sequence": 1})
    drive.must(VENT, ROBOT)
    drive.run(0.5)
    seen = drive.see()
    assert (seen.answer_sequence, seen.answer_state, seen.answer_result) == (1, "done", "none")


def test_a_clear_while_the_boards_cause_lasts_fails_and_the_fault_stays():
    drive = Drive.zeroed()
    drive.causes.add(Fault.SUPPLY_VOLTAGE)
    drive.run(0.1)
    assert drive.order("clear_faults") == ("failed", "cause_persists")
    drive.run(0.1)
    assert fault_of(drive) == Fault.SUPPLY_VOLTAGE
    assert "sensor_fault" in drive.see().status
    assert drive.write(HOLD_8) == "fault_latched"


def broken_sensor(drive):
    drive.adc_sum = 0


def low_supply(drive):
    drive.supply_mv = 4700


def frozen_board(drive):
    drive.frozen = True


def test_each_bus_counts_its_own_sequence_numbers():
    drive = Drive.zeroed()
    assert drive.write(KEY | {"command_code": "self_test", "command_sequence": 1}) == "none"
    assert drive.write(KEY | {"command_code": "self_test", "command_sequence": 2}, ROBOT) == "none"
    order = {"command_code": "new_balloon", "command_argument": 77, "command_sequence": 2}
    assert drive.write(KEY | order) == "none"
    assert drive.see().balloon_id == 77
    assert drive.see(ROBOT).answer_sequence == 2


def test_no_zero_is_taken_from_a_sensor_that_has_died():
    drive = Drive.zeroed()
    drive.adc_sum = 0
    drive.run(0.1)
    assert drive.order("zero_pressure") == ("failed", "state")


@pytest.mark.parametrize("break_it", [broken_sensor, low_supply, frozen_board])
def test_a_clear_while_the_hosts_cause_lasts_fails_and_the_fault_stays(break_it):
    drive = Drive.zeroed()
    break_it(drive)
    drive.run(0.02)
    fault = fault_of(drive)
    assert fault
    assert drive.order("clear_faults") == ("failed", "cause_persists")
    assert fault_of(drive) == fault


def test_a_cause_that_comes_back_just_before_the_clear_ends_keeps_the_fault():
    drive = Drive.zeroed()
    drive.instrument.trip(HostFault.BOARD_RESET)
    drive.must(CLEAR | {"command_sequence": 1})
    drive.run(0.09)
    drive.supply_mv = 4000
    drive.feed()  # too few to trip by themselves
    drive.silence(0.03)
    assert drive.see().answer_result == "cause_persists"
    assert fault_of(drive) == HostFault.BOARD_RESET


def test_a_clear_without_a_rig_fails():
    drive = Drive.zeroed().silence(0.3)
    assert drive.order("clear_faults") == ("failed", "link_lost")


@pytest.mark.parametrize("fault", [HostFault.BOARD_RESET, HostFault.LEASE_EXPIRED, Fault.BURST])
def test_a_fault_that_comes_during_a_clear_is_not_cleared_by_it(fault):
    drive = Drive.zeroed()
    drive.instrument.trip(HostFault.DISAGREEMENT)
    drive.must(CLEAR | {"command_sequence": 1})
    drive.run(0.05)
    drive.instrument.trip(fault)
    drive.run(1.0)
    assert fault_of(drive) == fault
    assert drive.see().answer_result == "cause_persists"


def test_the_same_fault_again_during_a_clear_is_not_cleared_by_it():
    drive = Drive.zeroed()
    drive.instrument.trip(HostFault.BOARD_RESET)
    drive.must(CLEAR | {"command_sequence": 1})
    drive.instrument.trip(HostFault.BOARD_RESET)
    drive.run(1.0)
    assert fault_of(drive) == HostFault.BOARD_RESET


def test_the_board_tripping_during_a_clear_stops_the_rig_at_once():
    drive = Drive.holding()
    drive.must(CLEAR | {"command_sequence": 1})
    drive.run(0.02)
    assert drive.see().answer_state == "busy"
    drive.latched.add(Fault.BURST)
    drive.run(0.02)
    assert not drive.inflates
    assert "burst" in drive.see().status


class TestZero:
    """The pressure sensor's zero."""

    def test_it_is_taken_by_itself_when_vented_and_steady(self):
        drive = Drive.new()
        assert "not_zeroed" in drive.see().status
        drive.run(0.4)
        assert "not_zeroed" in drive.see().status
        drive.run(0.2)
        assert "not_zeroed" not in drive.see().status
        assert drive.see().pressure_kpa == pytest.approx(0.0, abs=0.01)
        assert drive.instrument.command().zero_pa == pytest.approx(300, abs=4)

    def test_it_is_not_taken_again_by_itself(self):
        drive = Drive.zeroed()
        drive.offset_kpa = 0.5
        drive.run(3.0)
        assert drive.see().pressure_kpa == pytest.approx(0.2, abs=0.01)

    def test_by_command_it_is_taken_and_undone(self):
        drive = Drive.zeroed()
        drive.offset_kpa = 0.5
        drive.run(2.0)
        assert drive.order("zero_pressure") == ("done", "none")
        assert drive.run(0.1).see().pressure_kpa == pytest.approx(0.0, abs=0.01)
        assert drive.order("undo_zero") == ("done", "none")
        assert drive.run(0.1).see().pressure_kpa == pytest.approx(0.2, abs=0.01)

    def test_the_first_one_cannot_be_undone(self):
        assert Drive.zeroed().order("undo_zero") == ("failed", "state")

    def test_not_while_inflated_or_pressed(self):
        drive = Drive.holding()
        assert drive.order("zero_pressure") == ("failed", "state")
        assert drive.order("undo_zero") == ("failed", "state")
        drive.push_kpa = 1.0
        drive.run(0.5)
        assert drive.order("zero_pressure") == ("failed", "in_contact")

    def test_not_without_a_rig(self):
        assert Drive.zeroed().silence(0.3).order("zero_pressure") == ("failed", "link_lost")


def test_a_new_balloon_starts_its_count_of_inflations_only_when_vented():
    drive = Drive.holding()
    assert drive.see().inflations == 1
    assert drive.order("new_balloon", 12) == ("failed", "state")
    drive.must(VENT)
    drive.run(1.0)
    assert drive.order("new_balloon", 12) == ("done", "none")
    assert (drive.see().inflations, drive.see().balloon_id) == (0, 12)
    drive.must(HOLD_8)
    drive.must(HOLD_8)
    assert drive.see().inflations == 1


def test_a_new_balloon_is_not_noted_while_nobody_knows_whether_the_rig_is_vented():
    assert Drive.zeroed().silence(0.3).order("new_balloon", 12) == ("failed", "link_lost")


def test_the_zero_is_not_undone_while_a_pressed_balloon_waits_for_its_vent():
    drive = Drive.zeroed()
    assert drive.order("zero_pressure") == ("done", "none")
    drive.must(VENT)
    drive.must(HOLD_8 | {"lease_s": 0.5})
    drive.renew(1.0)
    drive.push_kpa = 1.0
    drive.renew(0.5)
    drive.run(0.6)
    assert drive.instrument.vent_pending
    assert drive.order("undo_zero") == ("failed", "state")


def test_a_self_test_says_whether_all_is_in_span():
    drive = Drive.zeroed()
    assert drive.order("self_test") == ("done", "none")
    drive.supply_mv = 4000
    drive.run(0.1)
    assert drive.order("self_test") == ("failed", "cause_persists")
    assert math.isfinite(drive.see(PLC).pressure_kpa)
