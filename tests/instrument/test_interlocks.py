"""Interlocks, faults and silence: what stops the rig, and what a broken number may not do."""

import math

import pytest

from instrument.faults import STATUS_OF, HostFault, Latch, codes_of
from instrument.interlocks import INTERLOCKS, violated
from instrument.measurement import Measurement, Quality
from instrument.rig.frames import COUNTS_LIMIT, BoardKind, BoardState, Fault, Hello
from instrument.rig.limits import PRESSURISED
from instrument.rig.link import RawSample
from registers.codes import STATUS
from tests.instrument.driving import HOLD_8, PLC, VENT, Drive

LIMIT_KPA = 18.0


def raw(**changes):
    return RawSample(0, 0.0, Drive.new().sample(**({"state": BoardState.HOLDING} | changes)))


GOOD = Measurement(t_s=0.0, pressure_kpa=8.0, unfiltered_kpa=8.0)


def test_a_good_sample_is_allowed():
    assert violated(raw(), GOOD, LIMIT_KPA) is None


@pytest.mark.parametrize("state", PRESSURISED)
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e9, -1e9, 18.01, 25.01, -5.01])
def test_no_interlock_lets_a_broken_pressure_through(value, state):
    broken = GOOD._replace(unfiltered_kpa=value)
    assert violated(raw(state=state), broken, LIMIT_KPA) is HostFault.PRESSURE_LIMIT


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e9])
def test_no_configured_limit_lifts_the_hard_one(value):
    high = GOOD._replace(unfiltered_kpa=25.01)
    assert violated(raw(), high, value) is HostFault.PRESSURE_LIMIT


@pytest.mark.parametrize("limit_kpa", [2.0, 18.0, 25.0])
def test_the_pressure_limit_is_where_it_was_configured(limit_kpa):
    at = GOOD._replace(unfiltered_kpa=limit_kpa)
    above = GOOD._replace(unfiltered_kpa=math.nextafter(limit_kpa, 99))
    assert violated(raw(), at, limit_kpa) is None
    assert violated(raw(), above, limit_kpa) is HostFault.PRESSURE_LIMIT


@pytest.mark.parametrize("state", list(BoardState))
def test_a_sensor_that_cannot_be_believed_is_not_allowed_in_any_state(state):
    dead = Measurement(t_s=0.0, quality=Quality.SENSOR)
    assert violated(raw(state=state), dead, LIMIT_KPA) is HostFault.SENSOR_LIMIT


@pytest.mark.parametrize("share", [0.0, 0.0099, 0.9801, 1.0])
def test_a_sensor_open_or_short_trips_after_five_samples(share):
    drive = Drive.holding()
    drive.adc_sum = math.floor(share * COUNTS_LIMIT)
    for _ in range(4):
        drive.feed()
    assert drive.inflates
    drive.feed()
    assert not drive.inflates
    assert drive.see().first_fault == HostFault.SENSOR_LIMIT


@pytest.mark.parametrize(("supply_mv", "allowed"), [(4749, False), (4750, True), (5250, True), (5251, False)])
def test_the_supply_must_be_within_five_percent(supply_mv, allowed):
    assert (violated(raw(supply_mv=supply_mv), GOOD, LIMIT_KPA) is None) == allowed


def test_each_interlock_raises_a_fault_that_has_a_status_bit():
    assert all(STATUS_OF[interlock.fault] for interlock in INTERLOCKS)


def test_the_interlocks_look_at_the_pressure_as_sampled_not_as_filtered():
    drive = Drive.holding()
    drive.hit(10.5)
    for _ in range(3):
        assert drive.inflates
        drive.feed()
    assert drive.instrument.measurement.pressure_kpa < 10
    assert not drive.inflates
    assert "overpressure" in drive.see().status


@pytest.mark.parametrize(("broken", "few"), [({"adc_sum": 0}, 4), ({"adc_sum": 16 * 600}, 2)])
def test_disturbed_samples_with_good_ones_between_them_trip_nothing(broken, few):
    drive = Drive.holding()
    for _ in range(10):
        for _ in range(few):
            drive.feed(**broken)
        drive.feed()
    assert drive.inflates
    assert drive.see().first_fault == 0


def test_a_hard_push_raises_the_force_alarm_within_one_sample():
    drive = Drive.holding()
    drive.hit(6.2)
    drive.feed()
    assert "force_limit" in drive.see().status


#: Shown by state, first fault and "failure"; bit 9 itself follows the silence and does not latch.
WITHOUT_A_BIT = {Fault.NONE, Fault.HOST_SILENT}
WITHOUT_A_BIT |= {HostFault.LINK_LOST, HostFault.FORCE_LIMIT, HostFault.CAN_MASTER_LOST}


class TestFaults:
    """The board's and the host's faults, their bits and their latch."""

    def test_every_fault_has_a_considered_place(self):
        assert set(STATUS_OF) | WITHOUT_A_BIT == {*Fault, *HostFault}
        assert not set(STATUS_OF) & WITHOUT_A_BIT

    def test_no_code_is_used_twice(self):
        assert len({int(fault) for fault in (*Fault, *HostFault)}) == len(Fault) + len(HostFault)

    def test_the_bits_of_faults_are_those_that_latch(self):
        assert set(STATUS_OF.values()) == {bit.name for bit in STATUS.bits if bit.latches}

    def test_the_mask_names_its_bits(self):
        assert list(codes_of(0)) == []
        assert list(codes_of(1 << Fault.BURST | 1 << Fault.WATCHDOG)) == [Fault.BURST, Fault.WATCHDOG]

    def test_the_first_is_the_first_and_stays_it(self):
        latch = Latch()
        assert [latch.set(5), latch.set(2), latch.set(5)] == [True, True, False]
        assert (latch.first, len(latch)) == (5, 2)
        latch.clear([5])
        assert (latch.first, len(latch)) == (2, 1)
        latch.clear([2, 3])
        assert (latch.first, len(latch)) == (0, 0)

    @pytest.mark.parametrize("fault", list(Fault)[1:])
    def test_each_fault_of_the_board_stops_the_host_and_latches(self, fault):
        drive = Drive.holding()
        drive.latched.add(fault)
        drive.run(0.02)
        assert not drive.inflates
        drive.latched.clear()
        drive.run(1.0)
        seen = drive.see()
        assert (seen.state, seen.first_fault, seen.active_faults) == ("tripped", fault, 1)
        assert {"failure", "any_failure"} <= seen.status
        assert STATUS_OF.get(fault, "failure") in seen.status
        assert drive.order("clear_faults") == ("done", "none")
        assert not seen.status - {"failure"} <= drive.see().status
        assert drive.see().active_faults == 0

    def test_first_fault_and_number_follow_the_order_of_coming(self):
        drive = Drive.zeroed()
        drive.causes.add(Fault.LEAK)
        drive.run(0.02)
        drive.causes.add(Fault.SENSOR)
        drive.run(0.02)
        assert (drive.see().first_fault, drive.see().active_faults) == (Fault.LEAK, 2)
        assert {"leak", "sensor_fault", "maintenance"} <= drive.see().status


class TestSilence:
    """Samples that do not come, or do not move."""

    def test_over_100_ms_the_values_are_not_available(self):
        drive = Drive.holding()
        drive.push_kpa = 1.0
        drive.run(0.5)
        fresh = drive.see()
        drive.now_s += 0.0999
        assert drive.see().force_n == fresh.force_n
        drive.now_s += 0.0002
        stale = drive.see()
        for name in (
            "force_n", "force_std_n", "force_uncompensated_n", "force_low_n", "pressure_kpa", "rise_kpa",
            "initial_pressure_kpa", "radius_mm", "indentation_mm", "contact_radius_mm", "drift_kpa_per_s",
            "delay_s", "setpoint_kpa",
        ):  # fmt: skip
            assert math.isfinite(getattr(fresh, name)), name
            assert math.isnan(getattr(stale, name)), name
        assert {"stale", "stale_or_lost", "failure"} <= stale.status
        assert not stale.status & {"force_valid", "in_contact", "holding", "link_lost"}
        assert stale.age_s == pytest.approx(0.1001)

    def test_over_250_ms_the_link_is_lost_and_the_rig_tripped(self):
        drive = Drive.holding()
        drive.silence(0.25)
        assert drive.inflates
        drive.silence(0.01)
        assert not drive.inflates
        seen = drive.see()
        assert (seen.state, seen.first_fault) == ("tripped", HostFault.LINK_LOST)
        assert "link_lost" in seen.status

    def test_samples_that_come_back_do_not_inflate(self):
        drive = Drive.holding()
        drive.silence(1.0)
        drive.run(1.0)
        seen = drive.see()
        assert not drive.inflates
        assert "link_lost" not in seen.status
        assert seen.state == "tripped"
        assert drive.write(HOLD_8) == "fault_latched"

    def test_ages_are_never_negative(self):
        drive = Drive.zeroed()
        assert drive.instrument.snapshot(PLC, drive.now_s - 5.0).age_s == 0.0

    def test_the_age_of_the_baseline_goes_on_in_silence(self):
        drive = Drive.holding()
        assert drive.see().baseline_age_s < 0.01
        drive.silence(3.0)
        assert drive.see().baseline_age_s == pytest.approx(3.0, abs=0.02)

    def test_a_rig_that_never_had_a_baseline_does_not_claim_a_fresh_one(self):
        assert Drive.zeroed().see().baseline_age_s > 65_535

    def test_a_frozen_board_trips_and_its_numbers_are_not_shown(self):
        drive = Drive.holding()
        drive.frozen = True
        drive.feed()
        seen = drive.see()
        assert not drive.inflates
        assert "sensor_fault" in seen.status
        assert math.isnan(seen.pressure_kpa)
        assert math.isnan(seen.force_n)

    def test_before_the_first_sample_the_state_is_boot(self):
        drive = Drive.new()
        drive.instrument.tick(drive.now_s)
        seen = drive.see()
        assert (seen.state, seen.first_fault) == ("boot", 0)
        assert {"stale", "link_lost", "not_zeroed", "failure"} <= seen.status
        assert math.isnan(seen.pressure_kpa)


class TestVented:
    """Vented means verified."""

    def test_it_takes_half_a_second_below_0_3_kpa(self):
        drive = Drive.holding()
        drive.must(VENT)
        drive.run(0.9, lambda: drive.see().pressure_kpa < 0.3)
        drive.run(0.48)
        assert "vented" not in drive.see().status
        drive.run(0.03)
        assert "vented" in drive.see().status

    @pytest.mark.parametrize("adc_sum", [0, 16368])
    def test_not_with_a_broken_sensor(self, adc_sum):
        drive = Drive.zeroed()
        assert "vented" in drive.see().status
        drive.adc_sum = adc_sum
        drive.feed()
        assert "vented" not in drive.see().status

    def test_not_with_a_valve_energised(self):
        drive = Drive.zeroed()
        drive.feed(valves=2)
        assert "vented" not in drive.see().status

    def test_a_gap_in_the_samples_vouches_for_nothing(self):
        drive = Drive.holding()
        drive.must(VENT)
        drive.run(0.9, lambda: drive.see().pressure_kpa < 0.3)
        for _ in range(3):
            drive.now_s += 0.2
            drive.board_time_us += 200_000
            drive.feed()
        assert "vented" not in drive.see().status

    def test_not_while_the_samples_are_stale(self):
        drive = Drive.zeroed()
        drive.now_s += 0.11
        assert "vented" not in drive.see().status


class TestAnotherBoard:
    """A board with another serial number has another sensor."""

    def test_the_zero_of_the_old_one_is_void_and_the_rig_is_tripped(self):
        drive = Drive.holding()
        drive.state = BoardState.VENTING
        drive.instrument.greeted(Hello(BoardKind.SIMULATED, 0x100, 1000, 2, 250, 2000))
        seen = drive.see()
        assert {"not_zeroed", "board_reset"} <= seen.status
        assert not drive.inflates


def test_the_force_limit_trips_where_it_is_configured_to_vent():
    drive = Drive.holding(vent_on_force_limit=True)
    drive.push_kpa = 3.0
    drive.must({"force_limit_n": 1.0})
    drive.run(0.5)
    assert not drive.inflates
    assert drive.see().first_fault == HostFault.FORCE_LIMIT
