"""Tests of the largest rise, above which a balloon may be pressed flat."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneuforce import InvalidForce, force
from pneuforce.instrument.cli.model.estimate import estimate_contact
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.measurement import Quality
from pneuforce.instrument.model import LIVE_LAW, Balloon, Circuit
from pneuforce.instrument.model.correction import ForceCorrection
from pneuforce.instrument.model.curve import ContactCurve
from pneuforce.instrument.model.flat_balloon import largest_rise_kpa
from pneuforce.instrument.studies.measured_playback import measure_playback
from pneuforce.sim.headless import Playback
from pneuforce.sim.plants.membrane.plant import MembranePlant
from pneuforce.sim.plants.plant import AMBIENT_KPA, TUBES_MM3, Gas
from pneuforce.sim.scenario import Scenario

BASELINES_KPA = (5.0, 6.5, 8.0, 9.5, 11.0)
PUSHES_N = np.arange(0.0, 8.0, 0.05)
DOCUMENT = (Path(__file__).parents[3] / "docs/model.md").read_text(encoding="utf-8")


def pressed(contact, baseline_kpa):
    """Return the rises [kPa] of the simulated rubber balloon at `PUSHES_N`."""
    plant = MembranePlant(contact=contact)
    radius_mm = plant.radius_mm(baseline_kpa)
    volume_mm3 = TUBES_MM3 + 4 / 3 * math.pi * radius_mm**3
    gas = Gas(volume_mm3 * (AMBIENT_KPA + baseline_kpa))
    return np.array([plant.settle(gas, push_n).pressure_kpa for push_n in PUSHES_N]) - baseline_kpa


@pytest.mark.parametrize("contact", ["slide", "stick"])
@pytest.mark.parametrize("baseline_kpa", BASELINES_KPA)
def test_the_rubber_balloon_is_flat_shortly_above_the_largest_rise(contact, baseline_kpa):
    flat_kpa = pressed(contact, baseline_kpa)[-1]
    assert 0.85 * flat_kpa < largest_rise_kpa(baseline_kpa, Balloon(), Circuit(), 1) < flat_kpa


def test_the_document_has_the_forces_of_the_rubber_balloon():
    rows = []
    for baseline_kpa in BASELINES_KPA:
        rises_kpa = pressed("slide", baseline_kpa)
        flat = int(np.argmax(rises_kpa >= rises_kpa[-1] - 1e-3))
        largest_kpa = largest_rise_kpa(baseline_kpa, Balloon(), Circuit(), 1)
        rows.append(
            (rises_kpa[-1], np.interp(largest_kpa, rises_kpa[:flat], PUSHES_N[:flat]), PUSHES_N[flat])
        )
    for title, values in zip(
        (
            "rise of the flat balloon",
            "true force at the largest rise",
            "true force from which the balloon is flat",
        ),
        zip(*rows, strict=True),
        strict=True,
    ):
        assert re.search(rf"\| {title}.* \| {re.escape(' | '.join(f'{v:.2f}' for v in values))} \|", DOCUMENT)


def test_a_balloon_with_two_pressed_sides_and_a_warm_gas_allow_larger_rises():
    one = largest_rise_kpa(8.0, Balloon(), Circuit(), 1)
    assert largest_rise_kpa(8.0, Balloon(), Circuit(), 2) > 2 * one
    assert largest_rise_kpa(8.0, Balloon(), Circuit(polytropic=1.2), 1) > one
    assert largest_rise_kpa(8.0, Balloon(), Circuit(volume_mm3=20e3), 1) < one


@pytest.mark.parametrize("baseline_kpa", [0.0, 12.5, 14.0, 30.0])
def test_outside_the_range_the_largest_rise_is_finite_and_not_negative(baseline_kpa):
    assert 0 <= largest_rise_kpa(baseline_kpa, Balloon(), Circuit(), 1) < 30


def test_without_a_pressure_there_is_no_largest_rise():
    assert math.isnan(largest_rise_kpa(math.nan, Balloon(), Circuit(), 1))


def test_calibrated_contacts_with_a_larger_rise_extend_the_range():
    model = ChainSettings().force_model
    plain = ContactCurve(8.0, model).largest_rise_kpa
    for span_kpa, expected_kpa in (((0.5, 3.0), plain), ((0.5, 6.0), 6.0 * 1.02)):
        correction = ForceCorrection(
            constant=0.0,
            by_rise=0.0,
            by_initial=0.0,
            by_both=0.0,
            rise_span_kpa=span_kpa,
            baseline_span_kpa=(7.0, 9.0),
        )
        assert ContactCurve(8.0, model, correction).largest_rise_kpa == pytest.approx(expected_kpa)
        shown = estimate_contact(8.0, 9.2, replace(ChainSettings(), correction=correction)).largest
        assert shown.rise_kpa == pytest.approx(expected_kpa)
        assert shown.force_n == pytest.approx(
            force(8.0, 8.0 + shown.rise_kpa, switch="blend", extrapolate=True).force_n
        )
        assert ContactCurve(5.0, model, correction).largest_rise_kpa < 5.0


@pytest.mark.parametrize("method", ["energetic", "membrane"])
def test_the_instrument_shows_no_force_of_a_flat_rubber_balloon(method):
    """Without the rule, the method energetic shows 3.2 N, with a force alarm limit of 5 N and no alarm."""
    scenario = Scenario(
        doc="flat",
        plant={"kind": "membrane"},
        phase=[
            {
                "setpoint_kpa": [8.0],
                "contact": [{"kind": "press", "force_n": 9.0, "rise_s": 1.0, "hold_s": 1.0}],
            }
        ],
    )
    settings = ChainSettings.of(replace(LIVE_LAW, method=method))
    shown = [
        (m, truth)
        for m, truth in measure_playback(Playback(scenario), settings)
        if Quality.NOT_HOLDING not in m.quality and truth.force_n > 6
    ]
    assert len(shown) > 400
    for m, _ in shown:
        assert math.isnan(m.force_n)
        assert Quality.FLAT in m.quality


def test_the_function_refuses_a_balloon_that_may_be_flat_unless_it_shall_extrapolate():
    with pytest.raises(InvalidForce, match=r"above 4\.63 kPa, so the balloon may be pressed flat"):
        force(8.0, 13.0)
    assert np.isnan(force(8.0, np.array([12.0, 13.0])).force_n).tolist() == [False, True]
    assert force(8.0, 13.0, extrapolate=True).force_n > force(8.0, 12.6).force_n
