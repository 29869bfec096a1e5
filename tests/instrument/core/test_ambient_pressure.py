"""Tests of the written ambient pressure: plausibility, time-out, and the force that follows from it."""

import json
import math
from dataclasses import replace

import pytest

from pneuforce.instrument.core.barometer import is_plausible
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.measurement.ambient import AmbientPressure
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import Circuit, ForceCorrection
from pneuforce.instrument.recording.checkpoint import restore_session, save_session
from tests.instrument.instrument_harness import PLC, InstrumentHarness

CONFIGURED_KPA = Circuit().ambient_kpa
LOW = {"ambient_pressure_kpa": CONFIGURED_KPA - 5.0}
CORRECTION = ForceCorrection(
    constant=0.1,
    by_rise=0.0,
    by_initial=0.0,
    by_both=0.0,
    rise_span_kpa=(0.5, 5.0),
    baseline_span_kpa=(5.0, 11.0),
)
LOW_CHAIN = ChainSettings(circuit=Circuit(ambient_kpa=CONFIGURED_KPA - 5.0))


def holding(request=None, **settings):
    harness = InstrumentHarness.holding(ambient_timeout_s=10.0, **settings)
    if request:
        harness.write_ok(request)
    return harness.run(0.1)


def pressed(harness):
    """Return the measurement of a press of 2 kPa."""
    harness.push_kpa = 2.0
    harness.run(0.8)
    return harness.instrument.measurement


@pytest.mark.parametrize(
    ("written_kpa", "recent_kpa", "plausible"),
    [
        (CONFIGURED_KPA, math.nan, True),
        (CONFIGURED_KPA - 5.9, math.nan, True),
        (CONFIGURED_KPA + 6.1, math.nan, False),
        (CONFIGURED_KPA - 6.1, math.nan, False),
        (CONFIGURED_KPA, CONFIGURED_KPA - 0.9, True),
        (CONFIGURED_KPA, CONFIGURED_KPA - 1.1, False),
        (math.nan, math.nan, False),
        (math.inf, math.nan, False),
    ],
)
def test_a_plausible_pressure_agrees_with_the_configuration_and_with_the_value_before(
    written_kpa, recent_kpa, plausible
):
    assert is_plausible(written_kpa, CONFIGURED_KPA, recent_kpa) is plausible


def test_an_implausible_pressure_is_rejected_and_nothing_of_its_request_is_used():
    harness = holding()
    far = {"ambient_pressure_kpa": CONFIGURED_KPA + 7.0, "force_limit_n": 1.0}
    assert harness.write(far) == "implausible"
    seen = harness.run(0.1).snapshot()
    assert (seen.ambient_source, seen.ambient_in_effect_kpa) == ("configured", CONFIGURED_KPA)
    assert math.isnan(seen.ambient_pressure_kpa)
    assert math.isnan(seen.ambient_age_s)
    assert seen.force_limit_n == 5.0


def test_a_jump_is_rejected_until_the_last_value_is_old():
    harness = holding(LOW)
    jump = {"ambient_pressure_kpa": CONFIGURED_KPA - 3.0}
    assert harness.write(jump) == "implausible"
    harness.run(10.1)
    harness.write_ok(jump)


def test_a_write_without_an_ambient_pressure_is_not_compared_with_the_configuration():
    harness = holding(LOW)
    harness.write_ok({"force_limit_n": 1.0})


def test_a_written_pressure_gives_the_force_of_this_ambient_pressure():
    force_n = pressed(holding(LOW)).force_n
    assert force_n == pytest.approx(pressed(holding(chain=LOW_CHAIN)).force_n, rel=1e-6)
    assert force_n != pytest.approx(pressed(holding()).force_n, rel=1e-3)


def test_the_written_pressure_is_used_for_its_time_and_then_the_configured_one():
    harness = holding(LOW)
    seen = harness.snapshot()
    assert (seen.ambient_source, seen.ambient_in_effect_kpa) == ("measured", CONFIGURED_KPA - 5.0)
    harness.run(9.8)
    assert harness.snapshot().ambient_source == "measured"
    seen = harness.run(0.2).snapshot()
    assert (seen.ambient_source, seen.ambient_in_effect_kpa) == ("configured", CONFIGURED_KPA)
    assert seen.ambient_pressure_kpa == CONFIGURED_KPA - 5.0
    assert seen.ambient_age_s == pytest.approx(10.1, abs=0.02)


def test_noise_does_not_change_the_pressure_in_effect():
    harness = holding(LOW)
    harness.write_ok({"ambient_pressure_kpa": CONFIGURED_KPA - 5.04})
    assert harness.run(0.1).snapshot().ambient_in_effect_kpa == CONFIGURED_KPA - 5.0


@pytest.mark.parametrize("first", [None, LOW])
def test_a_write_in_a_contact_changes_the_force_only_after_the_contact(first):
    harness = holding(first)
    before = pressed(harness)
    in_effect_kpa = harness.snapshot().ambient_in_effect_kpa
    written = {"ambient_pressure_kpa": CONFIGURED_KPA - 4.5}
    harness.write_ok(written)
    after = pressed(harness)
    assert after.force_n == pytest.approx(before.force_n, rel=1e-3)
    assert harness.snapshot().ambient_in_effect_kpa == in_effect_kpa
    harness.push_kpa = 0.0
    assert harness.run(1.0).snapshot().ambient_in_effect_kpa == CONFIGURED_KPA - 4.5


def test_a_pressure_that_becomes_old_in_a_contact_keeps_the_force_but_not_its_small_uncertainty():
    harness, other = holding(LOW), holding(LOW)
    pressed(harness), pressed(other)
    for each, renewed in ((harness, LOW), (other, {"force_limit_n": 5.0})):
        each.run(5.0)
        each.write_ok(renewed)
        each.run(5.0)
    recent, old = harness.instrument.measurement, other.instrument.measurement
    assert (recent.force_n, recent.rise_kpa) == (old.force_n, old.rise_kpa)
    assert recent.force_std_n < old.force_std_n


class TestUncertainty:
    """Tests of the standard uncertainty of P_0."""

    def std_kpa(self, settings, **changes):
        ambient = AmbientPressure(**changes)
        return ambient.input_uncertainties(settings).ambient_kpa

    def test_it_is_that_of_the_barometer_only_while_its_value_is_recent(self):
        settings = ChainSettings(ambient_std_kpa=0.2)
        assert self.std_kpa(settings) == 1.0
        assert self.std_kpa(settings, measured_kpa=100.0, recent=True) == 0.2
        assert self.std_kpa(settings, measured_kpa=100.0) == 1.0

    def test_a_recent_value_that_is_not_in_use_does_not_reduce_it(self):
        ambient = AmbientPressure()
        ambient.follow(100.0, in_contact=True)
        assert ambient.input_uncertainties(ChainSettings()).ambient_kpa == 1.0

    def test_a_calibration_with_forces_keeps_that_of_the_configured_pressure(self):
        corrected = ChainSettings(correction=CORRECTION)
        compensated = replace(
            ChainSettings(), input_uncertainties=replace(ChainSettings().input_uncertainties, ambient_kpa=0.0)
        )
        for settings in (corrected, compensated):
            assert self.std_kpa(settings, measured_kpa=100.0, recent=True) == 1.0
        assert self.std_kpa(compensated) == 0.0


@pytest.mark.parametrize("required", [False, True])
def test_a_missing_pressure_is_shown_only_if_it_is_required(required):
    harness = holding(ambient_required=required)
    for request, missing in (({"force_limit_n": 5.0}, True), (LOW, False)):
        harness.write_ok(request)
        status = harness.run(0.1).snapshot().status
        assert ("maintenance_required" in status) is (required and missing)
        assert "force_valid" in status
    harness.run(10.0)
    assert ("maintenance_required" in harness.snapshot().status) is required


def test_a_restored_session_continues_with_the_same_force():
    harness = holding(LOW)
    pressed(harness)
    harness.push_kpa = 0.0
    harness.run(1.0)  # the snapshot has a peak, because NaN differs from NaN
    pressed(harness)
    session = Session(harness.instrument)
    restored = restore_session(save_session(session)).instrument
    assert json.loads(save_session(session))["instrument"]["chain"]["ambient"]["recent"] is True
    for _ in range(50):
        harness.feed()
        assert restored.process(harness.instrument.raw) == harness.instrument.measurement
    assert restored.snapshot(PLC, harness.now_s) == harness.snapshot()
