"""Tests that the equations, constants and example of docs/model.md give the forces of the program.

This module contains the equations as the document states them, and finds the root by bisection.
"""

import math
import re
from math import pi, sqrt
from pathlib import Path

import pytest

from pneuforce import force
from pneuforce.instrument.config import parse
from pneuforce.instrument.model.balloon import Balloon, Circuit
from pneuforce.instrument.model.energies import compression_energy_mj

DOCUMENT = (Path(__file__).parents[3] / "docs/model.md").read_text(encoding="utf-8")
#: Constants of the table: symbol, value and configuration key.
CONSTANTS = re.findall(r"^\| (\w+) \| [^|]+ \| ([\d.]+)[^|]* \| `(\w+\.\w+)` \|$", DOCUMENT, re.MULTILINE)
E, NU, H_0, R_0, R_1, R_2, V_C, P_0 = (float(value) for _, value, _ in CONSTANTS)
ROOT_DISTANCE_MM = 0.01


def bisect(excess, low_mm, high_mm):
    """Return the root of a function that is negative at the lower limit."""
    for _ in range(100):
        middle_mm = (low_mm + high_mm) / 2
        low_mm, high_mm = (middle_mm, high_mm) if excess(middle_mm) < 0 else (low_mm, middle_mm)
    return low_mm


def before_contact(dpi_kpa):
    radius_mm = R_0 + R_1 * dpi_kpa + R_2 * dpi_kpa**2
    return radius_mm, H_0 * R_0**2 / radius_mm**2


def energetic(dpi_kpa, dpf_kpa, weight=None):
    """Return all quantities of the example. `weight` is w of the blend."""
    r_i, h = before_contact(dpi_kpa)
    v_i = V_C + 4 / 3 * pi * r_i**3
    v_f = v_i * (P_0 + dpi_kpa) / (P_0 + dpf_kpa)
    v_b = v_f - V_C
    w = float(dpi_kpa > 8.85) if weight is None else weight

    def shape(d):
        c = r_i - d
        r_f = sqrt(v_b / (2 * pi * c) + c**2 / 3)
        return c, r_f, sqrt(r_f**2 - c**2), sqrt(2 * r_i * d)

    def energies(d):
        _, r_f, a, s = shape(d)
        sphere = (r_f - r_i) ** 2
        split = (r_f / r_i - 1) ** 2 * (r_i**2 - r_i * d) + (a / s - 1) ** 2 * r_i * d
        stretching = 4 * pi * E * h / (1 - NU) * (w * sphere + (1 - w) * split)
        return stretching, pi / 12 * E * h**2 * a**3 / r_f**2

    def excess(d, step=1e-5):
        membrane = (sum(energies(d + step)) - sum(energies(d - step))) / (2 * step) / 2
        return membrane - dpf_kpa * pi * shape(d)[2] ** 2

    d_min = r_i - (3 * v_b / (4 * pi)) ** (1 / 3)
    d = bisect(excess, d_min + ROOT_DISTANCE_MM, r_i - ROOT_DISTANCE_MM)
    c, r_f, a, s = shape(d)
    names = ("R_i", "h", "V_i", "V_f", "V_b", "d_min", "d", "c", "R_f", "a", "s", "E_str", "E_bend")
    values = (r_i, h, v_i, v_f, v_b, d_min, d, c, r_f, a, s, *energies(d))
    return {**dict(zip(names, values, strict=True)), "F": 1e-3 * dpf_kpa * pi * a**2}


def older(dpi_kpa, dpf_kpa, method):
    r_i, h = before_contact(dpi_kpa)
    load = (1 - NU) * (dpf_kpa - dpi_kpa)
    growth_mm = r_i**2 * load / (2 * E * h - r_i * load)

    def pressure_force(d):
        r_f = r_i + (d**2 / (2 * r_i) if method == "lulevich" else growth_mm)
        return dpf_kpa * pi * (r_f**2 - (r_i - d) ** 2)

    def excess(d):
        stretching = 2 * pi * E * h * d**3 / ((1 - NU) * r_i**2)
        return stretching + pi / sqrt(2) * E * h**2 * sqrt(d / r_i) - pressure_force(d)

    return 1e-3 * pressure_force(bisect(excess, 0.5, r_i))


def test_the_constants_are_the_defaults_of_their_configuration_keys():
    configuration = parse({}, "instrument.toml")
    assert len(CONSTANTS) == 8
    for symbol, value, key in CONSTANTS:
        section, name = key.split(".")
        assert getattr(getattr(configuration, section), name) == float(value), symbol


def test_the_figures_of_the_example_follow_from_the_equations():
    section = DOCUMENT.partition("**Example.**")[2].partition("**Older methods.**")[0]
    computed = energetic(8.0, 9.2)
    written = dict(re.findall(r"(\w+) = ([\d.]+) (?:mm³?|µJ)\b", section))
    written["F"] = re.search(r"= ([\d.]+) N \|", section)[1]
    assert written.keys() == computed.keys()
    for name, figure in written.items():
        assert f"{computed[name]:.{len(figure.partition('.')[2])}f}" == figure, name
    assert force(8.0, 9.2).force_n == pytest.approx(float(written["F"]), abs=5e-5)


@pytest.mark.parametrize("pressures", [(8.0, 9.2), (5.0, 8.0), (8.85, 9.4), (8.86, 9.4), (11.4, 16.0)])
def test_the_equations_give_the_force_of_the_program(pressures):
    assert energetic(*pressures)["F"] == pytest.approx(force(*pressures, extrapolate=True).force_n, rel=1e-6)


@pytest.mark.parametrize("dpi_kpa", [8.0, 8.85, 9.6])
def test_the_mixture_of_both_energies_gives_the_force_of_the_blend(dpi_kpa):
    t = (dpi_kpa - 7.85) / 2
    computed_n = energetic(dpi_kpa, dpi_kpa + 1.2, t**2 * (3 - 2 * t))["F"]
    assert computed_n == pytest.approx(force(dpi_kpa, dpi_kpa + 1.2, switch="blend").force_n, rel=1e-6)


@pytest.mark.parametrize("x", [0.05, 0.5, 0.9])
def test_the_curves_below_a_rise_of_half_a_kilopascal_are_those_of_the_program(x):
    def law_n(x):
        return energetic(8.0, 8.0 + 0.5 * x)["F"]

    force_n, step = law_n(1.0), 1e-3
    m = (law_n(1 + step) - law_n(1 - step)) / (2 * step) / force_n
    curves_n = {"line": force_n * x, "smooth": force_n * (2 * (1 - m) * sqrt(x) + (2 * m - 1) * x)}
    for low, computed_n in curves_n.items():
        assert computed_n == pytest.approx(force(8.0, 8.0 + 0.5 * x, low=low).force_n, rel=1e-4)


@pytest.mark.parametrize(("method", "name"), [("lulevich", "Lulevich"), ("shanahan", "Shanahan")])
def test_the_equations_of_the_older_methods_give_the_force_of_the_program(method, name):
    for pressures in ((8.0, 9.2), (10.0, 13.0)):
        assert older(*pressures, method) == pytest.approx(
            force(*pressures, method=method, extrapolate=True).force_n, rel=1e-6
        )
    assert f"{name} gives {older(8.0, 9.2, method):.4f} N" in DOCUMENT


def test_equation_7_is_the_compression_energy_of_the_program():
    shape = energetic(8.0, 9.2)
    v_i, v_f = shape["V_i"], shape["V_f"]
    computed_mj = 1e-3 * ((P_0 + 8.0) * v_i * math.log(v_i / v_f) - P_0 * (v_i - v_f))
    assert computed_mj == pytest.approx(compression_energy_mj(8.0, 9.2, Balloon(), Circuit()))
