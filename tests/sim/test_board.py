"""Contract tests for any board, real or simulated: identification, arming, trips and clearing."""

import itertools
import random

import pytest

from pneuforce.protocol.frames import (
    PROTOCOL_VERSION,
    BoardState,
    Command,
    CommandFlag,
    Event,
    Fault,
    Hello,
    Identify,
    Image,
    Sample,
    Valve,
    Vent,
)
from pneuforce.sim.board.states import ResetCause
from tests.sim.conftest import ZERO_PA, Bench, brief, hold, vent

LOCKED = Valve.VENT_CLOSED
FILL = Valve.VENT_CLOSED | Valve.INLET_OPEN
S = BoardState


# identification


def test_a_board_sends_hello_five_times_a_second_and_no_samples_until_a_host_has_identified(bench):
    bench.run(1.01)
    assert len(bench.all(Hello)) == 6
    assert len(bench.all(Image)) == 6
    assert len(bench.frames) == 12


@brief
def test_an_identify_is_answered_at_once_and_500_samples_a_second_follow(bench):
    bench.run(0.05).identify()
    assert isinstance(bench.frames[-2].message, Hello)
    bench.run(1.0)
    samples = [f for f in bench.frames if isinstance(f.message, Sample)]
    assert [f.sequence for f in samples] == list(range(1, 502))
    assert samples[-1].message.board_time_us - samples[0].message.board_time_us == 1_000_000


@brief
def test_a_hello_reports_the_uptime_and_the_host_timeouts(bench):
    hello = bench.identify().last(Hello)
    assert (hello.host_silence_ms, hello.host_timeout_ms) == (250, 2000)
    assert hello.uptime_ms == 2


@brief
def test_a_host_of_another_version_gets_a_hello_and_moves_no_valve(bench):
    other_version = PROTOCOL_VERSION + 1
    bench.run(0.01).to_send = bench.frame(Identify(), version=other_version)
    bench.run(0.01)
    assert len(bench.all(Hello)) == 2
    for command in (vent(), hold()) * 20:
        bench.to_send = bench.frame(command, version=other_version)
        bench.run(0.05)
        assert bench.board.valves == Valve.NONE
    assert bench.all(Sample) == []


def test_commands_before_the_identify_are_ignored(bench):
    bench.keep_sending(vent()).run(1.0).keep_sending(hold()).run(2.0)
    assert bench.board.valves == Valve.NONE
    bench.identify().run(2.0)
    assert not bench.valve_moved


@brief
def test_a_sample_contains_the_sequence_number_of_the_last_command(bench):
    bench.vented()
    bench.command = None
    frame = bench.frame(vent())
    bench.to_send = frame
    bench.step()
    assert bench.last().command == frame[4]


def test_sequence_and_board_time_wrap_without_a_gap(board_type):
    bench = Bench(board_type(), start_us=2**32 - 60_000_000).holding()
    bench.run(132)
    sequences = [f.sequence for f in bench.frames if isinstance(f.message, Sample)]
    assert all((b - a) & 0xFFFF == 1 for a, b in itertools.pairwise(sequences))
    assert min(s.board_time_us for s in bench.all(Sample)) < 4000
    assert bench.state is S.HOLDING


# conditions of an inflation


@brief
@pytest.mark.parametrize("cause", [ResetCause.WATCHDOG, ResetCause.BROWN_OUT])
def test_an_unexpected_reset_is_latched_until_it_is_cleared(board_type, cause):
    bench = Bench(board_type(reset_cause=cause)).identify()
    bench.keep_sending(vent()).run(2).keep_sending(hold()).run(2)
    assert bench.state is S.TRIPPED
    assert bench.last().faults == 1 << Fault.WATCHDOG
    assert not bench.valve_moved
    bench.keep_sending(vent(clear=1)).until_state(S.VENTED, 2)
    bench.keep_sending(hold(clear=1)).until_state(S.HOLDING, 8)


@pytest.mark.parametrize("cause", [ResetCause.POWER_ON, ResetCause.EXTERNAL])
def test_an_intended_reset_latches_no_fault(board_type, cause):
    bench = Bench(board_type(reset_cause=cause)).vented()
    assert bench.last().faults == 0


def test_hold_without_vent_never_inflates_after_boot(bench):
    bench.identify().keep_sending(hold()).run(20)
    assert not bench.valve_moved
    assert bench.state is S.VENTED


@brief
def test_vent_and_then_hold_inflates(bench):
    bench.vented().keep_sending(hold()).until_state(S.INFLATING, 0.1)
    bench.until(lambda: bench.last().valves == FILL, 0.1)
    assert bench.last().setpoint_pa == 8000


def test_hold_while_still_venting_waits_for_a_verified_vent(bench):
    bench.holding().keep_sending(vent()).run(0.1).keep_sending(hold())
    bench.until_state(S.VENTED, 3)
    assert bench.pressure_kpa < 0.3
    bench.until_state(S.HOLDING, 8)


@pytest.mark.parametrize("setpoint_pa", [0, 1, 1999, 12001, 65535])
def test_a_setpoint_outside_its_span_never_inflates(bench, setpoint_pa):
    bench.vented().keep_sending(hold(setpoint_pa)).run(3)
    assert not bench.valve_moved


@pytest.mark.parametrize(
    "command",
    [
        hold(flags=0),
        hold(flags=CommandFlag.IN_CONTACT),
        hold(zero_pa=1301),
        hold(zero_pa=-1301),
        hold(mode=2),
    ],
)
def test_nothing_inflates_without_a_zero_or_in_an_unknown_mode(bench, command):
    bench.vented().keep_sending(command).run(3)
    assert not bench.valve_moved


@pytest.mark.parametrize("zero_pa", [-1300, 1300])
def test_a_zero_at_the_edge_of_its_span_is_valid(bench, zero_pa):
    bench.vented().keep_sending(hold(zero_pa=zero_pa)).until_state(S.INFLATING, 0.1)


@pytest.mark.parametrize("flags", [0, CommandFlag.IN_CONTACT])
def test_a_held_balloon_ignores_the_setpoint_of_a_host_without_a_zero(bench, flags):
    bench.holding().keep_sending(hold(9000, flags=flags)).run(0.5).keep_sending(hold()).run(1)
    assert bench.state is S.HOLDING
    assert {s.setpoint_pa for s in bench.all(Sample)} == {0, 8000}


def test_the_vent_is_shut_before_the_inlet_opens_also_after_an_interrupted_inflation(bench):
    bench.inflating().keep_sending(vent()).until_state(S.VENTED, 3)
    bench.keep_sending(hold()).until_state(S.INFLATING, 0.2)
    assert bench.last().valves == LOCKED
    bench.step()
    assert bench.last().valves == FILL


def test_hold_never_inflates_a_tripped_board(bench):
    bench.tripped().run(30)
    assert bench.state is S.TRIPPED
    assert bench.last().valves == Valve.NONE


def test_after_a_trip_only_clear_then_vent_then_hold_inflates(bench):
    bench.tripped()
    bench.keep_sending(vent()).run(1).keep_sending(hold()).run(1)
    assert bench.state is S.TRIPPED, "the trip ended without a clear"
    bench.keep_sending(hold(clear=1)).run(3)
    assert bench.state is S.VENTED, "the board inflated without a vent after the clear"
    bench.keep_sending(vent(clear=1)).run(0.2).keep_sending(hold(clear=1))
    bench.until_state(S.HOLDING, 8)


def test_hold_without_vent_does_not_inflate_after_trip_and_clear(bench):
    bench.tripped().keep_sending(hold(clear=1)).until_state(S.VENTED, 3)
    bench.run(3)
    assert bench.state is S.VENTED


def test_a_trip_is_reported_once_with_its_cause(bench):
    bench.tripped()
    trips = [(e.previous_state, Fault(e.fault)) for e in bench.all(Event) if e.state == S.TRIPPED]
    assert trips == [(S.HOLDING, Fault.SUPPLY_VOLTAGE)]


def test_the_first_clear_after_an_identify_is_only_a_reference(bench):
    bench.tripped().identify().keep_sending(vent(clear=7)).run(1)
    assert bench.state is S.TRIPPED
    bench.keep_sending(vent(clear=8)).until_state(S.VENTED, 3)


def test_a_clear_while_the_cause_lasts_changes_nothing(bench):
    bench.tripped()
    bench.supply_mv = 4000
    bench.keep_sending(vent(clear=1)).run(0.5)
    bench.supply_mv = 5000
    bench.run(1)
    assert bench.last().fault == Fault.SUPPLY_VOLTAGE
    bench.keep_sending(vent(clear=2)).until_state(S.VENTED, 3)
    assert bench.last().faults == 0


def test_a_clear_never_moves_a_valve(bench):
    bench.holding().keep_sending(hold(clear=1)).run(1)
    assert bench.last().valves == LOCKED
    assert bench.state is S.HOLDING


@pytest.mark.parametrize("phase", ["inflating", "settling", "holding"])
def test_a_vent_message_vents_and_a_continued_hold_does_not_inflate_again(bench, phase):
    getattr(bench, phase)()
    bench.to_send = bench.frame(Vent())
    bench.step()
    assert bench.last().valves == Valve.NONE
    bench.run(10)
    assert bench.state is S.VENTED
    bench.keep_sending(vent()).run(0.1).keep_sending(hold()).until_state(S.HOLDING, 8)


@brief
def test_a_vent_message_needs_no_identify(bench):
    bench.to_send = bench.frame(Vent())
    bench.run(1)
    assert bench.board.valves == Valve.NONE


@pytest.mark.parametrize("phase", ["inflating", "settling"])
def test_a_new_identify_vents_an_unfinished_inflation(bench, phase):
    getattr(bench, phase)().identify()
    assert bench.state is S.VENTING
    bench.run(10)
    assert bench.state is S.VENTED


def test_a_new_identify_leaves_a_held_balloon_locked_until_vent_is_requested(bench):
    bench.holding().identify().keep_sending(hold(10_000)).run(3)
    assert bench.state is S.HOLDING
    assert bench.last().setpoint_pa == 8000


def test_a_host_that_was_silent_while_the_rig_was_empty_must_request_vent_again(bench):
    bench.vented().command = None
    bench.run(0.4).keep_sending(hold()).run(3)
    assert not bench.valve_moved


@brief
def test_no_bytes_on_the_line_open_the_inlet_of_an_empty_rig(bench):
    noise = random.Random(3)
    bench.identify()
    for _ in range(2000):
        bench.to_send = noise.randbytes(40)
        bench.step()
    assert not bench.valve_moved


def test_random_commands_never_violate_the_limits(bench):
    """The inlet is open only while the board inflates or settles, even after random commands."""
    draw = random.Random(5)
    bench.identify()
    for _ in range(400):
        command = Command(
            mode=draw.choice([0, 0, 1, 1, 1, 1, 9]),
            flags=draw.choice([2, 2, 2, 3, 0, 255]),
            setpoint_pa=draw.choice([0, 1999, 2000, 8000, 12000, 12001, 65535]),
            zero_pa=draw.choice([ZERO_PA] * 6 + [-32768, 32767, 1300]),
            contact_limit_pa=65535,
            host_timeout_ms=draw.choice([0, 2000, 65535]),
            clear=draw.choice([0, 1, 2]),
        )
        bench.keep_sending(command).run(draw.choice([0.02, 0.1, 0.1, 1.5]))
    assert any(s.valves & Valve.INLET_OPEN for s in bench.all(Sample)), (
        "the random commands never opened the inlet"
    )
    for sample in bench.all(Sample):
        inlet_may_open = sample.state in (S.INFLATING, S.SETTLING)
        assert inlet_may_open or not sample.valves & Valve.INLET_OPEN
        assert sample.state in (S.INFLATING, S.SETTLING, S.HOLDING) or sample.valves == Valve.NONE
        assert sample.setpoint_pa == 0 or 2000 <= sample.setpoint_pa <= 12000
    assert max(s.adc_sum for s in bench.all(Sample)) <= 16384 * (0.018 * 14.2 + 0.04)
