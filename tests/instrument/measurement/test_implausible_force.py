"""Tests of an implausible calibrated force while the instrument runs: no bus shows such a force."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration.plausibility import check_force
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import METHODS, Circuit, ForceCorrection, ForceLaw
from pneuforce.instrument.model.curve import NODE_RATIO, ContactCurve
from pneuforce.instrument.model.plausibility import ForceSpan, method_span, plausible_span
from pneuforce.instrument.model.published_model import PublishedModel
from tests.instrument.instrument_harness import InstrumentHarness

NEUTRAL = ForceCorrection(
    constant=0.0, by_rise=0.0, by_initial=0.0, by_both=0.0,
    rise_span_kpa=(0.2, 4.0), baseline_span_kpa=(5.0, 11.4), law=ChainSettings().law,
)  # fmt: skip
TOO_LOW, TOO_HIGH = replace(NEUTRAL, constant=-3.0), replace(NEUTRAL, constant=2.0)
#: The forces of this correction are plausible up to about 9 kPa. At 11.4 kPa they are twelve times too high.
EXTRAPOLATED = replace(NEUTRAL, by_initial=1.0)
implausible = pytest.mark.parametrize("correction", [TOO_LOW, TOO_HIGH, replace(NEUTRAL, constant=math.nan)])


def pressed(correction, push_kpa=2.2, setpoint_kpa=8.0):
    chain = replace(ChainSettings(), correction=correction)
    harness = InstrumentHarness.holding(request={"setpoint_requested_kpa": setpoint_kpa}, chain=chain)
    harness.write_ok({"force_limit_n": 1.0})
    harness.push_kpa = push_kpa
    return harness.run(0.8)


@implausible
def test_an_implausible_force_is_not_shown(correction):
    harness = pressed(correction)
    seen = harness.snapshot()
    assert seen.method == "energetic_calibrated"
    for value in (seen.force_n, seen.force_std_n, seen.force_uncompensated_n, seen.force_lower_range_limit_n):
        assert math.isnan(value)
    assert math.isfinite(seen.pressure_kpa + seen.rise_kpa)
    assert {"out_of_range", "out_of_specification", "in_contact"} <= seen.status
    assert "force_valid" not in seen.status


@implausible
def test_the_force_alarm_works_while_the_calibrated_force_is_implausible(correction):
    """The alarm compares the force without correction, which is 1.9 N, with the limit of 1 N."""
    assert "force_high_alarm" in pressed(correction).snapshot().status
    assert "force_high_alarm" not in pressed(correction, push_kpa=0.15).snapshot().status


@implausible
def test_a_free_balloon_shows_no_force_while_the_calibrated_force_is_implausible(correction):
    seen = pressed(correction, push_kpa=0.0).snapshot()
    assert math.isnan(seen.force_n)
    assert math.isnan(seen.force_std_n)
    assert "out_of_range" in seen.status
    assert "force_valid" not in seen.status


@pytest.mark.parametrize(("setpoint_kpa", "shown"), [(8.0, True), (11.4, False)])
def test_a_correction_is_used_only_at_the_pressures_at_which_its_force_is_plausible(setpoint_kpa, shown):
    seen = pressed(EXTRAPOLATED, setpoint_kpa=setpoint_kpa).snapshot()
    assert math.isfinite(seen.force_n) is shown
    assert ("force_valid" in seen.status) is shown
    assert ("out_of_range" in seen.status) is not shown


def floats(low, high):
    return st.floats(low, high, allow_nan=False)


def spans(low, high):
    return st.tuples(floats(low, high), floats(low, high)).map(lambda ends: tuple(sorted(ends)))


laws = st.builds(
    ForceLaw,
    method=st.sampled_from(sorted(METHODS)),
    switch=st.sampled_from(["paper", "blend"]),
    low=st.sampled_from(["line", "smooth"]),
)
circuits = st.builds(Circuit, volume_mm3=floats(500.0, 60_000.0), ambient_kpa=floats(60.0, 110.0))


def corrections(scale):
    """Return a strategy for corrections, whose coefficients are at most `scale` times a typical value."""
    coefficient = floats(-scale, scale)
    return st.builds(
        ForceCorrection,
        constant=coefficient,
        by_rise=coefficient,
        by_initial=coefficient.map(lambda value: 0.2 * value),
        by_both=coefficient.map(lambda value: 0.2 * value),
        by_step=coefficient,
        rise_span_kpa=spans(0.06, 20.0),
        baseline_span_kpa=spans(4.95, 11.45),
        law=laws,
    )


def shown_and_limits(correction, circuit, baseline_kpa, rise_kpa):
    """Return both forces of a curve, and the documented limits at these pressures.

    The upper limit falls where the method with the highest force ends. A curve computes the limits only at
    its nodes, so that the limit of the node before applies up to the next node.
    """
    balloon = correction.balloon
    curve = ContactCurve(baseline_kpa, PublishedModel(balloon, circuit, correction.law), correction)
    limits, before = (
        plausible_span(rise, method_span(baseline_kpa, rise, balloon, circuit, correction.law.switch))
        for rise in (rise_kpa, rise_kpa / NODE_RATIO)
    )
    limits = ForceSpan(limits.low_n, max(limits.high_n, before.high_n))
    return (curve.at(rise_kpa).estimate.force_n, curve.force_n(rise_kpa)), limits


@given(corrections(10.0), circuits, floats(3.0, 14.0), floats(0.0, 20.0))
def test_no_correction_can_show_a_force_outside_the_limits(correction, circuit, baseline_kpa, rise_kpa):
    forces_n, limits = shown_and_limits(correction, circuit, baseline_kpa, rise_kpa)
    for force_n in forces_n:
        if math.isfinite(force_n):
            assert 0.99 * limits.low_n <= force_n <= 1.01 * limits.high_n


@given(corrections(1.0), circuits, floats(4.95, 11.45), floats(0.0, 20.0))
def test_an_accepted_correction_shows_every_force_at_the_measured_pressures(
    correction, circuit, baseline_kpa, rise_kpa
):
    chain = replace(ChainSettings(), law=correction.law, circuit=circuit, correction=correction)
    try:
        check_force(chain)
    except ConfigurationError:
        assume(False)
    baseline_kpa = float(np.clip(baseline_kpa, *correction.baseline_span_kpa))
    rise_kpa = min(rise_kpa, correction.rise_span_kpa[1])
    (shown_n, _), limits = shown_and_limits(correction, circuit, baseline_kpa, rise_kpa)
    laws = (ForceLaw(switch=correction.law.switch), correction.law)
    energetic, uncorrected = (
        ContactCurve(baseline_kpa, PublishedModel(correction.balloon, circuit, law)) for law in laws
    )
    if math.isfinite(energetic.force_n(rise_kpa) + uncorrected.force_n(rise_kpa)):
        assert 0.99 * limits.low_n <= shown_n <= 1.01 * limits.high_n
