"""Tests of the measuring chain: transfer function, zero, filter, force, uncertainty and invalid samples."""

import itertools
import math
from dataclasses import fields, replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneuforce.instrument.calibration.apply import COMPENSATED_INPUTS
from pneuforce.instrument.measurement.chain import Chain
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.measurement import Quality
from pneuforce.instrument.measurement.zero import ZeroAdjustment
from pneuforce.instrument.model import METHODS, ForceCorrection, ForceLaw, estimate
from pneuforce.instrument.model.uncertainty import InputUncertainties, ModelUncertainty
from pneuforce.instrument.model.uncertainty_budget import combined_std_n, compute_budget
from pneuforce.instrument.rig.link import MAX_STEP_S, RawSample
from pneuforce.protocol.frames import MAX_ADC_SUM, BoardState, Sample
from pneuforce.protocol.limits import nominal_pressure_kpa
from tests.instrument.instrument_harness import Tube, adc_sum_of

DT_US = 2000


class ChainHarness:
    """Measuring chain that receives one sample every 2 ms of board time."""

    def __init__(self, start_us=0, **settings):
        self.chain = Chain(ChainSettings(**settings))
        self.time_us, self.last, self.elapsed_s, self.tube = start_us, None, 0.002, Tube()

    def feed_adc_sum(self, adc_sum, state=BoardState.VENTED, seconds=0.002):
        for _ in range(max(1, round(seconds / 0.002))):
            self.time_us += DT_US
            message = Sample(self.time_us & 0xFFFF_FFFF, adc_sum, 5000, 0, state, 0, 0, 0, 0)
            self.last = self.chain.step(RawSample(0, self.time_us * 1e-6, message, self.elapsed_s))
        return self.last

    def feed_kpa(self, pressure_kpa, state=BoardState.VENTED, seconds=0.002):
        return self.feed_adc_sum(adc_sum_of(pressure_kpa), state, seconds)

    @classmethod
    def locked(cls, baseline_kpa=8.0, **settings):
        """Return a zeroed chain with a balloon that is locked at `baseline_kpa`."""
        harness = cls(**settings)
        harness.feed_kpa(0.2, seconds=1.0)
        assert harness.chain.zero.take()
        harness.feed_kpa(0.2 + baseline_kpa, BoardState.SETTLING, 1.0)
        harness.feed_kpa(0.2 + baseline_kpa, BoardState.HOLDING, 1.0)
        harness.tube = Tube(baseline_kpa, baseline_kpa)
        return harness

    def set_pressure(self, pressure_kpa, seconds=0.002):
        """Set a pressure that the sensor shows immediately, without the lag of the tube."""
        return self.feed_kpa(0.2 + pressure_kpa, BoardState.HOLDING, seconds)

    def move_to(self, pressure_kpa, seconds=1.0):
        """Move from the present pressure to another one, as fast as a hand and the tube allow."""
        for _ in range(max(1, round(seconds / 0.002))):
            self.feed_kpa(0.2 + self.tube.step(pressure_kpa), BoardState.HOLDING)
        return self.last


class TestSensor:
    """Tests of the sensor MPXV5050DP: V_out = V_s (0.018 P + 0.04), with V_s = 5 V."""

    @pytest.mark.parametrize(("volts", "kpa"), [(0.2, 0.0), (4.7, 50.0), (2.45, 25.0), (0.92, 8.0)])
    def test_the_transfer_function_is_that_of_the_data_sheet(self, volts, kpa):
        adc_sum = 16 * math.floor(volts / 5.0 * 1024)  # each conversion truncates
        assert nominal_pressure_kpa(adc_sum) == pytest.approx(kpa, abs=0.03)

    def test_one_count_is_0_054_kpa(self):
        assert nominal_pressure_kpa(16 * 101) - nominal_pressure_kpa(16 * 100) == pytest.approx(
            0.0543, abs=1e-4
        )

    def test_truncation_has_no_bias(self):
        levels = [40 + i / 997 for i in range(997)]
        errors = [nominal_pressure_kpa(16 * math.floor(x)) - (x / 1024 - 0.04) / 0.018 for x in levels]
        assert sum(errors) / len(errors) == pytest.approx(0.0, abs=1e-4)


class TestZero:
    """Tests of the zero adjustment, which needs a vented and steady rig."""

    def after_steady(self, nominal_kpa, seconds=0.6, vented=True):
        """Return a zero adjustment after a constant reading."""
        zero = ZeroAdjustment()
        for _ in range(round(seconds / 0.002)):
            zero.observe(nominal_kpa, vented, 0.002)
        return zero

    @pytest.mark.parametrize("nominal_kpa", [-1.3, -0.4, 0.0, 1.3])
    def test_the_zero_is_the_reading_of_the_vented_sensor(self, nominal_kpa):
        zero = self.after_steady(nominal_kpa)
        assert not zero.taken
        assert zero.take()
        assert zero.zero_kpa == nominal_kpa

    @pytest.mark.parametrize("nominal_kpa", [-1.31, 1.31, 8.0, math.nan, math.inf])
    def test_a_reading_outside_the_span_of_the_data_sheet_is_not_taken(self, nominal_kpa):
        assert not self.after_steady(nominal_kpa).take()

    def test_the_zero_is_not_taken_before_half_a_second(self):
        assert not self.after_steady(0.1, 0.49).take()
        assert self.after_steady(0.1, 0.51).take()

    def test_the_zero_is_not_taken_if_the_rig_is_not_vented(self):
        assert not self.after_steady(0.1, vented=False).take()

    def test_the_zero_is_not_taken_while_the_reading_moves(self):
        zero = ZeroAdjustment()
        for step in range(1000):
            zero.observe(0.0005 * step, True, 0.002)
            assert not zero.take()

    def test_two_readings_half_a_second_apart_are_not_a_steady_half_second(self):
        zero = ZeroAdjustment()
        zero.observe(0.1, True, 0.002)
        zero.observe(0.1, True, 0.5)
        assert not zero.take()

    def test_the_zero_is_not_affected_by_readings_before_the_steady_time(self):
        harness = ChainHarness()
        harness.feed_kpa(1.0, seconds=1.0)
        harness.feed_kpa(0.2, seconds=1.5)
        assert harness.chain.zero.take()
        assert harness.chain.zero.zero_kpa == pytest.approx(0.2, abs=0.004)

    def test_restore_previous_exchanges_the_last_two_zeros(self):
        zero = self.after_steady(0.1)
        assert not zero.restore_previous()
        zero.take()
        assert not zero.restore_previous()
        for _ in range(300):
            zero.observe(0.3, True, 0.002)
        zero.take()
        seen = [zero.zero_kpa]
        for _ in range(2):
            assert zero.restore_previous()
            seen.append(zero.zero_kpa)
        assert seen == [0.3, 0.1, 0.3]


def test_the_zero_is_subtracted():
    m = ChainHarness.locked().move_to(9.0, 2.0)
    assert m.pressure_kpa == pytest.approx(9.0, abs=0.005)
    assert m.baseline_kpa == pytest.approx(8.0, abs=0.005)


def test_without_a_zero_there_is_a_pressure_but_no_force():
    harness = ChainHarness()
    m = harness.feed_kpa(8.0, BoardState.HOLDING, 1.0)
    assert m.quality == Quality.NOT_HOLDING | Quality.NOT_ZEROED
    assert m.pressure_kpa == pytest.approx(8.0, abs=0.005)
    assert math.isnan(m.force_n)


def test_the_filter_is_first_order_with_the_configured_time_constant():
    harness = ChainHarness.locked()
    assert harness.set_pressure(9.0, 0.06).pressure_kpa == pytest.approx(8 + (1 - math.exp(-1)), abs=0.005)
    assert harness.set_pressure(9.0, 0.12).pressure_kpa == pytest.approx(8 + (1 - math.exp(-3)), abs=0.005)


def test_the_unfiltered_pressure_has_no_lag():
    assert ChainHarness.locked().set_pressure(20.0, 0.002).unfiltered_kpa == pytest.approx(20.0, abs=0.005)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("baseline_kpa", "rise_kpa"), [(5.2, 1.0), (8.0, 0.8), (8.0, 4.0), (11.0, 2.0)])
def test_the_force_is_that_of_the_model_at_the_two_pressures(method, baseline_kpa, rise_kpa):
    harness = ChainHarness.locked(baseline_kpa, law=ForceLaw(method=method))
    m = harness.move_to(baseline_kpa + rise_kpa, 2.0)
    parameters = harness.chain.settings
    expected = estimate(
        m.baseline_kpa, m.baseline_kpa + m.rise_kpa, parameters.balloon, parameters.circuit, parameters.law
    )
    assert m.force_n == pytest.approx(expected.force_n, abs=1e-3)
    assert m.force_uncompensated_n == pytest.approx(expected.force_n, abs=1e-3)
    assert m.indentation_mm == pytest.approx(expected.indentation_mm, abs=1e-3)
    assert (m.in_contact, m.quality) == (True, Quality.GOOD)
    assert 0 < m.force_std_n < 1.0


def test_the_model_uses_the_reference_pressure_as_part_of_the_ambient_pressure():
    harness = ChainHarness.locked()
    harness.chain.reference_kpa = 1.6
    m, parameters = harness.move_to(10.0), harness.chain.settings
    denser = replace(parameters.circuit, ambient_kpa=parameters.circuit.ambient_kpa + 1.6)
    baseline_kpa, final_kpa = m.baseline_kpa - 1.6, m.baseline_kpa + m.rise_kpa - 1.6
    assert m.force_n == pytest.approx(
        estimate(baseline_kpa, final_kpa, parameters.balloon, denser).force_n, abs=1e-3
    )
    assert m.force_n != pytest.approx(
        estimate(baseline_kpa, final_kpa, parameters.balloon, parameters.circuit).force_n, abs=1e-3
    )


@pytest.mark.parametrize("baseline_kpa", [7.4, 7.6])
def test_the_lower_limit_of_a_free_balloon_follows_its_baseline(baseline_kpa):
    harness = ChainHarness.locked(baseline_kpa)
    m, parameters = harness.last, harness.chain.settings
    at_half_a_kpa = estimate(m.baseline_kpa, m.baseline_kpa + 0.5, parameters.balloon, parameters.circuit)
    assert m.force_lower_range_limit_n == pytest.approx(at_half_a_kpa.force_n, rel=2e-3)


@pytest.mark.parametrize("rise_kpa", [0.1, 0.3, 0.45])
def test_below_a_rise_of_0_5_kpa_the_force_is_interpolated_and_flagged(rise_kpa):
    m = ChainHarness.locked().move_to(8.0 + rise_kpa)
    assert m.quality == Quality.INTERPOLATED
    assert m.force_n == pytest.approx(m.force_lower_range_limit_n * m.rise_kpa / 0.5)


def test_the_force_is_continuous_at_a_rise_of_0_5_kpa():
    harness, forces = ChainHarness.locked(), []
    harness.move_to(8.45)
    for step in range(200):
        m = harness.move_to(8.45 + step * 0.0005, 0.1)
        forces.append((m.rise_kpa, m.force_n, m.quality))
    assert {q for _, _, q in forces} == {Quality.INTERPOLATED, Quality.GOOD}
    assert all(abs(b[1] - a[1]) <= 3 * abs(b[0] - a[0]) + 1e-3 for a, b in itertools.pairwise(forces))


@pytest.mark.parametrize(("baseline_kpa", "inside"), [(4.9, False), (5.0, True), (11.4, True), (11.5, False)])
def test_outside_the_validated_range_there_is_no_force_but_a_quality_flag(baseline_kpa, inside):
    m = ChainHarness.locked(baseline_kpa).move_to(baseline_kpa + 1.0)
    assert (m.quality == Quality.OUT_OF_RANGE) is not inside
    for value in (m.force_n, m.force_std_n, m.indentation_mm, m.contact_radius_mm):
        assert math.isfinite(value) is inside
    assert math.isfinite(m.pressure_kpa)


@pytest.mark.parametrize("rise_kpa", [2.0, 35.0])
def test_without_a_root_of_the_force_law_there_is_no_geometry_of_the_contact(rise_kpa):
    harness = ChainHarness.locked()
    harness.move_to(9.0)
    m = harness.set_pressure(8.0 + rise_kpa, 1.0)
    has_force = rise_kpa < 10.0
    assert (Quality.NO_SOLUTION in m.quality) is not has_force
    values = (m.force_n, m.force_std_n, m.indentation_mm, m.contact_radius_mm)
    assert [math.isfinite(value) for value in values] == [has_force] * 4


@pytest.mark.parametrize(("baseline_kpa", "inside"), [(4.0, False), (5.0, True), (11.4, True), (12.0, False)])
def test_a_free_balloon_outside_the_validated_range_shows_no_force(baseline_kpa, inside):
    m = ChainHarness.locked(baseline_kpa).move_to(baseline_kpa)
    assert (m.quality == Quality.OUT_OF_RANGE) is not inside
    assert math.isfinite(m.force_n) is math.isfinite(m.force_std_n) is inside


class TestUncertainty:
    """Tests of the live uncertainty: equal to the uncertainty budget at rest, larger in motion."""

    def test_the_noise_of_the_pressure_is_a_part_of_the_uncertainty(self):
        exact = InputUncertainties(**dict.fromkeys((f.name for f in fields(InputUncertainties)), 0.0))
        model = ModelUncertainty.constant(0.0)
        m = ChainHarness.locked(input_uncertainties=exact, model_uncertainty=model).move_to(9.5, 3.0)
        force_model = ChainSettings().force_model
        step_kpa = InputUncertainties().final_noise_kpa
        by_noise_n = (
            force_model.estimate(8.0, 9.5 + step_kpa).force_n - force_model.estimate(8.0, 9.5).force_n
        )
        assert m.force_std_n == pytest.approx(by_noise_n, rel=0.4)

    def test_a_slow_rise_during_a_contact_is_a_part_of_the_uncertainty(self):
        model = ModelUncertainty.constant(0.0)
        pressed = ChainHarness.locked(model_uncertainty=model).move_to(9.3, 6.0)
        harness = ChainHarness.locked(model_uncertainty=model)
        harness.move_to(9.0, 1.0)
        for step in range(2500):
            m = harness.set_pressure(9.0 + 0.3 * step / 2500)
        assert m.force_n == pytest.approx(pressed.force_n, rel=0.02)
        assert m.force_std_n > 1.2 * pressed.force_std_n

    @pytest.mark.parametrize("rise_kpa", [0.3, 1.5])
    @pytest.mark.parametrize("inputs", [InputUncertainties(), InputUncertainties(gain=0.1)])
    def test_at_rest_the_uncertainty_is_that_of_the_budget(self, rise_kpa, inputs):
        harness = ChainHarness.locked(input_uncertainties=inputs)
        m = harness.move_to(8.0 + rise_kpa, 3.0)
        parameters, age_s = harness.chain.settings, harness.chain.tracker.baseline_age_s
        final_kpa = m.baseline_kpa + m.rise_kpa
        lines = compute_budget(
            m.baseline_kpa,
            final_kpa,
            parameters.force_model,
            input_uncertainties=inputs,
            contact_s=age_s,
        )
        assert m.force_std_n == pytest.approx(combined_std_n(lines), rel=0.02)

    def test_the_heat_of_the_gas_adds_to_the_uncertainty_in_the_first_second_also_if_calibrated(self):
        inputs = replace(InputUncertainties(), **dict.fromkeys(COMPENSATED_INPUTS, 0.0))
        exact = {"model_uncertainty": ModelUncertainty.constant(0.0), "lag_relative_std": 0.0}
        parts_n = []
        for exponent_std in (inputs.polytropic, 0.0):
            stated = replace(inputs, polytropic=exponent_std)
            harness = ChainHarness.locked(input_uncertainties=stated, **exact)
            parts_n.append([harness.move_to(9.5, each_s).force_std_n for each_s in (0.2, 2.0)])
        (early_n, late_n), (without_early_n, without_late_n) = parts_n
        share = harness.chain.settings.force_model.parameter_stds_n(8.0, 1.5, inputs)["polytropic"]
        assert 0.5 * share < math.sqrt(early_n**2 - without_early_n**2) < share
        assert late_n == pytest.approx(without_late_n, rel=1e-2)

    def test_the_uncertainty_of_the_lag_counts_while_the_pressure_moves(self):
        exact_lag, uncertain_lag = (
            ChainHarness.locked(lag_relative_std=0.0),
            ChainHarness.locked(lag_relative_std=0.3),
        )
        for harness in (exact_lag, uncertain_lag):
            harness.move_to(9.5, 0.1)
        rate = uncertain_lag.chain._lag.rate_kpa_per_s
        by_final = uncertain_lag.chain._curve[0].at(uncertain_lag.last.rise_kpa).sensitivity.final_n_per_kpa
        added_n = 0.3 * 0.06 * rate * by_final
        assert rate > 2
        assert uncertain_lag.last.force_std_n == pytest.approx(
            math.hypot(exact_lag.last.force_std_n, added_n), rel=1e-3
        )

    def test_the_uncertainty_grows_with_the_drift_measured_before_the_contact(self):
        harness = ChainHarness.locked()
        for n in range(5000):
            harness.set_pressure(8.0 + 0.01 * n * 0.002)
        harness.tube = Tube(8.1, 8.1)
        early = harness.move_to(8.4, 1.0).force_std_n
        later = harness.move_to(8.4, 20.0).force_std_n
        drift = harness.chain.tracker.drift_kpa_per_s
        assert drift == pytest.approx(0.01, rel=0.2)
        sensitivity = harness.chain._curve[0].at(harness.last.rise_kpa).sensitivity
        grown = math.sqrt(later**2 - early**2)
        assert grown == pytest.approx(abs(sensitivity.baseline_n_per_kpa) * 20.0 * (drift + 0.0005), rel=0.15)

    def test_a_new_balloon_does_not_use_the_calibration_of_the_old_one(self):
        correction = ForceCorrection(
            constant=0.5, by_rise=0.0, by_initial=0.0, by_both=0.0,
            rise_span_kpa=(0.1, 5.0), baseline_span_kpa=(5.0, 11.0),
        )  # fmt: skip
        harness = ChainHarness.locked(correction=correction)
        calibrated_n = harness.move_to(9.5, 2.0).force_n
        harness.chain.remove_calibration()
        uncalibrated_n = harness.move_to(9.5, 0.01).force_n
        assert calibrated_n == pytest.approx(math.exp(0.5) * uncalibrated_n, rel=0.01)


@pytest.mark.parametrize("adc_sum", [0, 16, 163, 16041, MAX_ADC_SUM, 65535])
def test_an_open_or_short_sensor_gives_no_pressure_no_force_and_no_exception(adc_sum):
    harness = ChainHarness.locked()
    harness.move_to(9.0)
    m = harness.feed_adc_sum(adc_sum, BoardState.HOLDING)
    assert m.quality == Quality.SENSOR_FAULT
    assert math.isnan(m.pressure_kpa)
    assert math.isnan(m.force_n)
    assert not m.in_contact


def test_after_an_invalid_sample_the_filter_restarts():
    harness = ChainHarness.locked()
    harness.feed_adc_sum(0, BoardState.HOLDING)
    assert harness.set_pressure(10.0, 0.002).pressure_kpa == pytest.approx(10.0, abs=0.005)


def test_a_wrap_of_the_board_clock_has_no_effect():
    plain, wrapping = ChainHarness.locked(), ChainHarness(start_us=2**32 - 2_500_000)
    wrapping.feed_kpa(0.2, seconds=1.0)
    wrapping.chain.zero.take()
    wrapping.feed_kpa(8.2, BoardState.SETTLING, 1.0)
    wrapping.feed_kpa(8.2, BoardState.HOLDING, 1.0)
    assert wrapping.time_us > 2**32
    for _ in range(100):
        a, b = plain.set_pressure(9.0, 0.002), wrapping.set_pressure(9.0, 0.002)
        assert (a.pressure_kpa, a.force_n) == (b.pressure_kpa, b.force_n)


def test_after_a_long_gap_the_filtered_pressure_is_the_reading():
    harness = ChainHarness.locked()
    harness.elapsed_s = MAX_STEP_S
    assert harness.set_pressure(9.0, 0.002).pressure_kpa == pytest.approx(9.0, abs=0.01)


@settings(max_examples=300)
@given(
    st.sampled_from(sorted(METHODS)),
    st.floats(-1, 3),
    st.floats(-1.3, 1.3),
    st.lists(
        st.tuples(
            st.integers(0, 65535) | st.integers(655, 8000), st.sampled_from(BoardState), st.integers(0, 2**32)
        ),
        max_size=25,
    ),
)
def test_random_samples_give_floats_and_no_exception(method, reference_kpa, zero_kpa, samples):
    chain = Chain(ChainSettings(law=ForceLaw(method=method)), reference_kpa=reference_kpa)
    chain.zero.zero_kpa = zero_kpa
    for adc_sum, state, time_us in samples:
        for repeat in range(2):  # two equal samples, so that a contact can have a baseline
            message = Sample((time_us + repeat) & 0xFFFF_FFFF, adc_sum, 5000, 0, state, 0, 0, 0, 0)
            m = chain.step(RawSample(0, 0.0, message))
            for name in m.__slots__:
                value = getattr(m, name)
                assert isinstance(value, (float, bool, Quality)), (name, value)
                assert not (isinstance(value, float) and math.isinf(value)), (name, value)
            assert m.quality & ~Quality.INTERPOLATED or math.isfinite(m.force_n)
