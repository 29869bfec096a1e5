"""Tests of interlocks, faults and lost samples, with NaN and infinite values."""

import math

import pytest

from pneuforce.instrument.core.faults import STATUS_OF, FaultLatch, HostFault, codes_of
from pneuforce.instrument.core.interlocks import INTERLOCKS, violated
from pneuforce.instrument.measurement.measurement import Measurement, Quality
from pneuforce.instrument.rig.link import RawSample
from pneuforce.protocol.frames import MAX_ADC_SUM, BoardState, Fault
from pneuforce.protocol.limits import PRESSURISED
from pneuforce.registers.codes import STATUS
from tests.instrument.instrument_harness import HOLD_8, OUR_FIRMWARE, PLC, VENT, InstrumentHarness, hello_of

LIMIT_KPA = 18.0


def raw(**changes):
    return RawSample(0, 0.0, InstrumentHarness.new().sample(**({"state": BoardState.HOLDING} | changes)))


GOOD = Measurement(t_s=0.0, pressure_kpa=8.0, unfiltered_kpa=8.0)


def test_a_good_sample_is_allowed():
    assert violated(raw(), GOOD, LIMIT_KPA) is None


@pytest.mark.parametrize("state", PRESSURISED)
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e9, -1e9, 18.01, 25.01, -5.01])
def test_no_interlock_allows_an_invalid_pressure(value, state):
    broken = GOOD._replace(unfiltered_kpa=value)
    assert violated(raw(state=state), broken, LIMIT_KPA) is HostFault.PRESSURE_LIMIT


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e9])
def test_no_configured_limit_raises_the_hard_limit(value):
    high = GOOD._replace(unfiltered_kpa=25.01)
    assert violated(raw(), high, value) is HostFault.PRESSURE_LIMIT


@pytest.mark.parametrize("limit_kpa", [2.0, 18.0, 25.0])
def test_the_pressure_limit_is_the_configured_one(limit_kpa):
    at = GOOD._replace(unfiltered_kpa=limit_kpa)
    above = GOOD._replace(unfiltered_kpa=math.nextafter(limit_kpa, 99))
    assert violated(raw(), at, limit_kpa) is None
    assert violated(raw(), above, limit_kpa) is HostFault.PRESSURE_LIMIT


@pytest.mark.parametrize("state", list(BoardState))
def test_an_invalid_sensor_signal_is_not_allowed_in_any_state(state):
    dead = Measurement(t_s=0.0, quality=Quality.SENSOR_FAULT)
    assert violated(raw(state=state), dead, LIMIT_KPA) is HostFault.SENSOR_LIMIT


@pytest.mark.parametrize("share", [0.0, 0.0099, 0.9801, 1.0])
def test_a_sensor_open_or_short_trips_after_five_samples(share):
    harness = InstrumentHarness.holding()
    harness.adc_sum = math.floor(share * MAX_ADC_SUM)
    for _ in range(4):
        harness.feed()
    assert harness.commands_hold
    harness.feed()
    assert not harness.commands_hold
    assert harness.snapshot().first_out_fault == HostFault.SENSOR_LIMIT


@pytest.mark.parametrize(("supply_mv", "allowed"), [(4749, False), (4750, True), (5250, True), (5251, False)])
def test_the_supply_must_be_within_five_percent(supply_mv, allowed):
    assert (violated(raw(supply_mv=supply_mv), GOOD, LIMIT_KPA) is None) == allowed


def test_each_interlock_raises_a_fault_that_has_a_status_bit():
    assert all(STATUS_OF[interlock.fault] for interlock in INTERLOCKS)


def test_the_interlocks_use_the_sampled_pressure_not_the_filtered_one():
    harness = InstrumentHarness.holding()
    harness.set_sensor_push(10.5)
    for _ in range(3):
        assert harness.commands_hold
        harness.feed()
    assert harness.instrument.measurement.pressure_kpa < 10
    assert not harness.commands_hold
    assert "overpressure" in harness.snapshot().status


@pytest.mark.parametrize(("broken", "few"), [({"adc_sum": 0}, 4), ({"adc_sum": 16 * 600}, 2)])
def test_disturbed_samples_with_good_ones_between_them_trip_nothing(broken, few):
    harness = InstrumentHarness.holding()
    for _ in range(10):
        for _ in range(few):
            harness.feed(**broken)
        harness.feed()
    assert harness.commands_hold
    assert harness.snapshot().first_out_fault == 0


def test_a_hard_push_raises_the_force_alarm_within_one_sample():
    harness = InstrumentHarness.holding()
    harness.set_sensor_push(6.2)
    harness.feed()
    assert "force_high_alarm" in harness.snapshot().status


#: Faults without a latched status bit. The state, the first-out fault and the bit "failure" show them.
#: Bit 9 is set while samples are missing, but is not latched.
WITHOUT_A_BIT = {Fault.NONE, Fault.HOST_SILENT}
WITHOUT_A_BIT |= {HostFault.LINK_LOST, HostFault.FORCE_LIMIT, HostFault.CAN_MASTER_LOST}


class TestFaults:
    """Tests of the fault codes, their status bits and the latch."""

    def test_every_fault_has_a_status_bit_or_is_in_the_list_of_faults_without_a_bit(self):
        assert set(STATUS_OF) | WITHOUT_A_BIT == {*Fault, *HostFault}
        assert not set(STATUS_OF) & WITHOUT_A_BIT

    def test_no_code_is_used_twice(self):
        assert len({int(fault) for fault in (*Fault, *HostFault)}) == len(Fault) + len(HostFault)

    def test_exactly_the_bits_of_faults_latch(self):
        assert set(STATUS_OF.values()) == {bit.name for bit in STATUS.bits if bit.latches}

    def test_a_fault_mask_is_decoded_to_fault_codes(self):
        assert list(codes_of(0)) == []
        assert list(codes_of(1 << Fault.BURST | 1 << Fault.WATCHDOG)) == [Fault.BURST, Fault.WATCHDOG]

    def test_the_first_out_fault_stays_the_same(self):
        latch = FaultLatch()
        assert [latch.set(5), latch.set(2), latch.set(5)] == [True, True, False]
        assert (latch.first, len(latch)) == (5, 2)
        latch.clear([5])
        assert (latch.first, len(latch)) == (2, 1)
        latch.clear([2, 3])
        assert (latch.first, len(latch)) == (0, 0)

    @pytest.mark.parametrize("fault", list(Fault)[1:])
    def test_each_fault_of_the_board_stops_the_host_and_latches(self, fault):
        harness = InstrumentHarness.holding()
        harness.latched.add(fault)
        harness.run(0.02)
        assert not harness.commands_hold
        harness.latched.clear()
        harness.run(1.0)
        seen = harness.snapshot()
        assert (seen.state, seen.first_out_fault, seen.active_fault_count) == ("tripped", fault, 1)
        assert {"failure", "any_failure"} <= seen.status
        assert STATUS_OF.get(fault, "failure") in seen.status
        assert harness.run_command("clear_faults") == ("done", "none")
        assert not seen.status - {"failure"} <= harness.snapshot().status
        assert harness.snapshot().active_fault_count == 0

    def test_first_fault_and_number_follow_the_order_of_occurrence(self):
        harness = InstrumentHarness.zeroed()
        harness.causes.add(Fault.LEAK)
        harness.run(0.02)
        harness.causes.add(Fault.SENSOR)
        harness.run(0.02)
        assert (harness.snapshot().first_out_fault, harness.snapshot().active_fault_count) == (Fault.LEAK, 2)
        assert {"leak", "sensor_fault", "maintenance_required"} <= harness.snapshot().status


class TestSilence:
    """Tests of missing and frozen samples."""

    def test_after_100_ms_without_samples_the_values_are_not_available(self):
        harness = InstrumentHarness.holding()
        harness.push_kpa = 1.0
        harness.run(0.5)
        fresh = harness.snapshot()
        harness.now_s += 0.0999
        assert harness.snapshot().force_n == fresh.force_n
        harness.now_s += 0.0002
        stale = harness.snapshot()
        history = {
            "peak_force_n",
            "force_maximum_n",
            "force_minimum_n",
            "ambient_in_effect_kpa",
            "ambient_age_s",
            "baseline_age_s",
            "proof_test_age_s",
            "age_s",
            "zero_offset_kpa",
        }
        requested = {
            "setpoint_requested_kpa",
            "force_limit_n",
            "force_limit_2_n",
            "alarm_hysteresis_n",
            "alarm_delay_s",
            "ambient_pressure_kpa",
            "reference_pressure_kpa",
            "lease_s",
            "lease_left_s",
        }
        floats = {name for name, value in fresh._asdict().items() if isinstance(value, float)}
        assert {"force_n", "force_std_n", "pressure_kpa", "setpoint_kpa"} < floats - history - requested
        for name in floats - history - requested:
            assert math.isfinite(getattr(fresh, name)), name
            assert math.isnan(getattr(stale, name)), name
        assert {"stale", "stale_or_lost", "failure"} <= stale.status
        assert not stale.status & {"force_valid", "in_contact", "holding", "link_lost"}
        assert stale.age_s == pytest.approx(0.1001)

    def test_after_250_ms_without_samples_the_link_is_lost_and_the_rig_trips(self):
        harness = InstrumentHarness.holding()
        harness.run_without_samples(0.25)
        assert harness.commands_hold
        harness.run_without_samples(0.01)
        assert not harness.commands_hold
        seen = harness.snapshot()
        assert (seen.state, seen.first_out_fault) == ("tripped", HostFault.LINK_LOST)
        assert "link_lost" in seen.status

    def test_returning_samples_do_not_inflate(self):
        harness = InstrumentHarness.holding()
        harness.run_without_samples(1.0)
        harness.run(1.0)
        seen = harness.snapshot()
        assert not harness.commands_hold
        assert "link_lost" not in seen.status
        assert seen.state == "tripped"
        assert harness.write(HOLD_8) == "fault_latched"

    def test_ages_are_never_negative(self):
        harness = InstrumentHarness.zeroed()
        assert harness.instrument.snapshot(PLC, harness.now_s - 5.0).age_s == 0.0

    def test_the_age_of_the_baseline_grows_without_samples(self):
        harness = InstrumentHarness.holding()
        assert harness.snapshot().baseline_age_s < 0.01
        harness.run_without_samples(3.0)
        assert harness.snapshot().baseline_age_s == pytest.approx(3.0, abs=0.02)

    def test_the_age_of_a_missing_baseline_is_not_available(self):
        assert math.isnan(InstrumentHarness.zeroed().snapshot().baseline_age_s)

    def test_a_frozen_board_trips_and_its_numbers_are_not_shown(self):
        harness = InstrumentHarness.holding()
        harness.clock_invalid = True
        harness.feed()
        seen = harness.snapshot()
        assert not harness.commands_hold
        assert "sensor_fault" in seen.status
        assert math.isnan(seen.pressure_kpa)
        assert math.isnan(seen.force_n)

    def test_before_the_first_sample_the_state_is_boot(self):
        harness = InstrumentHarness.new()
        harness.instrument.tick(harness.now_s)
        seen = harness.snapshot()
        assert (seen.state, seen.first_out_fault) == ("boot", 0)
        assert {"stale", "link_lost", "not_zeroed", "failure"} <= seen.status
        assert math.isnan(seen.pressure_kpa)


class TestVented:
    """Tests of the verified vent."""

    def test_a_vent_is_verified_after_half_a_second_below_0_3_kpa(self):
        harness = InstrumentHarness.holding()
        harness.write_ok(VENT)
        harness.run(0.9, lambda: harness.snapshot().pressure_kpa < 0.3)
        harness.run(0.48)
        assert "vented" not in harness.snapshot().status
        harness.run(0.03)
        assert "vented" in harness.snapshot().status

    @pytest.mark.parametrize("adc_sum", [0, 16368])
    def test_a_vent_is_not_verified_with_a_broken_sensor(self, adc_sum):
        harness = InstrumentHarness.zeroed()
        assert "vented" in harness.snapshot().status
        harness.adc_sum = adc_sum
        harness.feed()
        assert "vented" not in harness.snapshot().status

    def test_a_vent_is_not_verified_while_a_valve_is_powered(self):
        harness = InstrumentHarness.zeroed()
        harness.feed(valves=2)
        assert "vented" not in harness.snapshot().status

    def test_a_gap_in_the_samples_does_not_count_as_vented_time(self):
        harness = InstrumentHarness.holding()
        harness.write_ok(VENT)
        harness.run(0.9, lambda: harness.snapshot().pressure_kpa < 0.3)
        for _ in range(3):
            harness.now_s += 0.2
            harness.board_time_us += 200_000
            harness.feed()
        assert "vented" not in harness.snapshot().status

    def test_a_vent_is_not_verified_while_the_samples_are_stale(self):
        harness = InstrumentHarness.zeroed()
        harness.now_s += 0.11
        assert "vented" not in harness.snapshot().status


class TestAnotherBoard:
    """Tests of a board with another serial number. Such a board has another sensor."""

    def test_the_old_zero_is_discarded_and_the_rig_trips(self):
        harness = InstrumentHarness.holding()
        harness.state = BoardState.VENTING
        harness.instrument.identify_board(hello_of(serial=2), OUR_FIRMWARE)
        seen = harness.snapshot()
        assert {"not_zeroed", "board_reset"} <= seen.status
        assert not harness.commands_hold


def test_the_force_limit_trips_if_configured_to_vent():
    harness = InstrumentHarness.holding(vent_on_force_limit=True)
    harness.push_kpa = 3.0
    harness.write_ok({"force_limit_n": 1.0})
    harness.run(0.5)
    assert not harness.commands_hold
    assert harness.snapshot().first_out_fault == HostFault.FORCE_LIMIT
