"""Tests that docs/model.md has the constants of the program and the lines of the uncertainty budget."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneuforce import force
from pneuforce.instrument.calibration.apply import LAG_HEAT_RELATIVE_STD
from pneuforce.instrument.calibration.estimation import Grip, LawChoice, estimation_settings
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.measurement.chain import REFERENCE_TOLERANCE_KPA
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.contact import (
    DRIFT_DELAY_S,
    MAX_LEAK_KPA_PER_S,
    MAX_TRACKING_KPA_PER_S,
    ONSET_KPA,
    WARMING_TIME_CONSTANT_S,
)
from pneuforce.instrument.measurement.contact_extremes import RELEASE_RATIO
from pneuforce.instrument.measurement.lag import (
    MAX_BRIDGED_SAMPLES,
    OUTLIER_KPA,
    REST_NOISE_SHARE,
    SAMPLE_S,
    LagCompensator,
)
from pneuforce.instrument.measurement.unexplained_rise import (
    FREE_TO_PRESSED_RATIO,
    LEAK_MEMORY_S,
    MAX_SLOW_KPA_PER_S,
    MAX_UNEXPLAINED_KPA,
    max_slow_kpa_per_s,
)
from pneuforce.instrument.model import Balloon, Circuit, ForceLaw
from pneuforce.instrument.model.balloon import MIN_RISE_KPA, VALID_HIGH_KPA, VALID_LOW_KPA
from pneuforce.instrument.model.curve import ContactCurve
from pneuforce.instrument.model.law import BLEND_KPA
from pneuforce.instrument.model.membrane.model import LOWER_RANGE_RISE_KPA
from pneuforce.instrument.model.uncertainty import HEAT_EXCHANGE_S, InputUncertainties
from pneuforce.instrument.model.uncertainty_budget import CONTACT_S, compute_budget
from pneuforce.instrument.validation.accuracy import estimate_forces
from pneuforce.sim.plants.plant import Gas, amount_kpa_mm3
from pneuforce.sim.plants.published import PublishedPlant

DOCUMENT = (Path(__file__).parents[2] / "docs/model.md").read_text(encoding="utf-8")
CHAIN, ERRORS = ChainSettings(), InputUncertainties()
LIMIT_KPA = Settings().contact_limit_kpa
BALLOON = Balloon()
QUADRATIC, LINEAR = (
    1e3 * number for number in (BALLOON.radius_quadratic_mm_per_kpa2, BALLOON.radius_linear_mm_per_kpa)
)
PASCAL = 1e-3


@pytest.mark.parametrize(
    "text",
    [
        f"({QUADRATIC:.4f} ΔP_i² + {LINEAR:.3f} ΔP_i)·10⁻³",
        f"equation (4) above ΔP_i = {BALLOON.switch_kpa:g} kPa",
        f"Below a rise of {MIN_RISE_KPA:g} kPa, the force and the indentation",
        f"the force at a rise of {MIN_RISE_KPA:g} kPa, and with the method `membrane` at "
        f"{LOWER_RANGE_RISE_KPA:g} kPa.",
        f"±{BLEND_KPA:g} kPa of {BALLOON.switch_kpa:g} kPa",
        f"Outside {BALLOON.switch_kpa - BLEND_KPA:.2f}–{BALLOON.switch_kpa + BLEND_KPA:.2f} kPa",
        f"ΔP_i of {VALID_LOW_KPA} to {VALID_HIGH_KPA} kPa",
        f"| noise of ΔP_i | {ERRORS.baseline_noise_kpa / PASCAL:.0f} Pa |",
        f"| noise of ΔP_f | {ERRORS.final_noise_kpa / PASCAL:.0f} Pa at rest |",
        f"adds {100 * CHAIN.lag_relative_std:.0f} % of the tube's lag × the rate",
        f"and {100 * LAG_HEAT_RELATIVE_STD:.1f} % after [`calibrate lag`]",
        f"| sensor gain after zero adjustment | {100 * ERRORS.gain:.2f} % of each pressure",
        f"(measured drift + {ERRORS.drift_kpa_per_s / PASCAL:g} Pa/s)",
        f"| radius R_i | {ERRORS.radius_mm:g} mm |",
        f"| Young's modulus E | {ERRORS.young_kpa:g} kPa |",
        f"| thickness h_0 | {ERRORS.rest_thickness_mm:g} mm |",
        f"| Poisson's ratio ν | {ERRORS.poisson:g} |",
        f"| volume of the tubes V_c | {ERRORS.volume_mm3:g} mm³ |",
        f"| ambient pressure P_0 | {ERRORS.ambient_kpa:g} kPa;",
        f"| gas exponent n, 1 at rest | {ERRORS.polytropic:.3f} × the share",
        f"(time constant {HEAT_EXCHANGE_S:g} s)",
        f"assume a contact that began {CONTACT_S:g} s ago",
        f"a rise of {ONSET_KPA:g} kPa",
        f"lags by about {1e3 * CHAIN.tube_time_constant_s:.0f} ms",
        f"passes a {1e3 * CHAIN.filter_time_constant_s:.0f} ms filter",
        f"at most **{MAX_TRACKING_KPA_PER_S:g} kPa/s**",
        f"a press slower than {MAX_TRACKING_KPA_PER_S:g} kPa/s",
        f"but at most at {MAX_LEAK_KPA_PER_S:g} kPa/s",
        f"to fade within {WARMING_TIME_CONSTANT_S:g} s",
        f"If the unexplained rise exceeds **{MAX_UNEXPLAINED_KPA:g} kPa**",
        f"forgotten with a time constant of {LEAK_MEMORY_S:g} s",
        f"multiplied by {FREE_TO_PRESSED_RATIO:g} and",
        f"below {MAX_SLOW_KPA_PER_S:g} kPa/s, which is 0.27 N/s below 1 N",
        f"is {max_slow_kpa_per_s(5.0):.2f} kPa/s at 5 kPa",
        f"and {max_slow_kpa_per_s(9.0):.1f} kPa/s above 9 kPa",
        f"at least {DRIFT_DELAY_S:g} s before the contact was",
        f"differs by more than {REFERENCE_TOLERANCE_KPA:g} kPa from",
        f"never more than {100 * RELEASE_RATIO:.0f} % of the highest rise",
        f"Gaps of up to {1e3 * MAX_BRIDGED_SAMPLES * SAMPLE_S:.0f} ms in the samples",
        f"A reading that differs by more than {OUTLIER_KPA:g} kPa from its prediction",
    ],
)
def test_the_document_has_the_constants_of_the_program(text):
    assert text in DOCUMENT


def test_the_table_has_the_lines_of_the_uncertainty_budget():
    section = DOCUMENT.partition("\n## Uncertainty\n")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| ([^|]+) \|", section, re.MULTILINE)
    budget = compute_budget(8.0, 9.2, CHAIN.force_model)
    assert rows[2:] == [line.source.removesuffix(f" in {CONTACT_S:g} s") for line in budget]


def test_the_step_of_the_force_at_the_switch_is_that_of_the_program():
    percents = []
    for rise_kpa in (0.5, 3.0, 4.0):
        below, above = (
            force(kpa, kpa + rise_kpa, switch="paper").force_n
            for kpa in (BALLOON.switch_kpa, math.nextafter(BALLOON.switch_kpa, math.inf))
        )
        percents.append(f"{100 * (1 - above / below):.0f} %")
    by_rise = "by {} at a rise of 0.5 kPa, by {} at 3 kPa, and by {} at 4 kPa".format(*percents)
    assert by_rise in " ".join(DOCUMENT.split())
    assert f"falls by {percents[0]} to {percents[2]} (rises of 0.5 to 4 kPa)" in DOCUMENT


def test_the_difference_of_blend_and_paper_is_that_of_the_program_and_within_2u():
    """The greatest difference is next to the step of `paper`. The grid would find a greater one elsewhere."""
    switch_kpa, text = BALLOON.switch_kpa, " ".join(DOCUMENT.split())
    baselines_kpa = np.append(
        np.linspace(switch_kpa - BLEND_KPA, switch_kpa + BLEND_KPA, 201), math.nextafter(switch_kpa, math.inf)
    )

    def differences(rise_kpa):
        pairs = list(zip(baselines_kpa, baselines_kpa + rise_kpa, strict=True))
        laws = (LawChoice(None, switch, None, None) for switch in ("blend", "paper"))
        (live_n, std_n), (paper_n, _) = (
            estimate_forces(pairs, estimation_settings(law, Grip(None, None), None)) for law in laws
        )
        return live_n / paper_n - 1, abs(live_n - paper_n) / std_n

    for rise_kpa, place in ((0.5, "a rise of 0.5 kPa"), (3.0, "3 kPa"), (5.0, "5 kPa")):
        relative, _ = differences(rise_kpa)
        low, high = (f"{100 * value:+.1f} %".replace("-", "−") for value in (relative.min(), relative.max()))
        assert re.search(rf"{re.escape(f'{low} to {high}')} (of the true force )?at {place}", text)
    _, in_stds = differences(LIMIT_KPA - switch_kpa)
    assert f"pressure limit of {LIMIT_KPA:g} kPa, where the difference is {in_stds.max():.1f} u" in text
    assert in_stds.max() < 2


@pytest.mark.parametrize(("sides", "title"), [(1, "1 pressed side"), (2, "2 pressed sides")])
def test_the_highest_forces_are_those_of_the_tables_of_the_method_membrane(sides, title):
    baselines_kpa = re.search(r"^\| ΔP_i \[kPa\] \| (5 .*) \|$", DOCUMENT, re.MULTILINE)[1].split(" | ")
    model = ChainSettings.of(ForceLaw(method="membrane", sides=sides)).force_model
    forces = [f"{model.largest_contact(float(kpa)).force_n:.2f}" for kpa in baselines_kpa]
    assert f"| highest force, {title} [N] | {' | '.join(forces)} |" in DOCUMENT


@pytest.mark.parametrize(("sides", "title"), [(1, "1 pressed side"), (2, "2 pressed sides")])
def test_the_largest_rises_and_their_forces_are_those_of_the_program(sides, title):
    model = ChainSettings.of(replace(CHAIN.law, sides=sides)).force_model
    largest = [model.largest_contact(baseline_kpa) for baseline_kpa in (5.0, 6.5, 8.0, 9.5, 11.0)]
    rises, forces = (" | ".join(f"{value:.2f}" for value in column) for column in zip(*largest, strict=True))
    assert f"| {title}: largest rise [kPa] | {rises} |" in DOCUMENT
    assert f"| {title}: highest force, `energetic` [N] | {forces} |" in DOCUMENT


@pytest.mark.parametrize(
    ("law", "title"),
    [
        (CHAIN.law, "`energetic`, `blend` [N]"),
        (ForceLaw(method="membrane"), "`membrane`, 1 pressed side [N]"),
    ],
)
def test_the_lower_range_limits_are_those_of_the_program(law, title):
    model = ChainSettings.of(law).force_model
    forces = [f"{ContactCurve(float(kpa), model).lower_range_limit_n:.2f}" for kpa in range(5, 12)]
    assert f"| {title} | {' | '.join(forces)} |" in DOCUMENT
    assert f"| {forces[3]} N |" in DOCUMENT


@pytest.mark.parametrize(
    ("law", "title"),
    [
        (ForceLaw(), "`energetic`"),
        (ForceLaw(method="membrane"), "`membrane`, 1 pressed side"),
        (ForceLaw(method="membrane", sides=2), "`membrane`, 2 pressed sides"),
    ],
)
def test_the_effect_of_the_ambient_pressure_is_that_of_the_program(law, title):
    """Some presses of the method membrane end below a rise of 4 kPa."""
    model, rises_kpa, cells = ChainSettings.of(law).force_model, np.linspace(0.5, 4.0, 351), []
    higher = model.at_ambient(model.circuit.ambient_kpa + 1.0)
    for baseline_kpa in (5.0, 8.0, 11.0):
        pressures = np.full(len(rises_kpa), baseline_kpa), baseline_kpa + rises_kpa
        percent = 100 * (1 - higher.estimate(*pressures).force_n / model.estimate(*pressures).force_n)
        cells.append(f"{np.nanmin(percent):.2f} to {np.nanmax(percent):.2f} %")
    assert f"| {title} | {' | '.join(cells)} |" in DOCUMENT


@pytest.mark.parametrize("sides", [1, 2])
def test_a_skin_that_sticks_needs_less_rise_as_stated(sides):
    low, high = map(int, re.search(r"needs (\d+) % to (\d+) % less rise", DOCUMENT).groups())
    law, rises = ForceLaw(method="membrane", sides=sides), np.linspace(0.01, 3.0, 1500)
    slides, sticks = (ChainSettings.of(replace(law, grip=grip)).force_model for grip in (0.0, 1.0))
    for baseline_kpa in (5.0, 8.0, 11.0):
        stuck_n = sticks.estimate(np.full(1500, baseline_kpa), baseline_kpa + rises).force_n
        for rise_kpa in (0.5, 1.0, 2.0, 3.0):
            force_n = slides.estimate(baseline_kpa, baseline_kpa + rise_kpa).force_n
            assert low - 0.5 <= 100 * (1 - np.interp(force_n, stuck_n, rises) / rise_kpa) <= high + 0.5


def test_the_noise_of_the_live_pressure_is_that_of_its_filter():
    noise_kpa = LagCompensator(CHAIN.tube_time_constant_s).noise_kpa
    assert noise_kpa * REST_NOISE_SHARE == pytest.approx(ERRORS.final_noise_kpa, abs=5e-4)
    assert f"{noise_kpa / PASCAL:.0f} Pa while" in DOCUMENT


@pytest.mark.parametrize(("baseline_kpa", "true_n"), [(5.1, 2.0), (8.0, 2.5)])
def test_the_error_of_the_method_membrane_on_the_published_balloon_is_as_stated(baseline_kpa, true_n):
    circuit = Circuit()
    plant, volumes = PublishedPlant(BALLOON, circuit), (circuit.volume_mm3, circuit.ambient_kpa)
    gas = Gas(amount_kpa_mm3(plant, baseline_kpa, *volumes), *volumes)
    shown = force(baseline_kpa, plant.settle(gas, true_n).pressure_kpa, method="membrane")
    stated = f"{shown.force_n:.2f} N ± {2 * shown.force_std_n:.2f} N"
    pattern = rf"{stated} (\(2u\) )?for {true_n} N at {baseline_kpa} kPa"
    assert re.search(pattern, " ".join(DOCUMENT.split()))
