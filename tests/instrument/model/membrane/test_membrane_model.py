"""Tests of the method membrane: its table, and the force model that looks up the table."""

import math
from dataclasses import replace

import numpy as np
import pytest

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import Balloon, ForceLaw
from pneuforce.instrument.model.curve import ContactCurve
from pneuforce.instrument.model.membrane.press import PressConditions, press
from pneuforce.instrument.model.rubber import RubberSkin, skin_of
from pneuforce.instrument.model.uncertainty import InputUncertainties

SETTINGS = ChainSettings.of(ForceLaw(method="membrane"))


@pytest.fixture(scope="module")
def model():
    """Return the force model of the paper's balloon with an unknown grip."""
    return SETTINGS.force_model


def with_grip(model, grip):
    return replace(model, law=replace(model.law, grip=grip))


def pressed(baseline_kpa, sticks, tubes_mm3=12_680.0, ambient_kpa=101.325, polytropic=1.0):
    """Return rise and force of one press, computed without the table."""
    skin, one = skin_of(Balloon()), np.ones(1)
    path = press(
        PressConditions(
            RubberSkin(skin.rest_radius_mm * one, skin.c1_kpa_mm * one, skin.c2_kpa_mm * one),
            baseline_kpa * one, np.array([sticks]), np.ones(1, int),
            tubes_mm3 * one, ambient_kpa * one, polytropic * one,
        )
    )  # fmt: skip
    return path.final_kpa[:, 0] - baseline_kpa, path.force_n[:, 0]


def direct_n(baseline_kpa, rise_kpa, sticks=False, **circuit):
    """Return the force at a rise, interpolated in √rise between the states of a press."""
    rises, forces = pressed(baseline_kpa, sticks, **circuit)
    return np.interp(np.sqrt(rise_kpa), np.sqrt(np.maximum(rises, 0)), forces)


@pytest.mark.parametrize(("baseline_kpa", "sticks"), [(4.95, False), (8.2, True), (11.45, False)])
def test_the_table_agrees_with_a_press(model, baseline_kpa, sticks):
    rises, forces = pressed(baseline_kpa, sticks)
    chosen = (forces > 0.1) & (forces < 2.8)
    found = with_grip(model, float(sticks)).estimate(
        np.full(chosen.sum(), baseline_kpa), baseline_kpa + rises[chosen]
    )
    assert found.force_n == pytest.approx(forces[chosen], abs=1e-3)


@pytest.mark.parametrize("baseline_kpa", [5.25, 8.25])
def test_the_table_agrees_with_a_press_up_to_its_end(model, baseline_kpa):
    rises, forces = pressed(baseline_kpa, sticks=True)
    ends = model.largest_contact(baseline_kpa).rise_kpa
    assert np.sqrt(rises.max()) - np.sqrt(ends) < 0.1
    last = np.flatnonzero((rises <= ends) & (forces < forces[rises.argmax()]))[-5:]
    found = with_grip(model, 1.0).estimate(baseline_kpa, baseline_kpa + rises[last])
    assert found.force_n == pytest.approx(forces[last], rel=1e-3)


def test_the_grip_interpolates_between_both_contacts(model):
    slide, middle, stick = (with_grip(model, g).estimate(8.0, 9.0).force_n for g in (0.0, 0.5, 1.0))
    assert middle == pytest.approx((slide + stick) / 2)
    assert 1.1 < stick / slide < 1.25


def test_floats_and_arrays_give_the_same_contacts(model):
    finals = np.array([[8.05, 8.5], [9.0, 11.0]])
    together = model.estimate(8.0, finals)
    for index in np.ndindex(finals.shape):
        single = model.estimate(8.0, float(finals[index]))
        assert isinstance(single.force_n, float)
        assert [values[index] for values in together] == pytest.approx(list(single))


@pytest.mark.parametrize(
    ("baseline_kpa", "final_kpa"), [(math.nan, 9.0), (8.0, math.nan), (0.5, 1.0), (14.0, 15.0), (8.0, 60.0)]
)
def test_outside_the_table_there_is_no_force(model, baseline_kpa, final_kpa):
    assert math.isnan(model.estimate(baseline_kpa, final_kpa).force_n)
    assert math.isnan(model.solve(baseline_kpa, final_kpa - baseline_kpa).estimate.force_n)


@pytest.mark.parametrize("final_kpa", [8.0, 7.0])
def test_without_a_rise_the_force_is_zero(model, final_kpa):
    contact = model.estimate(8.0, final_kpa)
    assert (contact.force_n, contact.indentation_mm, contact.contact_radius_mm) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("rise_kpa", [0.05, 0.3, 1.0, 2.5])
def test_the_derivatives_are_those_of_the_force(model, rise_kpa):
    h, baseline = 1e-4, 8.1
    solved = model.solve(baseline, rise_kpa)
    final = baseline + rise_kpa
    by_final = (model.estimate(baseline, final + h).force_n - model.estimate(baseline, final - h).force_n) / (
        2 * h
    )
    by_baseline = (
        model.estimate(baseline + h, final).force_n - model.estimate(baseline - h, final).force_n
    ) / (2 * h)
    assert solved.by_final.force_n == pytest.approx(by_final, rel=1e-3)
    assert solved.by_baseline.force_n == pytest.approx(by_baseline, rel=1e-3)


@pytest.mark.parametrize(
    ("name", "changed", "step"),
    [
        ("volume_mm3", {"tubes_mm3": 12_880.0}, 200.0),
        ("ambient_kpa", {"ambient_kpa": 99.325}, -2.0),
        ("polytropic", {"polytropic": 1.05}, 0.05),
    ],
)
def test_the_uncertainty_of_the_circuit_is_that_of_a_computation_with_another_circuit(
    model, name, changed, step
):
    stds_n = with_grip(model, 0.0).parameter_stds_n(8.0, 1.0, InputUncertainties(**{name: 1.0}))
    change_n = direct_n(8.0, 1.0, **changed) - direct_n(8.0, 1.0)
    assert stds_n[name] == pytest.approx(abs(change_n / step), rel=0.1)


def test_another_ambient_pressure_needs_no_other_table(model):
    moved = with_grip(model, 0.0).at_ambient(103.325).estimate(8.0, 9.0).force_n
    assert moved == pytest.approx(direct_n(8.0, 1.0, ambient_kpa=103.325), rel=1e-3)


def test_an_unknown_grip_is_the_largest_uncertainty_at_rest(model):
    stds_n = model.parameter_stds_n(8.0, 1.0, SETTINGS.input_uncertainties)
    del stds_n["polytropic"]  # its part is 0 at rest
    assert max(stds_n, key=stds_n.get) == "grip"
    slide, stick = (with_grip(model, g).estimate(8.0, 9.0).force_n for g in (0.0, 1.0))
    assert stds_n["grip"] == pytest.approx((stick - slide) / 12**0.5)


@pytest.mark.parametrize("baseline_kpa", [4.95, 8.0, 11.45])
def test_the_live_curve_agrees_with_the_model_and_rises(model, baseline_kpa):
    curve = ContactCurve(baseline_kpa, model)
    rises = np.geomspace(0.01, 3.0, 200)
    forces = np.array([curve.at(rise).estimate.force_n for rise in rises])
    expected = model.estimate(np.full(200, baseline_kpa), baseline_kpa + rises).force_n
    assert forces == pytest.approx(expected, abs=2.5e-3)
    assert (np.diff(forces) > 0).all()


@pytest.mark.parametrize("sides", [1, 2])
@pytest.mark.parametrize("baseline_kpa", [4.95, 7.0, 9.0, 11.45])
def test_the_live_curve_ends_at_the_highest_force_of_the_table(baseline_kpa, sides):
    model = ChainSettings.of(ForceLaw(method="membrane", sides=sides)).force_model
    largest = model.largest_contact(baseline_kpa)
    curve = ContactCurve(baseline_kpa, model)
    last = curve.at(largest.rise_kpa - 2e-3)
    assert last.estimate.force_n == pytest.approx(largest.force_n, abs=5e-3)
    assert math.isfinite(last.sensitivity.final_n_per_kpa)
    for rise_kpa in np.linspace(largest.rise_kpa + 1e-4, 1.5 * largest.rise_kpa, 50):
        assert math.isnan(model.estimate(baseline_kpa, baseline_kpa + rise_kpa).force_n)
        assert math.isnan(curve.at(rise_kpa).estimate.force_n)


@pytest.mark.parametrize("baseline_kpa", [4.95, 6.0, 8.0, 11.45])
def test_the_force_for_alarms_never_falls_while_the_pressure_rises(model, baseline_kpa):
    """The table ends where the balloon is nearly flat. The alarm must not end there."""
    curve = ContactCurve(baseline_kpa, model)
    forces = np.array([curve.force_n(rise) for rise in np.arange(0.1, 6.0, 0.05)])
    assert np.isfinite(forces).all()
    assert (np.diff(forces) >= 0).all()
    assert forces[-1] > 2.9


def test_the_largest_contact_has_the_highest_force_and_no_larger_rise_has_a_force(model):
    for baseline_kpa in (5.0, 8.0, 11.4):
        rise_kpa, force_n = model.largest_contact(baseline_kpa)
        assert model.estimate(baseline_kpa, baseline_kpa + rise_kpa).force_n == pytest.approx(force_n)
        assert 3.0 < force_n < 5.1
        larger = model.estimate(baseline_kpa, baseline_kpa + np.linspace(rise_kpa + 1e-4, 15.0, 50)).force_n
        assert np.isnan(larger).all()
    assert model.largest_contact(50.0) == (0.0, 0.0)


def test_a_damaged_table_is_not_consistent(model):
    assert model.is_consistent
    values = model.table.values.copy()
    values[0, 0, 13, 20] *= 1.2
    assert not replace(model, table=replace(model.table, values=values)).is_consistent


def test_the_force_for_alarms_is_computed_at_the_nodes_only(model):
    """Otherwise a contact without a solution takes most of the processor at 500 samples per second."""
    calls = []

    class Counting:
        def __getattr__(self, name):
            return getattr(model, name)

        def alarm_force_n(self, baseline_kpa, rise_kpa):
            calls.append(rise_kpa)
            return model.alarm_force_n(baseline_kpa, rise_kpa)

    curve = ContactCurve(5.1, Counting())
    rises_kpa = np.linspace(5.5, 12.0, 500)
    forces_n = [curve.force_n(rise_kpa) for rise_kpa in rises_kpa]
    assert len(calls) < 10
    exact_n = [model.alarm_force_n(5.1, rise_kpa) for rise_kpa in rises_kpa]
    assert forces_n == pytest.approx(exact_n, rel=0.04)
