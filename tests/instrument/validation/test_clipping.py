"""Tests of the detection of a clipped pressure in a validation recording."""

from dataclasses import replace

import numpy as np
import pytest

from pneuforce.instrument.validation.clipping import clipping_remark
from tests.instrument.validation.synthetic_trials import force_n, trial

PRESSES = ((0.5, 0.3, 0.3, 1.0), (2.0, 0.3, 0.3, 2.5))
NOISE_KPA = 0.005


def pressed(*presses, duration_s=4.0):
    return trial(*force_n(duration_s, *presses), noise_kpa=NOISE_KPA)


def clipped(trial, limit_kpa):
    return replace(trial, pressure_kpa=trial.pressure_kpa.clip(max=limit_kpa))


def test_the_remark_contains_the_number_of_the_clipped_samples_of_all_trials():
    trials = [clipped(pressed(*presses), 9.5) for presses in (PRESSES[:1], PRESSES, PRESSES)]
    count = sum(int((each.pressure_kpa == 9.5).sum()) for each in trials)
    assert count > 400
    assert f"the pressure of {count} samples is clipped at 9.5 kPa" in clipping_remark(trials)


@pytest.mark.parametrize("step_kpa", [None, 0.001, 0.01, 0.05])
def test_an_unclipped_pressure_gives_no_remark_also_with_a_coarse_resolution(step_kpa):
    whole = pressed(*PRESSES)
    pressure_kpa = whole.pressure_kpa
    if step_kpa:
        pressure_kpa = np.round(pressure_kpa / step_kpa) * step_kpa
    assert clipping_remark([replace(whole, pressure_kpa=pressure_kpa)]) == ""


def test_a_constant_pressure_without_a_force_is_not_clipped():
    idle = pressed(duration_s=1.0)
    assert clipping_remark([replace(idle, pressure_kpa=np.full_like(idle.pressure_kpa, 8.0))]) == ""
