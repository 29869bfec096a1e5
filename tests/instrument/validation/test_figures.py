"""Tests of the figures of a validation: they show the force by the law in effect."""

import numpy as np
import pytest

from pneuforce.instrument.calibration import file
from pneuforce.instrument.calibration.apply import apply_calibration
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import PAPER_LAW, ForceLaw
from pneuforce.instrument.validation.accuracy import estimate_forces
from pneuforce.instrument.validation.figures import draw_error_bars
from pneuforce.instrument.validation.peaks import estimate_peaks
from tests.instrument.calibration.test_golden import GOLDEN

PRESSURES_KPA = np.array([[5.5, 6.5], [7.0, 8.2], [8.0, 9.2], [9.5, 11.0], [11.0, 12.2]])
SETTINGS = {
    "paper": ChainSettings.of(PAPER_LAW),
    "calibrated": apply_calibration(ChainSettings(), file.load(GOLDEN)),
    "lulevich": ChainSettings.of(ForceLaw(method="lulevich")),
}


@pytest.mark.parametrize("name", SETTINGS)
def test_the_error_bars_are_those_of_the_law_in_effect(name):
    """The reference is 10 % more than the force by these settings, so each error is 1/11 of the reference."""
    settings = SETTINGS[name]
    force_n, _ = estimate_forces(PRESSURES_KPA, settings)
    peaks = estimate_peaks(*PRESSURES_KPA.T, 1.1 * force_n, settings)
    [axes] = draw_error_bars(peaks, settings).axes
    assert [bar.get_height() for bar in axes.patches] == pytest.approx([100 / 11] * 5)
    assert (name in axes.get_ylabel()) == (name != "paper")
