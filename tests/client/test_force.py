"""Tests of `pneuforce.force`: the same force as the command line, floats and arrays, invalid arguments."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import pneuforce
from pneuforce.instrument.cli.app import app

GOLDEN = Path(__file__).parents[1] / "instrument/calibration/golden.toml"


def command_line_estimate(*arguments):
    done = CliRunner().invoke(app, ["estimate", "--json", *map(str, arguments)])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


@pytest.mark.parametrize("method", ["energetic", "lulevich", "shanahan", "membrane"])
@pytest.mark.parametrize("pressures", [(8.0, 9.2), (5.0, 5.3), (11.0, 12.5)])
def test_the_force_is_that_of_the_command_line(method, pressures):
    expected = command_line_estimate("--dpi", pressures[0], "--dpf", pressures[1], "--method", method)
    force_n, force_std_n = pneuforce.force(*pressures, method=method)
    assert isinstance(force_n, float)
    assert force_n == pytest.approx(expected["force_n"], abs=1e-5)
    assert force_std_n == pytest.approx(expected["force_std_n"], abs=1e-5)


def test_a_calibrated_force_is_that_of_the_command_line():
    expected = command_line_estimate("--dpi", 8, "--dpf", 9.2, "--calibration", GOLDEN)
    estimate = pneuforce.force(8.0, 9.2, calibration=GOLDEN)
    assert estimate.force_n == pytest.approx(expected["force_n"], abs=1e-5)
    assert estimate.force_std_n == pytest.approx(expected["force_std_n"], abs=1e-5)
    assert estimate.force_n != pneuforce.force(8.0, 9.2).force_n


def test_the_method_is_that_of_the_force_calibration_unless_it_is_stated(tmp_path):
    file, text = tmp_path / "calibration.toml", Path(GOLDEN).read_text()
    file.write_text(text.replace('method = "energetic"', 'method = "lulevich"'))
    lulevich = pneuforce.force(8.0, 9.2, method="lulevich", switch="blend", calibration=file)
    assert pneuforce.force(8.0, 9.2, calibration=file) == lulevich
    uncalibrated = pneuforce.force(8.0, 9.2, method="energetic", calibration=file)
    assert uncalibrated.force_n not in (
        lulevich.force_n,
        pneuforce.force(8.0, 9.2, calibration=GOLDEN).force_n,
    )


def test_arrays_are_broadcast_and_each_element_is_that_of_two_floats():
    dpi_kpa, dpf_kpa = np.array([[6.0], [9.0]]), np.array([9.5, 10.0, 10.5])
    force_n, force_std_n = pneuforce.force(dpi_kpa, dpf_kpa)
    assert force_n.shape == force_std_n.shape == (2, 3)
    for row, column in np.ndindex(2, 3):
        single = pneuforce.force(float(dpi_kpa[row, 0]), float(dpf_kpa[column]))
        assert (force_n[row, column], force_std_n[row, column]) == single


def test_elements_without_a_valid_force_are_nan():
    dpi_kpa = np.array([4.9, 11.5, 8.0, 8.0, math.nan, 8.0, 0.0, 8.0])
    dpf_kpa = np.array([6.0, 12.0, 8.0, 7.0, 9.0, math.nan, 1.0, 50.1])
    force_n, force_std_n = pneuforce.force(dpi_kpa, dpf_kpa)
    assert np.isnan(force_n).all()
    assert np.isnan(force_std_n).all()
    assert np.isfinite(pneuforce.force(dpi_kpa, dpf_kpa, extrapolate=True).force_n).tolist() == [
        True,
        True,
        *[False] * 6,
    ]


def test_an_empty_array_gives_an_empty_array():
    assert pneuforce.force(np.array([]), 9.0).force_n.shape == (0,)


@pytest.mark.parametrize("dpi_kpa", [4.94, 11.46, 1.0])
def test_two_floats_outside_the_range_raise_unless_extrapolated(dpi_kpa):
    with pytest.raises(pneuforce.InvalidForce):
        pneuforce.force(dpi_kpa, dpi_kpa + 1.0)
    force_n, force_std_n = pneuforce.force(dpi_kpa, dpi_kpa + 1.0, extrapolate=True)
    assert force_n > 0
    assert math.isnan(force_std_n)


def test_an_extrapolated_force_has_no_uncertainty():
    """The error of the model is unknown there: methods differ by more than the known parts of u."""
    dpi_kpa, dpf_kpa = np.array([8.0, 15.0, 8.0, 4.0]), np.array([9.2, 18.0, 25.0, 5.0])
    extrapolated = pneuforce.force(dpi_kpa, dpf_kpa, extrapolate=True)
    assert np.isfinite(extrapolated.force_n).all()
    assert np.isfinite(extrapolated.force_std_n).tolist() == [True, False, False, False]
    assert extrapolated.force_std_n[0] == pneuforce.force(8.0, 9.2).force_std_n
    for dpi, dpf, force_n in zip(dpi_kpa, dpf_kpa, extrapolated.force_n, strict=True):
        assert pneuforce.force(dpi, dpf, extrapolate=True).force_n == force_n


@pytest.mark.parametrize(
    "pressures",
    [(8.0, 8.0), (9.2, 8.0), (0.0, 1.0), (math.nan, 9.0), (8.0, math.nan), (8.0, math.inf), (8.0, 51.0)],
)
@pytest.mark.parametrize("extrapolate", [False, True])
def test_two_floats_that_cannot_belong_to_a_contact_raise_like_other_invalid_forces(pressures, extrapolate):
    with pytest.raises(pneuforce.InvalidForce):
        pneuforce.force(*pressures, extrapolate=extrapolate)


@pytest.mark.parametrize(
    ("pressures", "options"),
    [
        (("8 kPa", 9.0), {}),
        (([8.0, 8.0], [9.0, 9.0, 9.0]), {}),
        ((8.0, 9.0), {"method": "hertz"}),
        ((8.0, 9.0), {"switch": "step"}),
        ((8.0, 9.0), {"low": "curve"}),
        ((8.0, 9.0), {"grip": 1.1}),
        ((8.0, 9.0), {"grip_std": math.nan}),
        ((8.0, 9.0), {"pressed_sides": 3}),
        ((8.0, 9.0), {"grip": 0.4}),
        ((8.0, 9.0), {"grip_std": 0.1, "method": "lulevich"}),
        ((8.0, 9.0), {"pressed_sides": 1, "method": "energetic"}),
        ((8.0, 9.0), {"switch": "blend", "method": "membrane"}),
        ((8.0, 9.0), {"low": "line", "method": "membrane"}),
        ((8.0, 9.0), {"calibration": "no-such-file.toml"}),
        ((8.0, 9.0), {"calibration": 3}),
        ((8.0, 9.0), {"grip": "0.5", "method": "membrane"}),
        ((8.0, 9.0), {"contact_s": None}),
        ((8.0, 10**400), {}),
        (("8", 9.0), {}),
        ((8.0, b"9"), {}),
        ((8.0, np.timedelta64(9, "s")), {}),
        ((8.0, np.array([9.2 + 1j])), {}),
        ((8.0, np.array(["9"], dtype=object)), {}),
        (([True, 8.0], 9.0), {}),
        ((8.0, np.array([True])), {}),
        ((8.0, 9.0), {"calibration": ""}),
        ((8.0, 9.0), {"calibration": "a\0b.toml"}),
        ((8.0, 9.0), {"pressed_sides": True, "method": "membrane"}),
        ((8.0, 9.0), {"contact_s": True}),
        ((3.0, 4.0), {"extrapolate": "no"}),
    ],
    ids=lambda value: str(value)[:60],
)
def test_wrong_arguments_are_configuration_errors(pressures, options):
    with pytest.raises(pneuforce.ConfigurationError):
        pneuforce.force(*pressures, **options)


def test_a_masked_pressure_has_no_force():
    final_kpa = np.ma.masked_greater([9.2, 9.9], 9.5)
    for force_or_std in pneuforce.force(8.0, final_kpa):
        assert np.isfinite(force_or_std).tolist() == [True, False]


def test_a_contact_that_has_just_begun_is_less_certain():
    soon, later = (pneuforce.force(8.0, 9.2, method="membrane", contact_s=s) for s in (0.0, 5.0))
    assert soon.force_n == later.force_n
    assert soon.force_std_n > 1.1 * later.force_std_n


@pytest.mark.parametrize("contact_s", [-1.0, math.nan, math.inf])
def test_an_impossible_age_of_a_contact_is_rejected(contact_s):
    with pytest.raises(pneuforce.ConfigurationError, match="contact_s = "):
        pneuforce.force(8.0, 9.2, contact_s=contact_s)
