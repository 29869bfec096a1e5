"""The chain: counts to kPa by the data sheet, zero, filter, contact, force; NaN where there is none."""

import itertools
import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from instrument.chain import Chain, ChainSettings
from instrument.measurement import Quality
from instrument.model import METHODS, Correction, Law, estimate
from instrument.model.budget import budget, total_n
from instrument.rig.frames import COUNTS_LIMIT, BoardState, Sample
from instrument.rig.limits import nominal_pressure_kpa
from instrument.rig.link import LONGEST_STEP_S, RawSample
from instrument.sensor import Zero
from tests.instrument.driving import Tube, adc_sum_of

DT_US = 2000


class Feed:
    """A chain, fed with one sample each 2 ms of board time."""

    def __init__(self, start_us=0, **own):
        self.chain = Chain(ChainSettings(**own))
        self.time_us, self.last, self.elapsed_s, self.tube = start_us, None, 0.002, Tube()

    def adc(self, adc_sum, state=BoardState.VENTED, seconds=0.002):
        for _ in range(max(1, round(seconds / 0.002))):
            self.time_us += DT_US
            message = Sample(self.time_us & 0xFFFF_FFFF, adc_sum, 5000, 0, state, 0, 0, 0, 0)
            self.last = self.chain.step(RawSample(0, self.time_us * 1e-6, message, self.elapsed_s))
        return self.last

    def kpa(self, pressure_kpa, state=BoardState.VENTED, seconds=0.002):
        return self.adc(adc_sum_of(pressure_kpa), state, seconds)

    @classmethod
    def locked(cls, initial_kpa=8.0, **own):
        feed = cls(**own)
        feed.kpa(0.2, seconds=1.0)
        assert feed.chain.zero.take()
        feed.kpa(0.2 + initial_kpa, BoardState.SETTLING, 1.0)
        feed.kpa(0.2 + initial_kpa, BoardState.HOLDING, 1.0)
        feed.tube = Tube(initial_kpa, initial_kpa)
        return feed

    def jump(self, pressure_kpa, seconds=0.002):
        """A pressure that the sensor shows at once."""
        return self.kpa(0.2 + pressure_kpa, BoardState.HOLDING, seconds)

    def press(self, pressure_kpa, seconds=1.0):
        """Press from the pressure that was last, as fast as a hand and the tube allow."""
        for _ in range(max(1, round(seconds / 0.002))):
            self.kpa(0.2 + self.tube.step(pressure_kpa), BoardState.HOLDING)
        return self.last


class TestSensor:
    """MPXV5050DP: V_out = V_s (0.018 P + 0.04), so 0.2 V at 0 kPa and 4.7 V at 50 kPa with 5 V."""

    @pytest.mark.parametrize(("volts", "kpa"), [(0.2, 0.0), (4.7, 50.0), (2.45, 25.0), (0.92, 8.0)])
    def test_the_transfer_function_is_the_data_sheets(self, volts, kpa):
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
    """Only from a vented and steady rig."""

    def steady(self, nominal_kpa, seconds=0.6, vented=True):
        zero = Zero()
        for _ in range(round(seconds / 0.002)):
            zero.observe(nominal_kpa, vented, 0.002)
        return zero

    @pytest.mark.parametrize("nominal_kpa", [-1.3, -0.4, 0.0, 1.3])
    def test_it_is_what_the_vented_sensor_reads(self, nominal_kpa):
        zero = self.steady(nominal_kpa)
        assert not zero.taken
        assert zero.take()
        assert zero.zero_kpa == nominal_kpa

    @pytest.mark.parametrize("nominal_kpa", [-1.31, 1.31, 8.0, math.nan, math.inf])
    def test_beyond_the_data_sheets_span_the_sensor_is_broken(self, nominal_kpa):
        assert not self.steady(nominal_kpa).take()

    def test_not_before_half_a_second(self):
        assert not self.steady(0.1, 0.49).take()
        assert self.steady(0.1, 0.51).take()

    def test_not_when_not_vented(self):
        assert not self.steady(0.1, vented=False).take()

    def test_not_when_it_moves(self):
        zero = Zero()
        for step in range(1000):
            zero.observe(0.0005 * step, True, 0.002)
            assert not zero.take()

    def test_two_readings_half_a_second_apart_are_not_a_steady_half_second(self):
        zero = Zero()
        zero.observe(0.1, True, 0.002)
        zero.observe(0.1, True, 0.5)
        assert not zero.take()

    def test_it_is_not_what_was_read_before_it_became_steady(self):
        feed = Feed()
        feed.kpa(1.0, seconds=1.0)
        feed.kpa(0.2, seconds=1.5)
        assert feed.chain.zero.take()
        assert feed.chain.zero.zero_kpa == pytest.approx(0.2, abs=0.004)

    def test_undo_goes_back_one_and_again_forth(self):
        zero = self.steady(0.1)
        assert not zero.undo()
        zero.take()
        assert not zero.undo()
        for _ in range(300):
            zero.observe(0.3, True, 0.002)
        zero.take()
        seen = [zero.zero_kpa]
        for _ in range(2):
            assert zero.undo()
            seen.append(zero.zero_kpa)
        assert seen == [0.3, 0.1, 0.3]


def test_the_zero_is_taken_off():
    m = Feed.locked().press(9.0, 2.0)
    assert m.pressure_kpa == pytest.approx(9.0, abs=0.005)
    assert m.initial_kpa == pytest.approx(8.0, abs=0.005)


def test_without_a_zero_there_is_a_pressure_and_no_force():
    feed = Feed()
    m = feed.kpa(8.0, BoardState.HOLDING, 1.0)
    assert m.quality == Quality.NOT_HOLDING | Quality.NOT_ZEROED
    assert m.pressure_kpa == pytest.approx(8.0, abs=0.005)
    assert math.isnan(m.force_n)


def test_the_filter_is_first_order_with_the_stated_time_constant():
    feed = Feed.locked()
    assert feed.jump(9.0, 0.06).pressure_kpa == pytest.approx(8 + (1 - math.exp(-1)), abs=0.005)
    assert feed.jump(9.0, 0.12).pressure_kpa == pytest.approx(8 + (1 - math.exp(-3)), abs=0.005)


def test_the_interlocks_get_the_pressure_unfiltered():
    assert Feed.locked().jump(20.0, 0.002).unfiltered_kpa == pytest.approx(20.0, abs=0.005)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("initial_kpa", "rise_kpa"), [(5.2, 1.0), (8.0, 0.8), (8.0, 4.0), (11.0, 2.0)])
def test_the_force_is_the_models_at_the_two_pressures(method, initial_kpa, rise_kpa):
    feed = Feed.locked(initial_kpa, law=Law(method=method))
    m = feed.press(initial_kpa + rise_kpa, 2.0)
    own = feed.chain.settings
    expected = estimate(m.initial_kpa, m.initial_kpa + m.rise_kpa, own.balloon, own.circuit, own.law)
    assert m.force_n == pytest.approx(expected.force_n, abs=1e-3)
    assert m.force_uncompensated_n == pytest.approx(expected.force_n, abs=1e-3)
    assert m.indentation_mm == pytest.approx(expected.indentation_mm, abs=1e-3)
    assert (m.in_contact, m.quality) == (True, Quality.GOOD)
    assert 0 < m.force_std_n < 0.5


def test_under_insufflation_the_model_sees_the_pressures_above_the_reference_and_a_denser_gas():
    feed = Feed.locked()
    feed.chain.reference_kpa = 1.6
    m, own = feed.press(10.0), feed.chain.settings
    denser = replace(own.circuit, ambient_kpa=own.circuit.ambient_kpa + 1.6)
    initial_kpa, final_kpa = m.initial_kpa - 1.6, m.initial_kpa + m.rise_kpa - 1.6
    assert m.force_n == pytest.approx(estimate(initial_kpa, final_kpa, own.balloon, denser).force_n, abs=1e-3)
    assert m.force_n != pytest.approx(
        estimate(initial_kpa, final_kpa, own.balloon, own.circuit).force_n, abs=1e-3
    )


@pytest.mark.parametrize("initial_kpa", [7.4, 7.6])
def test_the_lower_limit_of_a_free_balloon_follows_its_baseline(initial_kpa):
    feed = Feed.locked(initial_kpa)
    m, own = feed.last, feed.chain.settings
    at_half_a_kpa = estimate(m.initial_kpa, m.initial_kpa + 0.5, own.balloon, own.circuit)
    assert m.force_low_n == pytest.approx(at_half_a_kpa.force_n, rel=2e-3)


@pytest.mark.parametrize("rise_kpa", [0.1, 0.3, 0.45])
def test_below_half_a_kpa_the_force_lies_on_the_line_to_zero_and_says_so(rise_kpa):
    m = Feed.locked().press(8.0 + rise_kpa)
    assert m.quality == Quality.INTERPOLATED
    assert m.force_n == pytest.approx(m.force_low_n * m.rise_kpa / 0.5)


def test_the_line_meets_the_law_at_half_a_kpa():
    feed, forces = Feed.locked(), []
    feed.press(8.45)
    for step in range(200):
        m = feed.press(8.45 + step * 0.0005, 0.1)
        forces.append((m.rise_kpa, m.force_n, m.quality))
    assert {q for _, _, q in forces} == {Quality.INTERPOLATED, Quality.GOOD}
    assert all(abs(b[1] - a[1]) <= 3 * abs(b[0] - a[0]) + 1e-3 for a, b in itertools.pairwise(forces))


@pytest.mark.parametrize(("initial_kpa", "inside"), [(4.9, False), (5.0, True), (11.4, True), (11.5, False)])
def test_outside_the_validated_range_there_is_no_force_and_a_reason(initial_kpa, inside):
    m = Feed.locked(initial_kpa).press(initial_kpa + 1.0)
    assert (m.quality == Quality.OUT_OF_RANGE) is not inside
    assert math.isfinite(m.force_n) is inside
    assert math.isfinite(m.pressure_kpa)


class TestUncertainty:
    """The one that is stated live: the budget's at rest, more where pressure or baseline move."""

    @pytest.mark.parametrize("rise_kpa", [0.3, 1.5])
    def test_at_rest_it_is_the_budgets(self, rise_kpa):
        feed = Feed.locked()
        m = feed.press(8.0 + rise_kpa, 3.0)
        own, age_s = feed.chain.settings, feed.chain.tracker.baseline_age_s
        final_kpa = m.initial_kpa + m.rise_kpa
        lines = budget(m.initial_kpa, final_kpa, own.balloon, own.circuit, own.law, contact_s=age_s)
        assert m.force_std_n == pytest.approx(total_n(lines), rel=0.02)

    def test_a_moving_pressure_is_less_certain_by_what_the_lag_is_uncertain(self):
        sure, unsure = Feed.locked(lag_share=0.0), Feed.locked(lag_share=0.3)
        for feed in (sure, unsure):
            feed.press(9.5, 0.1)
        rate = unsure.chain._lag.rate_kpa_per_s
        by_final = unsure.chain._curve[0].at(unsure.last.rise_kpa).spread.final_n_per_kpa
        added_n = 0.3 * 0.06 * rate * by_final
        assert rate > 2
        assert unsure.last.force_std_n == pytest.approx(math.hypot(sure.last.force_std_n, added_n), rel=1e-3)

    def test_a_drift_that_was_seen_before_the_contact_grows_with_it(self):
        feed = Feed.locked()
        for n in range(5000):
            feed.jump(8.0 + 0.01 * n * 0.002)
        feed.tube = Tube(8.1, 8.1)
        early = feed.press(8.4, 1.0).force_std_n
        later = feed.press(8.4, 20.0).force_std_n
        drift = feed.chain.tracker.drift_kpa_per_s
        assert drift == pytest.approx(0.01, rel=0.2)
        spread = feed.chain._curve[0].at(feed.last.rise_kpa).spread
        grown = math.sqrt(later**2 - early**2)
        assert grown == pytest.approx(abs(spread.initial_n_per_kpa) * 20.0 * (drift + 0.0005), rel=0.15)

    def test_a_new_balloon_is_not_judged_by_the_calibration_of_the_old(self):
        taught = Correction(
            constant=0.5, by_rise=0.0, by_initial=0.0, by_both=0.0,
            rise_span_kpa=(0.1, 5.0), initial_span_kpa=(5.0, 11.0),
        )  # fmt: skip
        feed = Feed.locked(correction=taught)
        calibrated_n = feed.press(9.5, 2.0).force_n
        feed.chain.uncalibrate()
        bare_n = feed.press(9.5, 0.01).force_n
        assert calibrated_n == pytest.approx(math.exp(0.5) * bare_n, rel=0.01)


@pytest.mark.parametrize("adc_sum", [0, 16, 163, 16041, COUNTS_LIMIT, 65535])
def test_a_sensor_open_or_short_gives_nothing_and_no_exception(adc_sum):
    feed = Feed.locked()
    feed.press(9.0)
    m = feed.adc(adc_sum, BoardState.HOLDING)
    assert m.quality == Quality.SENSOR
    assert math.isnan(m.pressure_kpa)
    assert math.isnan(m.force_n)
    assert not m.in_contact


def test_after_a_broken_sensor_the_old_pressure_does_not_linger():
    feed = Feed.locked()
    feed.adc(0, BoardState.HOLDING)
    assert feed.jump(10.0, 0.002).pressure_kpa == pytest.approx(10.0, abs=0.005)


def test_the_boards_clock_wraps_without_a_trace():
    plain, wrapping = Feed.locked(), Feed(start_us=2**32 - 2_500_000)
    wrapping.kpa(0.2, seconds=1.0)
    wrapping.chain.zero.take()
    wrapping.kpa(8.2, BoardState.SETTLING, 1.0)
    wrapping.kpa(8.2, BoardState.HOLDING, 1.0)
    assert wrapping.time_us > 2**32
    for _ in range(100):
        a, b = plain.jump(9.0, 0.002), wrapping.jump(9.0, 0.002)
        assert (a.pressure_kpa, a.force_n) == (b.pressure_kpa, b.force_n)


def test_after_a_gap_the_filter_follows_at_once():
    feed = Feed.locked()
    feed.elapsed_s = LONGEST_STEP_S
    assert feed.jump(9.0, 0.002).pressure_kpa == pytest.approx(9.0, abs=0.01)


@settings(max_examples=300, deadline=None)
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
def test_whatever_comes_every_number_is_a_float_and_nothing_raises(method, reference_kpa, zero_kpa, samples):
    chain = Chain(ChainSettings(law=Law(method=method)), reference_kpa=reference_kpa)
    chain.zero.zero_kpa = zero_kpa
    for adc_sum, state, time_us in samples:
        for lag in range(2):  # a second time, so that a contact has a baseline
            message = Sample((time_us + lag) & 0xFFFF_FFFF, adc_sum, 5000, 0, state, 0, 0, 0, 0)
            m = chain.step(RawSample(0, 0.0, message))
            for name in m.__slots__:
                value = getattr(m, name)
                assert isinstance(value, (float, bool, Quality)), (name, value)
                assert not (isinstance(value, float) and math.isinf(value)), (name, value)
            assert m.quality & ~Quality.INTERPOLATED or math.isfinite(m.force_n)
