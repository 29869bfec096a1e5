"""Tests of the plausibility of a calibration: wrong values are refused, honest values are accepted."""

import itertools
import math
import re
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration import file, ranges, sections
from pneuforce.instrument.calibration.apply import apply_calibration
from pneuforce.instrument.calibration.force import fit_force
from pneuforce.instrument.calibration.plausibility import MAX_RISE_KPA, check_force, warnings_about
from pneuforce.instrument.config import load
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import ForceCorrection, ForceLaw
from pneuforce.instrument.model.plausibility import LOWER_LIMIT_RISE_KPA, MAX_RATIO
from pneuforce.support.toml_sections import format_value
from tests.instrument.calibration.plant_contacts import PLANTS, plant_contacts
from tests.instrument.calibration.points import error_message
from tests.instrument.calibration.test_calibration_file import COMPLETE, TODAY
from tests.instrument.calibration.test_golden import GOLDEN

#: A force calibration without any correction.
NEUTRAL = {"constant": 0.0, "by_rise": 0.0, "by_initial_per_kpa": 0.0, "by_both_per_kpa": 0.0, "by_step": 0.0}
GOLDEN_TEXT = GOLDEN.read_text(encoding="utf-8")
#: A complete file, whose force calibration was made without the radius and the volume of the file.
MEASURED_TEXT = file.to_toml(COMPLETE.model_copy(update={"force": None, "balloon_id": 0}))


def changed(text, section, values):
    """Return a TOML text with other values of some keys of one section."""
    head, start, rest = text.partition(f"[{section}]\n")
    assert start
    for key, value in values.items():
        rest, count = re.subn(rf"^{key} = .*$", f"{key} = {format_value(value)}", rest, count=1, flags=re.M)
        assert count == 1, key
    return head + start + rest


def loaded(tmp_path, text):
    """Load an instrument whose configuration names a calibration file with this text."""
    (tmp_path / "calibration.toml").write_text(text, encoding="utf-8")
    (tmp_path / "instrument.toml").write_text('[measurement]\ncalibration = "calibration.toml"\n')
    return load(tmp_path / "instrument.toml")


def test_a_calibration_that_shows_a_twentieth_of_the_force_is_refused(tmp_path):
    """This file showed 2.00 N as 0.1 N, with the quality of a calibrated force."""
    message = error_message(loaded, tmp_path, changed(GOLDEN_TEXT, "force", NEUTRAL | {"constant": -3.0}))
    assert str(tmp_path / "calibration.toml") in message
    assert len(re.findall(r"[\d.]+ kPa", message)) == 2
    assert len(re.findall(r"[\d.]+ to [\d.]+ N", message)) == 2
    assert len(message.splitlines()) == 1


def neutral_except(**values):
    return NEUTRAL | values


#: Units in which a reference force may have been written instead of newtons, as a factor.
UNITS = {"mN": 1e3, "cN": 100.0, "g": 102.0, "kgf": 1 / 9.80665, "lbf": 1 / 4.44822, "ozf": 3.597, "kN": 1e-3}
GOLDEN_CONSTANT = file.load(GOLDEN).force.constant
IMPLAUSIBLE_FORCES = {
    **{f"force in {unit}": {"constant": GOLDEN_CONSTANT + math.log(k)} for unit, k in UNITS.items()},
    "constant far too low": neutral_except(constant=-3.0),
    "constant far too high": neutral_except(constant=2.0),
    "constant at its limit": neutral_except(constant=20.0),
    "no force": neutral_except(constant=-20.0),
    "sign of the constant lost, twice": {"constant": 3 * -GOLDEN_CONSTANT},
    "force falls with the rise": neutral_except(by_rise=-1.5),
    "force grows with the fifth power of the rise": neutral_except(by_rise=4.0),
    "growth with the setpoint": neutral_except(by_initial_per_kpa=1.0),
    "fall with the setpoint": neutral_except(by_initial_per_kpa=-1.0),
    "swapped slopes": {"by_rise": -0.144394032, "by_initial_per_kpa": 0.938490455},
    "opposite slope at high setpoints": neutral_except(by_both_per_kpa=-1.0),
    "slope far too large at high setpoints": neutral_except(by_both_per_kpa=1.0),
    "large step": neutral_except(by_step=3.0),
    "large step down": neutral_except(by_step=-3.0),
    "all coefficients at their limits": dict.fromkeys(NEUTRAL, 20.0),
}


@pytest.mark.parametrize("name", IMPLAUSIBLE_FORCES)
def test_an_implausible_force_is_refused_with_file_pressures_and_remedy(tmp_path, name):
    message = error_message(loaded, tmp_path, changed(GOLDEN_TEXT, "force", IMPLAUSIBLE_FORCES[name]))
    assert str(tmp_path / "calibration.toml") in message
    assert len(re.findall(r"[\d.]+ kPa", message)) == 2
    assert "repeat the force calibration" in message
    assert len(message.splitlines()) == 1


IMPLAUSIBLE_VALUES = [
    ("radius", "radius in m", {"rest_radius_mm": 0.007503}),
    ("radius", "radius in cm", {"rest_radius_mm": 0.7503}),
    ("radius", "radius in µm", {"rest_radius_mm": 7503.0}),
    ("radius", "diameter", {"rest_radius_mm": 15.006}),
    ("radius", "half the radius", {"rest_radius_mm": 3.75}),
    ("radius", "zero", {"rest_radius_mm": 0.0}),
    ("radius", "negative", {"rest_radius_mm": -7.5}),
    ("radius", "nan", {"rest_radius_mm": math.nan}),
    ("radius", "infinite", {"rest_radius_mm": math.inf}),
    (
        "radius",
        "swapped slopes",
        {"radius_linear_mm_per_kpa": 0.006, "radius_quadratic_mm_per_kpa2": 0.0447},
    ),
    (
        "radius",
        "pressures in hPa",
        {"radius_linear_mm_per_kpa": 0.00447, "radius_quadratic_mm_per_kpa2": 6e-5},
    ),
    (
        "radius",
        "shrinking",
        {"radius_linear_mm_per_kpa": -0.05, "radius_quadratic_mm_per_kpa2": 0.0},
    ),
    ("radius", "value and uncertainty swapped", {"rest_radius_mm": 0.03, "rest_radius_std_mm": 7.5}),
    ("radius", "residual in µm", {"residual_mm": 9.0}),
    ("radius", "infinite residual", {"residual_mm": math.inf}),
    ("radius", "swapped span", {"low_kpa": 11.5, "high_kpa": 2.0}),
    ("radius", "no limit point", {"limit_kpa": 0.0}),
    ("radius", "date before the product", {"date": date(2019, 12, 31)}),
    ("radius", "date of an unset clock", {"date": date(1970, 1, 1)}),
    ("radius", "date in a wrong century", {"date": date(2126, 3, 1)}),
    ("volume", "volume in mL", {"volume_mm3": 12.5}),
    ("volume", "volume in m³", {"volume_mm3": 1.25e-5}),
    ("volume", "a digit too many", {"volume_mm3": 125_000.0}),
    ("volume", "zero", {"volume_mm3": 0.0}),
    ("volume", "negative", {"volume_mm3": -12_500.0}),
    ("volume", "nan", {"volume_mm3": math.nan}),
    ("volume", "value and uncertainty swapped", {"volume_mm3": 600.0, "volume_std_mm3": 12_500.0}),
    ("volume", "no uncertainty", {"volume_std_mm3": 0.0}),
    ("volume", "ambient pressure in hPa", {"ambient_kpa": 1013.25}),
    ("lag", "lag in ms", {"tube_time_constant_s": 55.0}),
    ("lag", "zero", {"tube_time_constant_s": 0.0}),
    ("lag", "negative", {"tube_time_constant_s": -0.055}),
    ("lag", "nan", {"tube_time_constant_s": math.nan}),
    ("lag", "value and uncertainty swapped", {"tube_time_constant_s": 0.001, "tube_std_s": 0.055}),
    ("lag", "no step", {"step_kpa": 0.0}),
    ("lag", "residual as large as the step", {"residual_kpa": 3.0}),
    ("force", "no residual", {"residual_share": 0.0, "residual_floor_n": 0.0}),
    ("force", "residual in percent", {"residual_share": 1.37}),
    ("force", "residual in mN", {"residual_floor_n": 54.7}),
    ("force", "negative residual", {"residual_floor_n": -0.05}),
    ("force", "rise in Pa", {"rise_low_kpa": 218.16, "rise_high_kpa": 4084.68}),
    ("force", "rise below the onset of a contact", {"rise_low_kpa": 0.01}),
    ("force", "span of ΔP_i in hPa", {"initial_low_kpa": 51.65, "initial_high_kpa": 111.7}),
    ("force", "ΔP_i outside the validated range", {"initial_high_kpa": 14.0}),
    ("force", "swapped span", {"initial_low_kpa": 11.0, "initial_high_kpa": 5.0}),
    ("force", "nan", {"constant": math.nan}),
]  # fmt: skip


@pytest.mark.parametrize(("section", "name", "values"), IMPLAUSIBLE_VALUES)
def test_an_implausible_value_is_refused_with_file_section_and_range(tmp_path, section, name, values):
    text = changed(GOLDEN_TEXT if section == "force" else MEASURED_TEXT, section, values)
    message = error_message(loaded, tmp_path, text)
    assert str(tmp_path / "calibration.toml") in message
    assert f": {section}" in message


def test_both_files_without_a_change_are_accepted(tmp_path):
    assert loaded(tmp_path, GOLDEN_TEXT).warning == ""
    assert loaded(tmp_path, MEASURED_TEXT).warning == ""


PLAUSIBLE_FORCES = {
    "no correction": NEUTRAL,
    "half the force": neutral_except(constant=math.log(0.5)),
    "twice the force": neutral_except(constant=math.log(2.0)),
    "force goes to zero with the rise": neutral_except(constant=-0.3, by_rise=0.4),
    "no step at 8.85 kPa": neutral_except(by_step=0.2),
    "a balloon that becomes softer": neutral_except(by_initial_per_kpa=-0.1, by_both_per_kpa=0.05),
}


@pytest.mark.parametrize("name", PLAUSIBLE_FORCES)
def test_a_plausible_force_is_accepted(tmp_path, name):
    configuration = loaded(tmp_path, changed(GOLDEN_TEXT, "force", PLAUSIBLE_FORCES[name]))
    assert configuration.chain.correction is not None


PLAUSIBLE_VALUES = [
    ("radius", {"rest_radius_mm": 6.0}),
    ("radius", {"rest_radius_mm": 9.0}),
    ("radius", {"radius_linear_mm_per_kpa": 0.02, "radius_quadratic_mm_per_kpa2": 0.002}),
    ("radius", {"radius_linear_mm_per_kpa": 0.06, "radius_quadratic_mm_per_kpa2": 0.012}),
    ("volume", {"volume_mm3": 5000.0, "volume_std_mm3": 150.0}),
    ("volume", {"volume_mm3": 40_000.0, "volume_std_mm3": 2000.0}),
    ("lag", {"tube_time_constant_s": 0.01}),
    ("lag", {"tube_time_constant_s": 0.3, "tube_std_s": 0.02}),
]


@pytest.mark.parametrize(("section", "values"), PLAUSIBLE_VALUES)
def test_a_plausible_value_is_accepted(tmp_path, section, values):
    assert loaded(tmp_path, changed(MEASURED_TEXT, section, values)).calibration is not None


LAWS = [
    ForceLaw(),
    *(
        ForceLaw(method=method, switch="blend", low=low)
        for method, low in itertools.product(("energetic", "lulevich", "shanahan"), ("line", "smooth"))
    ),
]
#: Setpoints, number of contacts and forces of honest force calibrations.
CAMPAIGNS = {
    "all setpoints": {},
    "12 contacts": {"count": 12},
    "low setpoints": {"setpoints_kpa": (5.05, 7.0)},
    "high setpoints": {"setpoints_kpa": (9.5, 11.35)},
    "one setpoint": {"setpoints_kpa": (8.0, 8.0), "count": 8},
    "small forces": {"forces_n": (0.1, 1.0)},
    "large forces": {"forces_n": (1.0, 3.5)},
}


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("campaign", CAMPAIGNS)
def test_honest_calibrations_of_every_simulated_balloon_are_accepted_with_margin(plant, campaign):
    """The forces may be 1.25 times larger or smaller, and the calibration is still accepted.

    Contacts that support no calibration are omitted: no correction is better than the law, or the corrected
    force would fall as the pressure rises.
    """
    accepted, reasons = 0, []
    for seed, law in enumerate(LAWS):
        settings = replace(ChainSettings(), law=law)
        contacts = plant_contacts(plant, settings, seed, **CAMPAIGNS[campaign])
        try:
            correction = fit_force(contacts, settings).correction
        except ConfigurationError as error:
            reasons.append(str(error))
            continue
        for margin in (1.25, 1 / 1.25):
            wrong = replace(correction, constant=correction.constant + math.log(margin))
            check_force(replace(settings, correction=wrong))
        accepted += 1
    assert accepted >= 1
    assert [reason for reason in reasons if "plausible" in reason] == []


@pytest.mark.parametrize("plant", ["Mooney-Rivlin, 1 side", "neo-Hookean, 2 sides"])
@pytest.mark.parametrize("unit", ["mN", "g", "kgf", "lbf", "kN"])
def test_contacts_with_the_force_in_another_unit_give_no_calibration(plant, unit):
    settings = ChainSettings()
    contacts = plant_contacts(plant, settings, 1)
    wrong = replace(contacts, force_n=contacts.force_n * UNITS[unit], std_n=contacts.std_n * UNITS[unit])
    assert error_message(fit_force, wrong, settings).startswith("no calibration: ")


def test_a_date_in_the_future_gives_a_warning_and_no_error():
    """A wrong clock of the computer must not stop the instrument: a date does not change a force."""
    assert warnings_about(COMPLETE, ChainSettings(), TODAY) == []
    assert warnings_about(COMPLETE, ChainSettings(), TODAY - timedelta(days=1)) == []
    [warning] = warnings_about(COMPLETE, ChainSettings(), TODAY - timedelta(days=2))
    assert f"{TODAY}" in warning


def test_a_calibration_with_a_later_date_is_loaded_with_a_warning(tmp_path):
    configuration = loaded(tmp_path, changed(GOLDEN_TEXT, "force", {"date": date(2098, 1, 1)}))
    assert "2098-01-01" in configuration.warning


def test_pressures_without_a_plausible_force_outside_the_measured_span_give_a_warning():
    """The forces of this calibration are plausible at 5 to 5.5 kPa, but not at 11.45 kPa."""
    settings = replace(ChainSettings(), law=ForceLaw(method="shanahan"))
    correction = ForceCorrection(
        constant=math.log(4.0), by_rise=0.0, by_initial=0.0, by_both=0.0, law=settings.law,
        rise_span_kpa=(0.5, 2.0), baseline_span_kpa=(5.0, 5.5),
    )  # fmt: skip
    calibrated = replace(settings, correction=correction)
    check_force(calibrated)
    uncovered, without_force = warnings_about(file.empty(0), calibrated, TODAY)
    assert "6.25–7.55, 7.55–8.85, 8.85–10.15, 10.15–11.45" in uncovered
    assert "shows no force" in without_force


def test_every_part_of_the_golden_file_can_be_applied():
    assert apply_calibration(ChainSettings(), file.load(GOLDEN)).correction is not None


DOCUMENT = (Path(__file__).parents[3] / "docs/calibration.md").read_text(encoding="utf-8")
PARTS = {
    "radius": sections.RadiusPart,
    "volume": sections.VolumePart,
    "lag": sections.LagPart,
    "grip": sections.GripPart,
    "force": sections.ForcePart,
}


def test_the_document_has_the_range_of_each_value_of_the_file():
    rows = re.findall(r"^\| `(\w+)` \| `(\w+)` \| ([\d.]+) to ([\d.]+) \|", DOCUMENT, flags=re.M)
    assert len(rows) >= 14
    for part, key, low, high in rows:
        schema = PARTS[part].model_json_schema()["properties"][key]
        assert (schema["minimum"], schema["maximum"]) == (float(low), float(high)), key


@pytest.mark.parametrize(
    "text",
    [
        f"| {LOWER_LIMIT_RISE_KPA:g} kPa or more | F_low / {MAX_RATIO:g} | {MAX_RATIO:g} · F_high |",
        f"rises up to {MAX_RISE_KPA:g} kPa",
        "{:g} to {:g} | 1.17 in the paper".format(*ranges.STRETCH_RANGE),
        "{:g} to {:g} mm/kPa |".format(*ranges.SLOPE_RANGE_MM_PER_KPA),
        "| `volume_std_mm3` ÷ `volume_mm3` | {:g} to {:g} |".format(*ranges.VOLUME_RELATIVE_STD_RANGE),
        "| `tube_std_s` ÷ `tube_time_constant_s` | {:g} to {:g} |".format(*ranges.LAG_RELATIVE_STD_RANGE),
        "| size of `step_kpa` | {:g} to {:g} kPa |".format(*ranges.STEP_RANGE_KPA),
        "| `residual_kpa` ÷ size of `step_kpa` | {:g} to {:g} |".format(*ranges.LAG_RESIDUAL_RANGE),
        "| standard deviation of a force of 1 N | {:g} to {:g} N |".format(*ranges.STD_AT_1_N_RANGE_N),
    ],
)
def test_the_document_has_the_limits_of_the_program(text):
    assert text in DOCUMENT
