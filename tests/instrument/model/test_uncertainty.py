"""The uncertainty of a force: exact derivatives, a budget that adds up, and truths drawn from it."""

import math
import random
from dataclasses import replace

import pytest

from instrument.lag import LagCompensator
from instrument.model import LIVE, METHODS, PAPER, Balloon, Circuit, Correction, Law, contact, estimate
from instrument.model.budget import budget, total_n
from instrument.model.curve import ContactCurve
from instrument.model.derivatives import Derivatives, Inputs
from instrument.model.uncertainty import (
    OF_BALLOON,
    OF_CIRCUIT,
    InputErrors,
    ModelErrors,
    Pressures,
    Spread,
    contributions_n,
    std_n,
)
from sim.plant import Gas, amount_kpa_mm3
from sim.published import PublishedPlant

BALLOON, CIRCUIT, ERRORS, MODEL = Balloon(), Circuit(), InputErrors(), ModelErrors()
NO_MODEL = ModelErrors(share_below=0.0, share_above=0.0, join=False)
each_method = pytest.mark.parametrize("method", METHODS)
each_contact = pytest.mark.parametrize(
    ("initial_kpa", "final_kpa"), [(5.0, 6.0), (8.0, 9.5), (11.0, 13.0), (8.9, 9.6)]
)


@pytest.mark.parametrize(
    ("method", "initial_kpa", "mean_percent"),
    [
        ("energetic", 9.0, 6.77),
        ("lulevich", 9.0, 14.15),
        ("shanahan", 9.0, 14.12),
        ("lulevich", 8.0, 43.88),
        ("shanahan", 8.0, 52.27),
    ],
)
def test_a_method_states_the_error_that_the_paper_measured_of_it(method, initial_kpa, mean_percent):
    [share] = [
        line.std
        for line in budget(initial_kpa, initial_kpa + 1.5, BALLOON, CIRCUIT, Law(method=method))
        if line.what == "the law itself"
    ]
    assert share == pytest.approx(mean_percent * math.sqrt(math.pi / 2))


def quotient(solve, h):
    """Difference quotient of force and indentation."""
    up, down = solve(h), solve(-h)
    return (up.force_n - down.force_n) / (2 * h), (up.indentation_mm - down.indentation_mm) / (2 * h)


@each_method
@each_contact
@pytest.mark.parametrize("switch", ["paper", "blend"])
def test_the_derivatives_are_those_of_the_solved_contact(method, initial_kpa, final_kpa, switch):
    law, p, q = Law(method=method, switch=switch), initial_kpa, final_kpa
    d = contact(p, q, BALLOON, CIRCUIT, law).indentation_mm
    exact = Derivatives(d, Inputs(p, q, BALLOON, CIRCUIT), law)
    pairs = [
        (exact.by(initial_kpa=1.0), quotient(lambda h: contact(p + h, q, BALLOON, CIRCUIT, law), 1e-4)),
        (exact.by(final_kpa=1.0), quotient(lambda h: contact(p, q + h, BALLOON, CIRCUIT, law), 1e-4)),
    ]
    for name in OF_BALLOON:
        step = 1e-5 * getattr(BALLOON, name)

        def moved(h, name=name):
            balloon = replace(BALLOON, **{name: getattr(BALLOON, name) + h})
            return contact(p, q, balloon, CIRCUIT, law)

        pairs.append((exact.by_balloon(name), quotient(moved, step)))
    for name in OF_CIRCUIT:
        step = 1e-5 * getattr(CIRCUIT, name)

        def moved(h, name=name):
            circuit = replace(CIRCUIT, **{name: getattr(CIRCUIT, name) + h})
            return contact(p, q, BALLOON, circuit, law)

        pairs.append((exact.by_circuit(name), quotient(moved, step)))
    for slope, by_difference in pairs:
        assert slope == pytest.approx(by_difference, rel=1e-4, abs=1e-7)


def test_the_radius_counts_in_the_sphere_and_in_the_thickness():
    d = contact(8.0, 9.5, BALLOON, CIRCUIT).indentation_mm
    exact = Derivatives(d, Inputs(8.0, 9.5, BALLOON, CIRCUIT), PAPER).by(radius_error_mm=1.0)

    def moved(h):
        """R_i moved alone: R_0, which the thickness keeps to, must not move."""
        thickness = BALLOON.rest_thickness_mm * (BALLOON.rest_radius_mm / (BALLOON.rest_radius_mm + h)) ** 2
        balloon = replace(BALLOON, rest_radius_mm=BALLOON.rest_radius_mm + h, rest_thickness_mm=thickness)
        return contact(8.0, 9.5, balloon, CIRCUIT)

    assert exact == pytest.approx(quotient(moved, 1e-4), rel=1e-4)


@pytest.mark.parametrize("law", [PAPER, Law(switch="blend", low="smooth"), Law(method="shanahan")])
@pytest.mark.parametrize("initial_kpa", [4.95, 8.0, 8.86, 11.45])
def test_the_remembered_curve_is_the_law_within_a_hundredth_of_a_millinewton(law, initial_kpa):
    curve = ContactCurve(initial_kpa, BALLOON, CIRCUIT, law)
    for n in range(1, 300):
        rise = 0.05 * n
        exact = estimate(initial_kpa, initial_kpa + rise, BALLOON, CIRCUIT, law)
        assert curve.at(rise).estimate == pytest.approx(exact, abs=2e-5), rise


@pytest.mark.parametrize("rise_kpa", [-1.0, 0.0])
def test_without_a_rise_there_is_no_force(rise_kpa):
    for low in ("line", "smooth"):
        solved = ContactCurve(8.0, BALLOON, CIRCUIT, Law(low=low)).at(rise_kpa).estimate
        assert (solved.force_n, solved.indentation_mm, solved.contact_radius_mm) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("rise_kpa", [math.nan, math.inf, 1e9])
@pytest.mark.parametrize("initial_kpa", [8.0, 0.0, -3.0, 1e-9])
def test_a_curve_of_nonsense_is_not_a_number_and_never_an_exception(initial_kpa, rise_kpa):
    assert not math.isfinite(ContactCurve(initial_kpa, BALLOON, CIRCUIT).at(rise_kpa).estimate.force_n)


CORRECTION = Correction(
    constant=-0.3, by_rise=0.1, by_initial=-0.05, by_both=0.02,
    rise_span_kpa=(0.2, 4.0), initial_span_kpa=(5.0, 11.0),
)  # fmt: skip
STEPPED = replace(CORRECTION, by_step=0.25, law=LIVE)


def spread_of(initial_kpa, rise_kpa, law=PAPER, correction=None):
    point = ContactCurve(initial_kpa, BALLOON, CIRCUIT, law, correction).at(rise_kpa)
    return point.estimate.force_n, point.spread


@pytest.mark.parametrize("correction", [None, CORRECTION, STEPPED])
@pytest.mark.parametrize("low", ["line", "smooth"])
@pytest.mark.parametrize(
    ("initial_kpa", "rise_kpa"), [(8.0, 0.1), (8.7, 0.9), (6.0, 0.4), (8.0, 1.3), (10.5, 3.0)]
)
def test_the_spread_by_pressure_is_how_the_curves_differ(initial_kpa, rise_kpa, low, correction):
    law, h = Law(low=low), 1e-4

    def force(p, q):
        return spread_of(p, q - p, law, correction)[0]

    p, q = initial_kpa, initial_kpa + rise_kpa
    spread = spread_of(p, rise_kpa, law, correction)[1]
    by_final = (force(p, q + h) - force(p, q - h)) / (2 * h)
    by_initial = (force(p + h, q) - force(p - h, q)) / (2 * h)
    assert spread.final_n_per_kpa == pytest.approx(by_final, rel=0.03)
    assert spread.initial_n_per_kpa == pytest.approx(by_initial, rel=0.1)


@pytest.mark.parametrize(("initial_kpa", "final_kpa"), [(8.0, 8.2), (5.0, 6.0), (8.0, 9.5), (11.0, 13.0)])
def test_the_budget_adds_up_to_the_uncertainty_that_the_chain_states(initial_kpa, final_kpa):
    force_n, spread = spread_of(initial_kpa, final_kpa - initial_kpa)
    known = ERRORS.at_rest(initial_kpa, final_kpa, 5.0)
    stated = std_n(force_n, spread, known, ERRORS, MODEL, BALLOON)
    assert total_n(budget(initial_kpa, final_kpa, BALLOON, CIRCUIT)) == pytest.approx(stated)


def test_each_part_of_an_uncertainty_counts_as_it_must():
    """By hand: 2 N/kPa × 3 Pa, 4 × 5 Pa, gain (−2·8 + 4·9) × 0.58 %, and so on."""
    spread, known = Spread(-2.0, 4.0, 0.07, 0.3), Pressures(8.0, 9.0, 0.003, 0.005)
    model = ModelErrors(share_below=0.1, share_above=0.2, floor_n=0.05)
    by_initial, by_final, by_gain, parameters, law, join = contributions_n(
        3.0, spread, known, ERRORS, model, BALLOON
    )
    assert abs(by_initial) == pytest.approx(0.006)
    assert by_final == pytest.approx(0.020)
    assert by_gain == pytest.approx(20 * 0.01 / math.sqrt(3))
    assert parameters == 0.07
    assert law == pytest.approx(math.hypot(0.3, 0.05))
    assert join == pytest.approx(0.3 / math.sqrt(3))
    above = contributions_n(3.0, spread, Pressures(9.0, 10.0, 0.0, 0.0), ERRORS, model, BALLOON)
    assert above[4] == pytest.approx(math.hypot(0.6, 0.05))


def test_the_laws_own_error_is_what_the_paper_printed():
    """9.14 % over 27 pressures, 6.77 % over the 11 above 8.85 kPa; a normal error is √(π/2) times that."""
    below = (27 * 9.14 - 11 * 6.77) / 16
    assert MODEL.share(8.0, BALLOON) == pytest.approx(below / 100 * math.sqrt(math.pi / 2), rel=1e-3)
    assert MODEL.share(9.0, BALLOON) == pytest.approx(0.0677 * math.sqrt(math.pi / 2))


def test_the_noise_of_the_budget_is_what_the_lag_filter_lets_through():
    assert ERRORS.final_noise_kpa == pytest.approx(LagCompensator(0.06).noise_kpa, rel=0.01)


def test_a_calibrated_curve_scales_what_the_force_is_made_of():
    plain, taught = (ContactCurve(8.0, BALLOON, CIRCUIT, PAPER, c).at(0.3) for c in (None, CORRECTION))
    factor = CORRECTION.factor(0.3, 8.0)
    assert taught.estimate.force_n == pytest.approx(factor * plain.estimate.force_n)
    assert taught.estimate.contact_radius_mm**2 == pytest.approx(factor * plain.estimate.contact_radius_mm**2)
    assert taught.spread.parameters_n == pytest.approx(factor * plain.spread.parameters_n)
    assert taught.spread.join_n == pytest.approx(factor * plain.spread.join_n)


class Drawn:
    """A published plant whose parameters, and a sensor whose gain, are drawn from the budget."""

    def __init__(self, draw):
        self.draw = draw
        self.gain = 1 + draw.gauss(0, ERRORS.gain)
        radius = draw.gauss(0, ERRORS.radius_mm)
        moved = {name: getattr(BALLOON, name) + draw.gauss(0, getattr(ERRORS, name)) for name in OF_BALLOON}
        thinner = (BALLOON.rest_radius_mm / (BALLOON.rest_radius_mm + radius)) ** 2
        moved["rest_thickness_mm"] *= thinner  # so that only R_i moves
        balloon = replace(BALLOON, rest_radius_mm=BALLOON.rest_radius_mm + radius, **moved)
        self.circuit = Circuit(
            volume_mm3=CIRCUIT.volume_mm3 + draw.gauss(0, ERRORS.volume_mm3),
            ambient_kpa=CIRCUIT.ambient_kpa + draw.gauss(0, ERRORS.ambient_kpa),
            polytropic=1.0 + draw.gauss(0, ERRORS.polytropic),
        )
        self.plant = PublishedPlant(balloon, self.circuit)

    def measured(self, pressure_kpa, noise_kpa):
        return pressure_kpa * self.gain + self.draw.gauss(0, noise_kpa)

    def contact(self, model):
        """A force, and the two pressures that the sensor shows; the law itself errs as `model` says."""
        initial = self.draw.uniform(4.95, 11.45)
        circuit = self.circuit
        gas = Gas(
            amount_kpa_mm3(self.plant, initial, circuit.volume_mm3, circuit.ambient_kpa),
            circuit.volume_mm3,
            circuit.ambient_kpa,
        )
        rise, obeyed_n = 0.0, 0.0
        while not 0.5 <= rise <= 6.0:
            obeyed_n = self.draw.uniform(0.4, 5.0)
            rise = self.plant.settle(gas, obeyed_n).pressure_kpa - initial
        truth_n = obeyed_n / (1 + self.draw.gauss(0, model.share(initial, BALLOON)))
        initial_kpa = self.measured(initial, ERRORS.initial_noise_kpa)
        return truth_n, initial_kpa, self.measured(initial + rise, ERRORS.final_noise_kpa)


@pytest.mark.parametrize("model", [MODEL, NO_MODEL], ids=["with the law's own error", "inputs alone"])
def test_truths_drawn_from_the_budget_lie_within_two_u_in_95_of_100(model):
    """On the published plant, rises of 0.5 to 6 kPa: 93 to 97 %."""
    draw, held, count = random.Random(7), 0, 0
    for _ in range(60):
        rig = Drawn(draw)
        for _ in range(25):
            truth_n, initial_kpa, final_kpa = rig.contact(model)
            force_n, spread = spread_of(initial_kpa, final_kpa - initial_kpa)
            known = ERRORS.at_rest(initial_kpa, final_kpa, 0.0)
            u = std_n(force_n, spread, known, ERRORS, model, BALLOON)
            held += abs(force_n - truth_n) <= 2 * u
            count += 1
    assert 0.93 <= held / count <= 0.97, held / count
