"""Tests of the snapshot: all its quantities belong to one sample, one time and one peer."""

import math

import pytest

from pneuforce.client.details import details_of
from pneuforce.instrument.core.faults import HostFault, codes_of
from pneuforce.instrument.core.settings import Identity
from pneuforce.instrument.core.snapshot import writable_values
from pneuforce.protocol.frames import BoardKind, BoardState, Fault
from pneuforce.registers.codes import CONDENSED, STATUS
from pneuforce.registers.map import BY_NAME, MAP_VERSION, REGISTERS
from tests.instrument.instrument_harness import (
    HOLD_8,
    OUR_FIRMWARE,
    ROBOT,
    VENT,
    WEB,
    InstrumentHarness,
    hello_of,
)

CONTACT_QUANTITIES = ("force_n", "rise_kpa", "indentation_mm", "contact_radius_mm")


def pressed(push_kpa=1.0, **settings):
    harness = InstrumentHarness.holding(**settings)
    harness.push_kpa = push_kpa
    return harness.run(0.8)


def test_a_snapshot_is_immutable():
    seen = InstrumentHarness.zeroed().snapshot()
    with pytest.raises(AttributeError):
        seen.force_n = 1.0
    assert isinstance(seen.status, frozenset)


def test_a_snapshot_does_not_change_with_the_instrument():
    harness = pressed()
    seen = harness.snapshot()
    copy = seen._replace()
    harness.push_kpa = 3.0
    harness.write({"force_limit_n": 1.0})
    harness.run(0.5)
    assert seen == copy
    assert harness.snapshot() != copy


def test_all_quantities_belong_to_one_sample():
    harness = InstrumentHarness.holding()
    harness.push_kpa = 2.0
    for _ in range(200):
        m = harness.feed()
        seen = harness.snapshot()
        assert (seen.pressure_kpa, seen.force_n) == (m.pressure_kpa, m.force_n)
        if m.in_contact:
            assert (seen.rise_kpa, seen.baseline_pressure_kpa) == (m.rise_kpa, m.baseline_kpa)
            assert seen.force_n == pytest.approx(
                1e-3 * math.pi * (m.baseline_kpa + m.rise_kpa) * seen.contact_radius_mm**2, rel=1e-3
            )


def test_the_age_of_a_baseline_that_was_never_measured_is_not_available():
    register = BY_NAME["baseline_age"]
    never = register.encode(InstrumentHarness.zeroed().snapshot().baseline_age_s)
    assert never == register.not_available == 0xFFFF
    assert math.isnan(register.decode(never))
    assert 0 <= pressed().snapshot().baseline_age_s < 2


def test_the_time_of_the_sample_is_shown_on_both_clocks():
    harness = InstrumentHarness.new()
    before = harness.snapshot()
    assert (before.sample_time_ms, before.sample_utc, before.sample_utc_ms) == (0, 0, 0)
    harness.now_s = 4_294_967.0
    harness.instrument.utc_offset_s = 1_800_000_000.25
    t_s = harness.feed().t_s
    harness.now_s += 0.05  # the time is that of the sample and not that of the read
    seen = harness.snapshot()
    assert seen.sample_time_ms == pytest.approx(t_s * 1e3, abs=1)
    utc_s = seen.sample_utc + seen.sample_utc_ms / 1e3
    assert utc_s == pytest.approx(t_s + 1_800_000_000.25, abs=0.001)
    harness.now_s = 4_294_968.0
    harness.feed()
    register = BY_NAME["sample_time"]
    assert register.encode(harness.snapshot().sample_time_ms) == pytest.approx(1002 - 296, abs=1)  # 2³² ms


def test_without_a_wall_clock_the_utc_time_is_unknown():
    seen = InstrumentHarness.zeroed().snapshot()
    assert seen.sample_time_ms > 0
    assert (seen.sample_utc, seen.sample_utc_ms) == (0, 0)


def without_a_sensor():
    harness = pressed()
    harness.adc_sum = 0
    return harness.run(0.1)


SITUATIONS = {
    "before the first sample": InstrumentHarness.new,
    "zeroed": InstrumentHarness.zeroed,
    "ready": InstrumentHarness.ready,
    "holding": InstrumentHarness.holding,
    "touched": lambda: pressed(0.3),
    "pressed": lambda: pressed(1.0),
    "pressed hard": lambda: pressed(9.0),
    "link lost": lambda: pressed().run_without_samples(1.0),
    "without a sensor": without_a_sensor,
}
in_every_situation = pytest.mark.parametrize("situation", SITUATIONS.values(), ids=SITUATIONS)


@in_every_situation
def test_every_register_can_be_rendered_in_every_situation(situation):
    seen = situation().snapshot()
    for register in REGISTERS:
        if register.quantity:
            code = register.encode(getattr(seen, register.quantity))
            assert not isinstance(code, complex)
            if register.wire.max_code is not None:
                assert register.wire.min_code <= code <= register.wire.max_code, register.name


@in_every_situation
def test_no_number_is_infinite_or_of_another_type(situation):
    seen = situation().snapshot()
    for name, value in seen._asdict().items():
        assert isinstance(value, (float, int, str, frozenset, tuple)), name
        assert not (isinstance(value, float) and math.isinf(value)), name


@in_every_situation
def test_every_status_name_has_a_bit(situation):
    known = {bit.name for bit in (*STATUS.bits, *CONDENSED.bits)}
    assert situation().snapshot().status <= known


def test_while_holding_without_contact_the_contact_quantities_are_zero():
    seen = InstrumentHarness.holding().snapshot()
    assert [getattr(seen, name) for name in CONTACT_QUANTITIES] == [0.0, 0.0, 0.0, 0.0]
    assert 0.01 < seen.force_std_n < 0.5
    assert seen.radius_mm == pytest.approx(8.242, abs=5e-3)
    assert {"holding", "force_valid"} <= seen.status
    assert "failure" not in seen.status


@pytest.mark.parametrize("state", [s for s in BoardState if s is not BoardState.HOLDING])
def test_in_every_other_state_there_is_a_pressure_and_no_contact(state):
    harness = InstrumentHarness.zeroed()
    harness.feed(state=state)
    seen = harness.snapshot()
    for name in (*CONTACT_QUANTITIES, "radius_mm", "force_std_n"):
        assert math.isnan(getattr(seen, name)), name
    assert math.isfinite(seen.pressure_kpa)
    assert "force_valid" not in seen.status


def test_in_contact_the_force_comes_with_its_uncertainty():
    seen = pressed(1.0).snapshot()
    assert seen.force_n > 0.5
    assert 0 < seen.force_std_n < 0.5
    assert {"in_contact", "force_valid", "holding"} <= seen.status
    assert not seen.status & {"interpolated", "out_of_range"}


def test_below_half_a_kpa_the_force_is_interpolated():
    seen = pressed(0.3).snapshot()
    assert "interpolated" in seen.status
    assert seen.force_n == pytest.approx(seen.force_lower_range_limit_n * seen.rise_kpa / 0.5, rel=1e-6)


@pytest.mark.parametrize(("setpoint_kpa", "inside"), [(4.5, False), (5.0, True), (11.4, True), (11.8, False)])
def test_outside_the_validated_range_a_contact_has_no_force(setpoint_kpa, inside):
    harness = InstrumentHarness.holding(request={"setpoint_requested_kpa": setpoint_kpa})
    assert ("out_of_range" in harness.snapshot().status) != inside
    harness.push_kpa = 1.0
    harness.run(0.5)
    seen = harness.snapshot()
    assert math.isfinite(seen.force_n) == inside
    assert math.isfinite(seen.pressure_kpa)
    assert ("out_of_range" in seen.status, "out_of_specification" in seen.status) == (not inside, not inside)


def test_outside_the_validated_range_the_uncompensated_force_is_missing_too():
    harness = InstrumentHarness.holding(request={"setpoint_requested_kpa": 3.0})
    harness.push_kpa = 1.0
    harness.run(0.5)
    seen = harness.snapshot()
    assert seen.rise_kpa > 0.5
    assert all(math.isnan(n) for n in (seen.force_n, seen.force_std_n, seen.force_uncompensated_n))


def test_a_hard_push_sets_the_force_alarm():
    seen = pressed(9.5).snapshot()
    assert math.isnan(seen.force_n)
    assert "force_high_alarm" in seen.status


def test_the_setpoint_in_effect_comes_from_the_board_and_is_missing_when_vented_or_tripped():
    harness = InstrumentHarness.holding()
    assert harness.snapshot().setpoint_kpa == 8.0
    harness.feed(setpoint_pa=7900)
    assert harness.snapshot().setpoint_kpa == 7.9
    harness.instrument.trip(HostFault.SENSOR_LIMIT)
    assert math.isnan(harness.snapshot().setpoint_kpa)
    harness = InstrumentHarness.holding()
    harness.write_ok(VENT)
    assert math.isnan(harness.snapshot().setpoint_kpa)


def test_a_tripped_rig_shows_its_pressure_and_no_force_even_before_the_board_has_vented():
    harness = pressed()
    harness.instrument.trip(HostFault.BOARD_RESET)
    seen = harness.snapshot()
    assert math.isnan(seen.force_n)
    assert math.isfinite(seen.pressure_kpa)
    assert not seen.status & {"force_valid", "holding", "out_of_range"}


def test_the_peak_is_the_last_local_maximum_that_is_complete():
    harness = InstrumentHarness.holding()
    assert math.isnan(harness.snapshot().peak_force_n)
    plateaus_n, peaks_n = [], []
    for push_kpa, seconds in ((2.0, 0.5), (1.0, 0.3), (3.0, 0.5), (0.0, 1.0), (1.5, 0.5), (0.0, 1.0)):
        harness.push_kpa = push_kpa
        harness.run(seconds)
        seen = harness.snapshot()
        plateaus_n.append(seen.force_n)
        peaks_n.append(seen.peak_force_n)
    first_n, _, second_n, _, third_n, _ = plateaus_n
    expected_n = [first_n, first_n, second_n, second_n, third_n]
    assert math.isnan(peaks_n[0])
    assert peaks_n[1:] == pytest.approx(expected_n, rel=0.01)
    assert (seen.contact_counter, seen.peak_counter) == (2, 3)


def test_a_contact_that_a_trip_ends_has_a_peak():
    harness = InstrumentHarness.holding()
    harness.push_kpa = 2.0
    harness.run(0.09)
    force_n = harness.snapshot().force_n
    harness.state = BoardState.TRIPPED
    harness.feed()
    seen = harness.snapshot()
    assert seen.peak_counter == 1
    assert seen.peak_force_n == pytest.approx(force_n, rel=0.1)


def test_a_baseline_is_old_after_a_minute_of_contact():
    harness = pressed()
    harness.instrument.chain.tracker.baseline_age_s = 59.9
    assert "baseline_old" not in harness.snapshot().status
    harness.run(0.2)
    assert "baseline_old" in harness.snapshot().status


@pytest.mark.parametrize(("kpa_per_s", "drifts"), [(-0.018, False), (-0.03, True)])
def test_a_baseline_that_drifts_faster_than_0_02_kpa_per_s_counts_as_old(kpa_per_s, drifts):
    harness = InstrumentHarness.holding()
    for _ in range(75):
        harness.push_kpa += 0.1 * kpa_per_s
        harness.run(0.1)
    assert ("baseline_old" in harness.snapshot().status) is drifts


def test_counters_wrap_on_the_wire():
    harness = InstrumentHarness.zeroed()
    harness.instrument.sample_counter = 2**32 - 2
    harness.instrument.chain.tracker.contact_count = 65_537
    counters = []
    for _ in range(4):
        harness.feed()
        counters.append(BY_NAME["sample_counter"].encode(harness.snapshot().sample_counter))
    assert counters == [2**32 - 1, 0, 1, 2]
    assert BY_NAME["contact_counter"].encode(harness.snapshot().contact_counter) == 1


def test_every_sample_increments_the_counter():
    harness = InstrumentHarness.zeroed()
    before = harness.snapshot().sample_counter
    harness.run(0.1)
    assert harness.snapshot().sample_counter == before + 50


@pytest.mark.parametrize("kind", list(BoardKind))
def test_only_a_real_board_is_not_simulated(kind):
    harness = InstrumentHarness.zeroed()
    harness.instrument.identify_board(hello_of(kind), OUR_FIRMWARE)
    assert ("simulated" in harness.snapshot().status) == (kind is not BoardKind.REAL)


def test_the_identity_is_shown():
    identity = Identity(serial_number=7, calibration_date=20260102, configuration_hash=9, balloon_id=3)
    seen = InstrumentHarness.zeroed(identity=identity).snapshot()
    assert (seen.serial_number, seen.calibration_date, seen.configuration_hash, seen.balloon_id) == (
        7, 20260102, 9, 3,
    )  # fmt: skip
    assert seen.method == "energetic"


def failing():
    harness = InstrumentHarness.holding()
    harness.instrument.trip(HostFault.BOARD_RESET)
    return harness


def with_can_down():
    harness = InstrumentHarness.holding()
    harness.instrument.can_down = True
    return harness


def out_of_range():
    return InstrumentHarness.holding(request={"setpoint_requested_kpa": 11.8})


@pytest.mark.parametrize(
    ("situation", "expected"),
    [
        (InstrumentHarness.holding, set()),
        (InstrumentHarness.ready, {"function_check"}),
        (failing, {"failure"}),
        (InstrumentHarness.new, {"failure"}),
        (out_of_range, {"out_of_specification"}),
        (with_can_down, {"maintenance_required"}),
    ],
)
def test_the_ne_107_signals_show_whether_the_force_may_be_used(situation, expected):
    signals = {"maintenance_required", "out_of_specification", "function_check", "failure"}
    seen = situation().snapshot()
    assert seen.status & signals == expected
    assert ("any_failure" in seen.status) == ("failure" in expected)


@pytest.mark.parametrize("flag", ["can_down", "log_down", "recording_down", "certificate_expiring"])
def test_a_failure_outside_the_instrument_is_shown_at_once_and_not_from_the_cache(flag):
    harness = InstrumentHarness.holding()
    for is_set in (False, True, False):
        setattr(harness.instrument, flag, is_set)
        assert ("maintenance_required" in harness.snapshot().status) == is_set


def test_taking_a_snapshot_changes_nothing():
    harness = pressed()
    before = harness.snapshot(), harness.instrument.command()
    for _ in range(100):
        harness.snapshot(WEB)
    assert (harness.snapshot(), harness.instrument.command()) == before


def test_the_writable_values_are_those_of_the_peer_that_writes():
    harness = InstrumentHarness.ready()
    assert harness.write({"setpoint_requested_kpa": 1.0}, ROBOT) == "state"
    harness.write_ok({"command_argument": 7, "lease_s": 0.5}, ROBOT)
    harness.now_s += 0.2
    harness.write({"setpoint_requested_kpa": 1.0}, ROBOT)
    of_robot, of_web = (writable_values(harness.instrument, peer, harness.now_s) for peer in (ROBOT, WEB))
    assert (str(of_robot["reject_reason"]), str(of_web["reject_reason"])) == ("state", "none")
    assert (of_robot["command_argument"], of_web["command_argument"]) == (7, 0)
    assert of_robot["lease_left_s"] == pytest.approx(0.3)


def test_the_command_carries_the_configured_limits():
    harness = InstrumentHarness.zeroed(host_timeout_s=0.25)
    command = harness.instrument.command()
    assert (command.contact_limit_pa, command.host_timeout_ms) == (18_000, 250)
    harness.write_ok(VENT)
    harness.write_ok(HOLD_8)
    assert harness.instrument.command().setpoint_pa == 8000


def test_the_registers_name_every_latched_fault_and_a_client_shows_the_first_one_first():
    harness = InstrumentHarness.zeroed()
    for fault in (HostFault.CAN_MASTER_LOST, Fault.LEAK, Fault.SENSOR):
        harness.instrument.trip(fault)
    seen = harness.snapshot()
    assert list(codes_of(seen.latched_faults_1)) == [Fault.SENSOR, Fault.LEAK]
    assert seen.latched_faults_2 == 1 << (HostFault.CAN_MASTER_LOST - 32)
    registers = {r.name: r.decode(r.encode(getattr(seen, r.quantity))) for r in REGISTERS if r.quantity}
    details = details_of(registers | {"map_version": MAP_VERSION})
    codes = [fault.code for fault in details.latched_faults]
    assert codes == [HostFault.CAN_MASTER_LOST, Fault.SENSOR, Fault.LEAK]
