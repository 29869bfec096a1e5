"""A snapshot: one sample, one instant, one peer, and every quantity that the map binds to."""

import math

import pytest

from instrument.faults import HostFault
from instrument.rig.frames import BoardKind, BoardState, Hello
from instrument.settings import Identity
from registers.codes import CONDENSED, STATUS
from registers.map import BY_NAME, REGISTERS
from tests.instrument.driving import HOLD_8, PAGE, VENT, Drive

CONTACT_QUANTITIES = ("force_n", "rise_kpa", "indentation_mm", "contact_radius_mm")


def pressed(push_kpa=1.0, **settings):
    drive = Drive.holding(**settings)
    drive.push_kpa = push_kpa
    return drive.run(0.8)


def test_nothing_in_it_can_be_changed():
    seen = Drive.zeroed().see()
    with pytest.raises(AttributeError):
        seen.force_n = 1.0
    assert isinstance(seen.status, frozenset)


def test_it_stays_as_it_was_while_the_instrument_goes_on():
    drive = pressed()
    seen = drive.see()
    copy = seen._replace()
    drive.push_kpa = 3.0
    drive.write({"force_limit_n": 1.0})
    drive.run(0.5)
    assert seen == copy
    assert drive.see() != copy


def test_all_of_it_belongs_to_one_sample():
    drive = Drive.holding()
    drive.push_kpa = 2.0
    for _ in range(200):
        m = drive.feed()
        seen = drive.see()
        assert (seen.pressure_kpa, seen.force_n) == (m.pressure_kpa, m.force_n)
        if m.in_contact:
            assert (seen.rise_kpa, seen.initial_pressure_kpa) == (m.rise_kpa, m.initial_kpa)
            assert seen.force_n == pytest.approx(
                1e-3 * math.pi * (m.initial_kpa + m.rise_kpa) * seen.contact_radius_mm**2, rel=1e-3
            )


def without_a_sensor():
    drive = pressed()
    drive.adc_sum = 0
    return drive.run(0.1)


SITUATIONS = {
    "never heard": Drive.new,
    "zeroed": Drive.zeroed,
    "ready": Drive.ready,
    "holding": Drive.holding,
    "touched": lambda: pressed(0.3),
    "pressed": lambda: pressed(1.0),
    "pressed hard": lambda: pressed(9.0),
    "lost": lambda: pressed().silence(1.0),
    "without a sensor": without_a_sensor,
}
in_every_situation = pytest.mark.parametrize("situation", SITUATIONS.values(), ids=SITUATIONS)


@in_every_situation
def test_every_register_can_be_rendered_in_every_situation(situation):
    seen = situation().see()
    for register in REGISTERS:
        if register.quantity:
            code = register.encode(getattr(seen, register.quantity))
            assert not isinstance(code, complex)
            if register.wire.highest is not None:
                assert register.wire.lowest <= code <= register.wire.highest, register.name


@in_every_situation
def test_no_number_in_it_is_infinite_or_of_another_kind(situation):
    seen = situation().see()
    for name, value in seen._asdict().items():
        assert isinstance(value, (float, int, str, frozenset, tuple)), name
        assert not (isinstance(value, float) and math.isinf(value)), name


@in_every_situation
def test_every_condition_has_its_bit(situation):
    known = {bit.name for bit in (*STATUS.bits, *CONDENSED.bits)}
    assert situation().see().status <= known


def test_holding_without_contact_the_contact_is_zero_with_its_detection_limit():
    seen = Drive.holding().see()
    assert [getattr(seen, name) for name in CONTACT_QUANTITIES] == [0.0, 0.0, 0.0, 0.0]
    assert 0.01 < seen.force_std_n < 0.5
    assert seen.radius_mm == pytest.approx(8.242, abs=5e-3)
    assert {"holding", "force_valid"} <= seen.status
    assert "failure" not in seen.status


@pytest.mark.parametrize("state", [s for s in BoardState if s is not BoardState.HOLDING])
def test_in_every_other_state_there_is_a_pressure_and_no_contact(state):
    drive = Drive.zeroed()
    drive.feed(state=state)
    seen = drive.see()
    for name in (*CONTACT_QUANTITIES, "radius_mm", "force_std_n"):
        assert math.isnan(getattr(seen, name)), name
    assert math.isfinite(seen.pressure_kpa)
    assert "force_valid" not in seen.status


def test_in_contact_the_force_comes_with_its_uncertainty():
    seen = pressed(1.0).see()
    assert seen.force_n > 0.5
    assert 0 < seen.force_std_n < 0.2
    assert {"in_contact", "force_valid", "holding"} <= seen.status
    assert not seen.status & {"interpolated", "out_of_range"}


def test_below_half_a_kpa_the_force_is_interpolated():
    seen = pressed(0.3).see()
    assert "interpolated" in seen.status
    assert seen.force_n == pytest.approx(seen.force_low_n * seen.rise_kpa / 0.5, rel=1e-6)


@pytest.mark.parametrize(("setpoint_kpa", "inside"), [(4.5, False), (5.0, True), (11.4, True), (11.8, False)])
def test_outside_the_validated_range_a_contact_has_no_force(setpoint_kpa, inside):
    drive = Drive.holding(request={"setpoint_requested_kpa": setpoint_kpa})
    assert ("out_of_range" in drive.see().status) != inside
    drive.push_kpa = 1.0
    drive.run(0.5)
    seen = drive.see()
    assert math.isfinite(seen.force_n) == inside
    assert math.isfinite(seen.pressure_kpa)
    assert ("out_of_range" in seen.status, "out_of_specification" in seen.status) == (not inside, not inside)


def test_outside_that_range_no_register_shows_a_force_not_even_the_one_without_compensation():
    drive = Drive.holding(request={"setpoint_requested_kpa": 3.0})
    drive.push_kpa = 1.0
    drive.run(0.5)
    seen = drive.see()
    assert seen.rise_kpa > 0.5
    assert all(math.isnan(n) for n in (seen.force_n, seen.force_std_n, seen.force_uncompensated_n))


def test_a_hard_push_is_no_reason_to_go_blank():
    seen = pressed(9.5).see()
    assert seen.force_n > 5
    assert "force_limit" in seen.status


def test_the_setpoint_in_effect_is_the_boards_and_none_when_vented_or_tripped():
    drive = Drive.holding()
    assert drive.see().setpoint_kpa == 8.0
    drive.feed(setpoint_pa=7900)
    assert drive.see().setpoint_kpa == 7.9
    drive.instrument.trip(HostFault.SENSOR_LIMIT)
    assert math.isnan(drive.see().setpoint_kpa)
    drive = Drive.holding()
    drive.must(VENT)
    assert math.isnan(drive.see().setpoint_kpa)


def test_a_tripped_rig_shows_its_pressure_and_no_force_even_before_the_board_has_vented():
    drive = pressed()
    drive.instrument.trip(HostFault.BOARD_RESET)
    seen = drive.see()
    assert math.isnan(seen.force_n)
    assert math.isfinite(seen.pressure_kpa)
    assert not seen.status & {"force_valid", "holding", "out_of_range"}


def test_the_peak_is_that_of_the_last_finished_contact():
    drive = Drive.holding()
    peaks = []
    for push_kpa in (2.0, 1.0, 3.0):
        highest = 0.0
        for level_kpa in (push_kpa, 0.6 * push_kpa):
            drive.push_kpa = level_kpa
            for _ in range(200):
                drive.run(0.002)
                highest = max(highest, drive.see().force_n)
        before = drive.see().peak_force_n
        assert before == pytest.approx(peaks[-1]) if peaks else math.isnan(before)
        drive.push_kpa = 0.0
        drive.run(1.0)
        peaks.append(highest)
        assert drive.see().peak_force_n == pytest.approx(highest)
    assert drive.see().contact_counter == 3


def test_a_baseline_is_old_after_a_minute_of_contact():
    drive = pressed()
    drive.instrument.chain.tracker.baseline_age_s = 59.9
    assert "baseline_old" not in drive.see().status
    drive.run(0.2)
    assert "baseline_old" in drive.see().status


@pytest.mark.parametrize(("kpa_per_s", "drifts"), [(-0.018, False), (-0.03, True)])
def test_a_baseline_that_moves_faster_than_0_02_kpa_per_s_is_no_good_one(kpa_per_s, drifts):
    drive = Drive.holding()
    for _ in range(75):
        drive.push_kpa += 0.1 * kpa_per_s
        drive.run(0.1)
    assert ("baseline_old" in drive.see().status) is drifts


def test_counters_wrap_on_the_wire():
    drive = Drive.zeroed()
    drive.instrument.sample_counter = 2**32 - 2
    drive.instrument.chain.tracker.count = 65_537
    counters = []
    for _ in range(4):
        drive.feed()
        counters.append(BY_NAME["sample_counter"].encode(drive.see().sample_counter))
    assert counters == [2**32 - 1, 0, 1, 2]
    assert BY_NAME["contact_counter"].encode(drive.see().contact_counter) == 1


def test_every_sample_counts_one():
    drive = Drive.zeroed()
    before = drive.see().sample_counter
    drive.run(0.1)
    assert drive.see().sample_counter == before + 50


@pytest.mark.parametrize("kind", list(BoardKind))
def test_only_a_real_board_is_not_simulated(kind):
    drive = Drive.zeroed()
    drive.instrument.greeted(Hello(kind, 0x100, 1000, 1, 250, 2000))
    assert ("simulated" in drive.see().status) == (kind is not BoardKind.REAL)


def test_it_says_who_it_is():
    identity = Identity(serial_number=7, calibration_date=20260102, configuration_hash=9, balloon_id=3)
    seen = Drive.zeroed(identity=identity).see()
    assert (seen.serial_number, seen.calibration_date, seen.configuration_hash, seen.balloon_id) == (
        7, 20260102, 9, 3,
    )  # fmt: skip
    assert seen.method == "energetic"


def failing():
    drive = Drive.holding()
    drive.instrument.trip(HostFault.BOARD_RESET)
    return drive


def with_can_down():
    drive = Drive.holding()
    drive.instrument.can_down = True
    return drive


def out_of_range():
    return Drive.holding(request={"setpoint_requested_kpa": 11.8})


@pytest.mark.parametrize(
    ("situation", "expected"),
    [
        (Drive.holding, set()),
        (Drive.ready, {"function_check"}),
        (failing, {"failure"}),
        (Drive.new, {"failure"}),
        (out_of_range, {"out_of_specification"}),
        (with_can_down, {"maintenance"}),
    ],
)
def test_the_signals_of_ne_107_say_whether_the_force_may_be_used(situation, expected):
    signals = {"maintenance", "out_of_specification", "function_check", "failure"}
    seen = situation().see()
    assert seen.status & signals == expected
    assert ("any_failure" in seen.status) == ("failure" in expected)


def test_looking_changes_nothing():
    drive = pressed()
    before = drive.see(), drive.instrument.command()
    for _ in range(100):
        drive.see(PAGE)
    assert (drive.see(), drive.instrument.command()) == before


def test_the_board_is_told_the_limits_of_the_configuration():
    drive = Drive.zeroed(vent_after_s=0.25)
    command = drive.instrument.command()
    assert (command.contact_limit_pa, command.vent_after_ms) == (18_000, 250)
    drive.must(VENT)
    drive.must(HOLD_8)
    assert drive.instrument.command().setpoint_pa == 8000
