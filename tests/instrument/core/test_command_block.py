"""Tests of the command block: each new sequence number runs one command and gives one answer."""

import math

import pytest

from pneuforce.instrument.core import operations
from pneuforce.instrument.core.faults import HostFault
from pneuforce.instrument.core.peers import MAX_PEERS
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import ForceLaw, known_results
from pneuforce.instrument.recording.checkpoint import save_session
from pneuforce.protocol.frames import Fault
from tests.instrument.instrument_harness import HOLD_8, KEY, PLC, ROBOT, VENT, InstrumentHarness

CLEAR = KEY | {"command_code": "clear_faults"}


def fault_of(harness):
    return harness.snapshot().first_out_fault


def test_the_same_sequence_repeats_the_answer_and_does_not_run_again():
    harness = InstrumentHarness.zeroed()
    request = KEY | {"command_code": "new_balloon", "command_argument": 7, "command_sequence": 5}
    harness.write_ok(request)
    harness.instrument.balloon_id = 99
    harness.write_ok(request)
    seen = harness.snapshot()
    assert (seen.balloon_id, seen.answer_sequence, seen.answer_state) == (99, 5, "done")
    harness.write_ok(request | {"command_sequence": 6})
    assert harness.snapshot().balloon_id == 7


@pytest.mark.parametrize("wrong", [{}, {"command_code": "clear_faults"}, KEY, KEY | {"command_code": "none"}])
def test_without_key_or_code_nothing_runs_and_the_answer_says_failed(wrong):
    harness = InstrumentHarness.zeroed()
    harness.instrument.trip(HostFault.BOARD_RESET)
    harness.write_ok(wrong | {"command_sequence": 1})
    harness.run(0.6)
    assert harness.snapshot().answer_state == "failed"
    assert fault_of(harness) == HostFault.BOARD_RESET


def test_the_key_is_consumed_by_each_run():
    harness = InstrumentHarness.zeroed()
    harness.write_ok(KEY | {"command_code": "self_test", "command_sequence": 1})
    assert harness.snapshot().answer_state == "done"
    harness.write_ok({"command_sequence": 2})
    assert harness.snapshot().answer_state == "failed"


def test_the_key_is_consumed_by_a_repetition_too():
    harness = InstrumentHarness.zeroed()
    order = {"command_code": "new_balloon", "command_argument": 77, "command_sequence": 1}
    harness.write_ok(KEY | order)
    harness.write_ok(KEY | order)
    harness.write_ok({"command_argument": 99, "command_sequence": 2})
    assert (harness.snapshot().answer_state, harness.snapshot().balloon_id) == ("failed", 77)


def test_a_command_prepared_by_one_peer_is_not_run_by_another():
    harness = InstrumentHarness.zeroed()
    harness.write_ok(KEY | {"command_code": "new_balloon", "command_argument": 77})
    other = ("modbus_tcp", "10.0.0.2")
    harness.write_ok({"command_sequence": 1}, other)
    assert (harness.snapshot(other).answer_state, harness.snapshot().balloon_id) == ("failed", 0)


def test_two_masters_with_the_same_sequence_number_run_both_commands():
    harness = InstrumentHarness.zeroed()
    other = ("modbus_tcp", "10.0.0.2")
    request = KEY | {"command_code": "new_balloon", "command_sequence": 1}
    harness.write_ok(request | {"command_argument": 7})
    assert (harness.snapshot(PLC).answer_sequence, harness.snapshot(other).answer_sequence) == (1, 0)
    harness.write_ok(request | {"command_argument": 8}, other)
    assert harness.snapshot().balloon_id == 8
    assert [harness.snapshot(peer).answer_sequence for peer in (PLC, other)] == [1, 1]


def test_the_staged_words_of_a_master_are_not_exchanged_by_another():
    harness = InstrumentHarness.zeroed()
    harness.write_ok(KEY | {"command_code": "new_balloon", "command_argument": 7})
    harness.write_ok(
        KEY | {"command_code": "clear_faults", "command_argument": 9}, ("modbus_tcp", "10.0.0.2")
    )
    harness.write_ok({"command_sequence": 1})
    assert (harness.snapshot().answer_state, harness.snapshot().balloon_id) == ("done", 7)


def test_all_browsers_see_the_answer_to_a_command_of_one_browser():
    harness = InstrumentHarness.zeroed()
    harness.write_ok(KEY | {"command_code": "self_test", "command_sequence": 4}, ("web", "10.0.0.3"))
    for peer in (("web", ""), ("web", "10.0.0.4")):
        assert (harness.snapshot(peer).answer_sequence, harness.snapshot(peer).answer_state) == (4, "done")
    assert harness.snapshot().answer_sequence == 0


def test_commands_of_many_masters_need_bounded_memory():
    harness = InstrumentHarness.zeroed()
    for number in range(2 * MAX_PEERS):
        harness.write_ok(KEY | {"command_sequence": 3}, ("modbus_tcp", f"10.1.{number >> 8}.{number & 255}"))
    assert sum(harness.instrument.peers.knows(("modbus_tcp", f"10.1.0.{n}")) for n in range(256)) == 0
    assert harness.snapshot(("modbus_tcp", "10.1.1.255")).answer_sequence == 3
    assert len(save_session(Session(harness.instrument))) < 200_000


def test_the_fields_can_be_written_one_by_one():
    harness = InstrumentHarness.zeroed()
    for word in (KEY, {"command_code": "new_balloon"}, {"command_argument": 3}, {"command_sequence": 9}):
        harness.write_ok(word)
    assert (harness.snapshot().answer_state, harness.snapshot().balloon_id) == ("done", 3)


def test_a_clear_is_busy_until_the_board_answers():
    harness = InstrumentHarness.zeroed()
    harness.causes.add(Fault.SENSOR)
    harness.run(0.1)
    harness.causes.clear()
    harness.write_ok(CLEAR | {"command_sequence": 1})
    assert harness.snapshot().answer_state == "busy"
    harness.run(1.0, lambda: harness.snapshot().answer_state == "done")
    assert fault_of(harness) == 0


@pytest.mark.parametrize("code", ["clear_faults", "new_balloon"])
def test_each_command_changes_the_count_that_the_board_compares(code):
    harness, counts = InstrumentHarness.zeroed(), []
    for _ in range(3):
        assert harness.run_command(code, 7) == ("done", "none")
        counts.append(harness.instrument.command().clear)
    assert len(set(counts)) == 3


def test_a_second_command_is_rejected_while_one_is_busy():
    harness = InstrumentHarness.zeroed()
    harness.instrument.trip(HostFault.BOARD_RESET)
    harness.write_ok(CLEAR | {"command_sequence": 1})
    another = KEY | {"command_code": "restore_zero", "command_sequence": 2}
    assert harness.write(another, ROBOT) == "state"
    harness.write_ok(CLEAR | {"command_sequence": 1})
    harness.write_ok(VENT, ROBOT)
    harness.run(0.5)
    seen = harness.snapshot()
    assert (seen.answer_sequence, seen.answer_state, seen.answer_result) == (1, "done", "none")


def test_a_clear_while_the_boards_cause_lasts_fails_and_the_fault_stays():
    harness = InstrumentHarness.zeroed()
    harness.causes.add(Fault.SUPPLY_VOLTAGE)
    harness.run(0.1)
    assert harness.run_command("clear_faults") == ("failed", "cause_persists")
    harness.run(0.1)
    assert fault_of(harness) == Fault.SUPPLY_VOLTAGE
    assert "sensor_fault" in harness.snapshot().status
    assert harness.write(HOLD_8) == "fault_latched"


def broken_sensor(harness):
    harness.adc_sum = 0


def low_supply(harness):
    harness.supply_mv = 4700


def frozen_board(harness):
    harness.clock_invalid = True


def test_each_bus_counts_its_own_sequence_numbers():
    harness = InstrumentHarness.zeroed()
    assert harness.write(KEY | {"command_code": "self_test", "command_sequence": 1}) == "none"
    assert harness.write(KEY | {"command_code": "self_test", "command_sequence": 2}, ROBOT) == "none"
    order = {"command_code": "new_balloon", "command_argument": 77, "command_sequence": 2}
    assert harness.write(KEY | order) == "none"
    assert harness.snapshot().balloon_id == 77
    assert harness.snapshot(ROBOT).answer_sequence == 2


def test_no_zero_is_taken_from_a_failed_sensor():
    harness = InstrumentHarness.zeroed()
    harness.adc_sum = 0
    harness.run(0.1)
    assert harness.run_command("zero_pressure") == ("failed", "state")


@pytest.mark.parametrize("break_it", [broken_sensor, low_supply, frozen_board])
def test_a_clear_while_the_hosts_cause_lasts_fails_and_the_fault_stays(break_it):
    harness = InstrumentHarness.zeroed()
    break_it(harness)
    harness.run(0.02)
    fault = fault_of(harness)
    assert fault
    assert harness.run_command("clear_faults") == ("failed", "cause_persists")
    assert fault_of(harness) == fault


def test_a_cause_that_returns_just_before_the_end_of_a_clear_keeps_the_fault():
    harness = InstrumentHarness.zeroed()
    harness.instrument.trip(HostFault.BOARD_RESET)
    harness.write_ok(CLEAR | {"command_sequence": 1})
    harness.run(0.098)
    harness.supply_mv = 4000
    for _ in range(2):
        harness.feed()  # too few samples to trip
    harness.run_without_samples(0.01)
    assert harness.snapshot().answer_result == "cause_persists"
    assert fault_of(harness) == HostFault.BOARD_RESET


@pytest.mark.parametrize("port_lost", [False, True])
@pytest.mark.parametrize("pulled_before_s", [0.24, 0.15, 0.08, 0.02, 0.0, -0.02, -0.08])
def test_a_clear_is_not_done_if_the_cable_was_pulled_shortly_before_or_after_it(pulled_before_s, port_lost):
    """A clear within 0.1 s of a pulled cable was answered "done", and the link was lost 0.1 s later."""
    harness = InstrumentHarness.zeroed()
    harness.instrument.trip(HostFault.BOARD_RESET)
    if port_lost and pulled_before_s > 0:
        harness.instrument.disconnected()
    harness.run_without_samples(pulled_before_s)
    harness.write_ok(CLEAR | {"command_sequence": 1})
    harness.run(max(0.0, -pulled_before_s))
    answers = []
    for _ in range(60):
        harness.run_without_samples(0.01)
        answers.append(harness.snapshot().answer_state)
    assert "done" not in answers
    assert answers[0] == "busy"
    assert harness.snapshot().answer_result == "link_lost"
    assert {HostFault.BOARD_RESET, HostFault.LINK_LOST} <= set(harness.snapshot().faults)


@pytest.mark.parametrize("silent_s", [0.05, 0.2])
def test_a_clear_waits_for_samples_that_are_late(silent_s):
    harness = InstrumentHarness.zeroed()
    harness.instrument.trip(HostFault.BOARD_RESET)
    harness.write_ok(CLEAR | {"command_sequence": 1})
    harness.run_without_samples(silent_s)
    assert harness.snapshot().answer_state == "busy"
    harness.run(0.11)
    assert harness.snapshot().answer_state == "done"
    assert fault_of(harness) == 0


def test_a_clear_without_a_rig_fails():
    harness = InstrumentHarness.zeroed().run_without_samples(0.3)
    assert harness.run_command("clear_faults") == ("failed", "link_lost")


@pytest.mark.parametrize("fault", [HostFault.BOARD_RESET, HostFault.LEASE_EXPIRED, Fault.BURST])
def test_a_fault_that_comes_during_a_clear_is_not_cleared_by_it(fault):
    harness = InstrumentHarness.zeroed()
    harness.instrument.trip(HostFault.DISAGREEMENT)
    harness.write_ok(CLEAR | {"command_sequence": 1})
    harness.run(0.05)
    harness.instrument.trip(fault)
    harness.run(1.0)
    assert fault_of(harness) == fault
    assert harness.snapshot().answer_result == "cause_persists"


def test_the_same_fault_again_during_a_clear_is_not_cleared_by_it():
    harness = InstrumentHarness.zeroed()
    harness.instrument.trip(HostFault.BOARD_RESET)
    harness.write_ok(CLEAR | {"command_sequence": 1})
    harness.instrument.trip(HostFault.BOARD_RESET)
    harness.run(1.0)
    assert fault_of(harness) == HostFault.BOARD_RESET


def test_the_board_tripping_during_a_clear_stops_the_rig_at_once():
    harness = InstrumentHarness.holding()
    harness.write_ok(CLEAR | {"command_sequence": 1})
    harness.run(0.02)
    assert harness.snapshot().answer_state == "busy"
    harness.latched.add(Fault.BURST)
    harness.run(0.02)
    assert not harness.commands_hold
    assert "burst" in harness.snapshot().status


class TestZero:
    """Tests of the zero adjustment of the pressure sensor."""

    def test_the_zero_is_taken_automatically_when_vented_and_steady(self):
        harness = InstrumentHarness.new()
        assert "not_zeroed" in harness.snapshot().status
        harness.run(0.4)
        assert "not_zeroed" in harness.snapshot().status
        harness.run(0.2)
        assert "not_zeroed" not in harness.snapshot().status
        assert harness.snapshot().pressure_kpa == pytest.approx(0.0, abs=0.01)
        assert harness.instrument.command().zero_pa == pytest.approx(300, abs=4)

    def test_the_zero_is_taken_automatically_only_once(self):
        harness = InstrumentHarness.zeroed()
        harness.offset_kpa = 0.5
        harness.run(3.0)
        assert harness.snapshot().pressure_kpa == pytest.approx(0.2, abs=0.01)

    def test_the_zero_is_taken_and_restored_by_command(self):
        harness = InstrumentHarness.zeroed()
        harness.offset_kpa = 0.5
        harness.run(2.0)
        assert harness.run_command("zero_pressure") == ("done", "none")
        assert harness.run(0.1).snapshot().pressure_kpa == pytest.approx(0.0, abs=0.01)
        assert harness.run_command("restore_zero") == ("done", "none")
        assert harness.run(0.1).snapshot().pressure_kpa == pytest.approx(0.2, abs=0.01)

    def test_the_first_zero_cannot_be_undone(self):
        assert InstrumentHarness.zeroed().run_command("restore_zero") == ("failed", "state")

    def test_the_zero_is_not_changed_while_inflated_or_pressed(self):
        harness = InstrumentHarness.holding()
        assert harness.run_command("zero_pressure") == ("failed", "state")
        assert harness.run_command("restore_zero") == ("failed", "state")
        harness.push_kpa = 1.0
        harness.run(0.5)
        assert harness.run_command("zero_pressure") == ("failed", "in_contact")

    def test_the_zero_is_not_taken_without_a_rig(self):
        assert InstrumentHarness.zeroed().run_without_samples(0.3).run_command("zero_pressure") == (
            "failed",
            "link_lost",
        )

    def test_a_link_that_was_lost_in_contact_is_the_reason_not_the_contact(self):
        harness = InstrumentHarness.holding()
        harness.push_kpa = 1.0
        harness.run(0.5).run_without_samples(0.3)
        assert harness.run_command("zero_pressure") == ("failed", "link_lost")


def test_a_new_balloon_starts_its_count_of_inflations_only_when_vented():
    harness = InstrumentHarness.holding()
    assert harness.snapshot().inflation_count == 1
    assert harness.run_command("new_balloon", 12) == ("failed", "state")
    harness.write_ok(VENT)
    harness.run(1.0)
    assert harness.run_command("new_balloon", 12) == ("done", "none")
    assert (harness.snapshot().inflation_count, harness.snapshot().balloon_id) == (0, 12)
    harness.write_ok(HOLD_8)
    harness.write_ok(HOLD_8)
    assert harness.snapshot().inflation_count == 1


def test_a_new_balloon_has_no_top_ups_on_the_board():
    """The board deletes its record of top-ups when the value `clear` changes."""
    harness = InstrumentHarness.zeroed()
    before = harness.instrument.command().clear
    harness.run_command("new_balloon", 12)
    assert harness.instrument.command().clear == before + 1


def test_a_new_balloon_clears_no_fault():
    harness = InstrumentHarness.zeroed()
    harness.instrument.trip(HostFault.LEASE_EXPIRED)
    before = harness.instrument.command().clear
    assert harness.run_command("new_balloon", 12) == ("done", "none")
    assert harness.instrument.command().clear == before
    assert harness.snapshot().first_out_fault == HostFault.LEASE_EXPIRED


def test_a_new_balloon_is_rejected_if_the_vent_is_not_verified():
    assert InstrumentHarness.zeroed().run_without_samples(0.3).run_command("new_balloon", 12) == (
        "failed",
        "link_lost",
    )


def test_the_zero_is_not_undone_while_a_pressed_balloon_waits_for_its_vent():
    harness = InstrumentHarness.zeroed()
    assert harness.run_command("zero_pressure") == ("done", "none")
    harness.write_ok(VENT)
    harness.write_ok(HOLD_8 | {"lease_s": 0.5})
    harness.renew(1.0)
    harness.push_kpa = 1.0
    harness.renew(0.5)
    harness.run(0.6)
    assert harness.instrument.vent_pending
    assert harness.run_command("restore_zero") == ("failed", "state")


def test_a_self_test_reports_values_outside_their_limits():
    harness = InstrumentHarness.zeroed()
    assert harness.run_command("self_test") == ("done", "none")
    harness.supply_mv = 4000
    harness.run(0.1)
    assert harness.run_command("self_test") == ("failed", "cause_persists")
    assert math.isfinite(harness.snapshot(PLC).pressure_kpa)


def test_a_self_test_fails_if_the_computer_computes_wrong_forces(monkeypatch):
    harness = InstrumentHarness.zeroed()
    monkeypatch.setitem(known_results.KNOWN_N, "energetic", (0.7571816619, 1.4380119859, 2.38))
    assert harness.run_command("self_test") == ("failed", "cause_persists")


@pytest.mark.parametrize(("method", "known"), [("membrane", "energetic"), ("lulevich", "lulevich")])
def test_a_self_test_computes_known_forces_of_a_published_method(method, known, monkeypatch):
    computed = []
    monkeypatch.setattr(operations, "computes_known_forces", computed.append)
    assert not operations._computes_correctly(ChainSettings(law=ForceLaw(method=method)))
    assert computed == [known]


def test_a_self_test_of_a_held_balloon_makes_a_proof_test_due():
    harness = InstrumentHarness.holding()
    harness.run(3.0)
    assert harness.instrument.proof_tests.count == 0
    assert harness.run_command("self_test") == ("done", "none")
    harness.run(0.1)
    assert harness.instrument.proof_tests.count == 1
