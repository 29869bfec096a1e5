"""The uncertainty of a force against difference quotients and against drawn errors."""

import math
import random
import statistics

import pytest

from instrument.model import METHODS, Balloon, Circuit, contact, estimate
from instrument.model.uncertainty import InputErrors, LowEnd, sensitivities

BALLOON, CIRCUIT, ERRORS = Balloon(), Circuit(), InputErrors()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("initial_kpa", "final_kpa"), [(5.0, 6.0), (8.0, 9.5), (11.0, 13.0)])
def test_the_derivatives_are_those_of_the_solved_force(method, initial_kpa, final_kpa):
    h = 1e-4

    def force(p, q):
        return contact(p, q, BALLOON, CIRCUIT, method).force_n

    d = contact(initial_kpa, final_kpa, BALLOON, CIRCUIT, method).indentation_mm
    exact = sensitivities(initial_kpa, final_kpa, d, BALLOON, CIRCUIT, method)
    by_initial = (force(initial_kpa + h, final_kpa) - force(initial_kpa - h, final_kpa)) / (2 * h)
    by_final = (force(initial_kpa, final_kpa + h) - force(initial_kpa, final_kpa - h)) / (2 * h)
    assert exact.initial_n_per_kpa == pytest.approx(by_initial, rel=1e-4, abs=1e-6)
    assert exact.final_n_per_kpa == pytest.approx(by_final, rel=1e-4)


def std_of(initial_kpa, final_kpa):
    by_input = LowEnd.of(initial_kpa, BALLOON, CIRCUIT).at(final_kpa - initial_kpa)
    return by_input.std_n(initial_kpa, final_kpa, ERRORS)


def test_drawn_input_errors_spread_the_force_as_stated():
    draw = random.Random(1)
    initial, final = 8.0, 9.5
    forces = []
    for _ in range(2000):
        gain = 1 + draw.gauss(0, ERRORS.gain)
        p = initial * gain + draw.gauss(0, ERRORS.noise_kpa)
        q = final * gain + draw.gauss(0, ERRORS.noise_kpa)
        forces.append(contact(p, q, BALLOON, CIRCUIT).force_n)
    mean = sum(forces) / len(forces)
    spread = math.sqrt(sum((f - mean) ** 2 for f in forces) / len(forces))
    without_radius = InputErrors(radius_mm=0.0)
    d = contact(initial, final, BALLOON, CIRCUIT).indentation_mm
    stated = sensitivities(initial, final, d, BALLOON, CIRCUIT).std_n(initial, final, without_radius)
    assert spread == pytest.approx(stated, rel=0.1)


def test_on_the_line_too_the_stated_uncertainty_is_the_drawn_one():
    draw = random.Random(2)
    forces = []
    for _ in range(2000):
        p = 8.0 + draw.gauss(0, ERRORS.noise_kpa)
        q = 8.2 + draw.gauss(0, ERRORS.noise_kpa)
        r = draw.gauss(0, ERRORS.radius_mm)
        gain = 1 + draw.gauss(0, ERRORS.gain)
        balloon = Balloon(rest_radius_mm=BALLOON.rest_radius_mm + r)
        forces.append(estimate(p * gain, q * gain, balloon, CIRCUIT).force_n)
    assert statistics.stdev(forces) == pytest.approx(std_of(8.0, 8.2), rel=0.12)


def test_an_uncertainty_is_never_zero():
    assert std_of(8.0, 8.001) > 1e-3
