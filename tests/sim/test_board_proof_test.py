"""Contract tests for any board: the two valve pulses of the proof test."""

import pytest

from pneuforce.protocol.frames import BoardState, CommandFlag, Fault, Sample, Valve
from tests.sim.conftest import brief, hold

FILL, LOCKED, SAFE = Valve.INLET_OPEN | Valve.VENT_CLOSED, Valve.VENT_CLOSED, Valve.NONE
S = BoardState
PRESSED = CommandFlag.ZEROED | CommandFlag.IN_CONTACT


def start_test(bench, setpoint_pa=8000, **fields):
    """Request a proof test of a held balloon. Return the number of frames before the request."""
    before = len(bench.frames)
    bench.keep_sending(hold(setpoint_pa, proof_test=1, **fields))
    return before


def valve_times_ms(bench, before):
    """Return the states of the valves since a frame, each with its duration [ms]."""
    times = []
    for frame in bench.frames[before:]:
        if not isinstance(frame.message, Sample) or frame.message.state != S.TESTING:
            continue
        if not times or times[-1][0] != frame.message.valves:
            times.append([frame.message.valves, 0])
        times[-1][1] += 2
    return [tuple(entry) for entry in times]


@brief
@pytest.mark.parametrize(("setpoint_pa", "vent_ms"), [(2000, 20), (5000, 12), (8000, 10), (12000, 8)])
def test_each_valve_opens_once_and_the_balloon_stays_held(bench, setpoint_pa, vent_ms):
    bench.holding(setpoint_pa)
    before = start_test(bench, setpoint_pa)
    bench.until_state(S.TESTING, 0.1)
    took_s = bench.until_state(S.HOLDING, 1.0)
    (inlet, *locked_1), (vent, *locked_2) = (
        valve_times_ms(bench, before)[:2],
        valve_times_ms(bench, before)[2:],
    )
    assert inlet == (FILL, 16)
    assert vent[0] == SAFE
    assert vent[1] in (vent_ms, vent_ms + 2)  # longer if the pressure is above its band
    assert [valves for valves, _ in (*locked_1, *locked_2)] == [LOCKED, LOCKED]
    assert took_s == pytest.approx(0.72, abs=0.004)


def test_a_test_changes_the_pressure_by_at_most_100_pa_and_leaves_it_as_it_was(bench):
    bench.holding()
    before_kpa = bench.pressure_kpa
    start_test(bench)
    pressures_kpa = []
    bench.until_state(S.TESTING, 0.1)
    bench.until(lambda: pressures_kpa.append(bench.pressure_kpa) or bench.state is S.HOLDING, 1.0)
    assert 0.05 < max(pressures_kpa) - before_kpa <= 0.1
    assert bench.pressure_kpa == pytest.approx(before_kpa, abs=0.02)


@pytest.mark.parametrize("setpoint_pa", [2000, 5000, 8000, 12000])
def test_a_test_changes_the_amount_of_gas_by_at_most_10_pa(bench, setpoint_pa):
    before_kpa = bench.holding(setpoint_pa).gas_kpa
    start_test(bench, setpoint_pa)
    bench.run(1.0)
    assert bench.gas_kpa == pytest.approx(before_kpa, abs=0.02)


def test_without_gas_supply_no_gas_is_vented(bench):
    before_kpa = bench.holding().gas_kpa
    bench.fill_kpa_per_s = 0.0
    before = start_test(bench)
    bench.run(1.0)
    assert [valves for valves, _ in valve_times_ms(bench, before)] == [FILL, LOCKED]
    assert bench.gas_kpa == before_kpa


def test_a_second_test_has_the_same_pulses_as_the_first(bench):
    bench.holding()
    pulses = []
    for count in (1, 2):
        before = len(bench.frames)
        bench.keep_sending(hold(8000, proof_test=count))
        bench.run(2.0)
        pulses.append([(valves, duration_ms) for valves, duration_ms in valve_times_ms(bench, before)])
    assert pulses[0][0] == pulses[1][0] == (FILL, 16)
    assert sum(duration_ms for _, duration_ms in pulses[1]) == sum(
        duration_ms for _, duration_ms in pulses[0]
    )


def test_only_a_changed_count_starts_a_test(bench):
    bench.holding()
    start_test(bench)
    bench.run(2.0)
    before = len(bench.frames)
    bench.run(2.0)
    assert valve_times_ms(bench, before) == []


def test_the_first_count_after_identify_is_the_reference(bench):
    bench.holding().identify()
    before = start_test(bench)
    bench.run(1.0)
    assert valve_times_ms(bench, before) == []


@pytest.mark.parametrize("fields", [{"flags": PRESSED}, {"setpoint_pa": 9000}])
def test_no_test_starts_in_a_contact_or_with_a_new_setpoint_and_none_later(bench, fields):
    bench.holding()
    before = start_test(bench, **fields)
    bench.run(0.2).keep_sending(hold(fields.get("setpoint_pa", 8000), proof_test=1)).run(6.0)
    assert valve_times_ms(bench, before) == []


def test_a_vented_board_ignores_the_request(bench):
    bench.vented().keep_sending(hold(proof_test=1)).run(0.004)
    before = len(bench.frames)
    bench.until_state(S.HOLDING, 8)
    bench.run(1.0)
    assert valve_times_ms(bench, before) == []


def test_a_silent_host_shuts_the_inlet_but_the_vent_pulse_follows(bench):
    bench.holding().run(0.3)
    bench.command = None
    bench.run(0.2)
    before = len(bench.frames)
    bench.to_send = bench.frame(hold(proof_test=1))
    bench.run(0.9)
    assert [valves for valves, _ in valve_times_ms(bench, before)] == [FILL, LOCKED, SAFE, LOCKED]
    bench.until_state(S.TRIPPED, 3)
    assert bench.last().fault == Fault.HOST_SILENT


def test_an_invalid_sensor_shuts_the_inlet(bench):
    bench.holding()
    before = start_test(bench)
    bench.until_state(S.TESTING, 0.1)
    bench.adc_sum = 0
    bench.run(0.006)
    assert valve_times_ms(bench, before)[-1][0] == LOCKED


def test_the_vent_pulse_is_longer_if_the_pressure_is_above_its_band(bench):
    bench.holding()
    bench.gas_kpa += 0.1
    bench.run(0.5)
    before = start_test(bench)
    bench.until_state(S.TESTING, 0.1)
    bench.until_state(S.HOLDING, 1.0)
    assert (SAFE, 12) in valve_times_ms(bench, before)


def test_a_vent_ends_the_test_at_once(bench):
    bench.holding()
    start_test(bench)
    bench.until_state(S.TESTING, 0.1)
    bench.keep_sending(hold(0, mode=0)).until_state(S.VENTING, 0.01)
    assert bench.board.valves == SAFE


def test_limits_of_the_held_balloon_apply_during_the_test(bench):
    bench.holding()
    start_test(bench)
    bench.until_state(S.TESTING, 0.1)
    bench.contact_kpa = 11.0
    bench.until_state(S.TRIPPED, 0.3)
    assert bench.last().fault == Fault.OVERPRESSURE
