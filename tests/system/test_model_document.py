"""The numbers of docs/model.md that are constants of the program are those of the program."""

from pathlib import Path

import pytest

from instrument.chain import ChainSettings
from instrument.contact import LEAK_KPA_PER_S, ONSET_KPA, RELEASED, TRACKING_KPA_PER_S, WARMING_S
from instrument.lag import GLITCH_KPA, MOST_STEPS, SAMPLE_S, LagCompensator
from instrument.model import Balloon
from instrument.model.balloon import LOWEST_RISE_KPA, VALID_HIGH_KPA, VALID_LOW_KPA
from instrument.model.law import BLEND_KPA
from instrument.model.uncertainty import InputErrors, ModelErrors

DOCUMENT = (Path(__file__).parents[2] / "docs/model.md").read_text(encoding="utf-8")
OWN, ERRORS = ChainSettings(), InputErrors()
BALLOON, LAW = Balloon(), ModelErrors()
SQUARE, LINEAR = (
    1e3 * number for number in (BALLOON.radius_quadratic_mm_per_kpa2, BALLOON.radius_linear_mm_per_kpa)
)
PASCAL = 1e-3


@pytest.mark.parametrize(
    "told",
    [
        f"({SQUARE:.4f} ΔP_i² + {LINEAR:.3f} ΔP_i)·10⁻³",
        f"E_str is (4) above ΔP_i = {BALLOON.switch_kpa:g} kPa",
        f"Below a rise of {LOWEST_RISE_KPA:g} kPa force and indentation",
        f"±{BLEND_KPA:g} kPa of it",
        f"Outside {BALLOON.switch_kpa - BLEND_KPA:.2f}–{BALLOON.switch_kpa + BLEND_KPA:.2f} kPa",
        f"ΔP_i of {VALID_LOW_KPA} to {VALID_HIGH_KPA} kPa",
        f"| noise of ΔP_i | {ERRORS.initial_noise_kpa / PASCAL:.0f} Pa |",
        f"| noise of ΔP_f | {ERRORS.final_noise_kpa / PASCAL:.0f} Pa",
        f"and {100 * OWN.lag_share:.0f} % of the tube's lag times the rate",
        f"| sensor after its zero | {100 * ERRORS.gain:.2f} % of each pressure",
        f"(measured drift + {ERRORS.drift_kpa_per_s / PASCAL:g} Pa/s)",
        f"| R_i | {ERRORS.radius_mm:g} mm |",
        f"| {ERRORS.young_kpa:g} kPa, {ERRORS.rest_thickness_mm:g} mm, {ERRORS.poisson:g} |",
        f"| V_c, P_0 | {ERRORS.volume_mm3:g} mm³, {ERRORS.ambient_kpa:g} kPa |",
        f"1.0 to 1.2, {ERRORS.polytropic:.3f}",
        f"| the law | {100 * LAW.share_below:.1f} % of the force up to {BALLOON.switch_kpa:g} kPa, "
        f"{100 * LAW.share_above:.1f} % above",
        *(
            f"{100 * errors.share_below:.3g} % and {100 * errors.share_above:.3g} % ({method.capitalize()})"
            for method, errors in ((m, ModelErrors.of(m)) for m in ("lulevich", "shanahan"))
        ),
        f"a rise of {ONSET_KPA:g} kPa",
        f"lags by about {1e3 * OWN.tube_s:.0f} ms",
        f"passes a {1e3 * OWN.filter_s:.0f} ms filter",
        f"at most at **{TRACKING_KPA_PER_S:g} kPa/s**",
        f"a press slower than {TRACKING_KPA_PER_S:g} kPa/s",
        f"goes on (at most {LEAK_KPA_PER_S:g} kPa/s)",
        f"fading within {WARMING_S:g} s and never more than {100 * RELEASED:.0f} %",
        f"Lost samples are bridged up to {1e3 * MOST_STEPS * SAMPLE_S:.0f} ms",
        f"A reading that is {GLITCH_KPA:g} kPa from where it must be",
    ],
)
def test_the_document_says_what_the_program_does(told):
    assert told in DOCUMENT


def test_the_noise_of_the_live_pressure_is_that_of_its_filter():
    assert LagCompensator(OWN.tube_s).noise_kpa == pytest.approx(ERRORS.final_noise_kpa, abs=5e-4)
