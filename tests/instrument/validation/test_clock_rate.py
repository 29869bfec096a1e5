"""Tests of the warning about a reference whose clock runs at another rate than that of the recording."""

import re

import numpy as np
import pytest

from pneuforce.instrument.validation.clock_offset import Signal
from pneuforce.instrument.validation.clock_rate import rate_warning
from tests.instrument.validation.test_clock_offset import PAUSES_S, presses

PRESSES = 8 * PAUSES_S
BEGINS_S = np.cumsum(PRESSES) + np.arange(len(PRESSES))
RECORDED = presses(PRESSES, heights=8 * (1.0, 2.0, 1.5, 0.7, 2.5, 1.2))


def reference(factor, step=10):
    """Return the presses with the clock of a reference, whose times must be multiplied by `factor`."""
    rng = np.random.default_rng(1)
    middle_s = RECORDED.t_s[-1] / 2  # the offset of the clocks is estimated there
    t_s = middle_s + (RECORDED.t_s - middle_s) / factor
    return Signal(t_s[::step], RECORDED.value[::step] + rng.normal(0.0, 0.02, len(t_s))[::step])


@pytest.mark.parametrize("factor", [0.99, 0.997, 1.001, 1.003, 1.01])
def test_the_warning_names_the_factor_of_the_times(factor):
    warning = rate_warning(BEGINS_S, RECORDED, reference(factor))
    assert float(re.search(r"reference by (\d\.\d+)", warning)[1]) == pytest.approx(factor, abs=2e-4)
    assert ("slower" in warning, "faster" in warning) == (factor > 1, factor < 1)


@pytest.mark.parametrize("step", [1, 10])
def test_equal_rates_give_no_warning(step):
    assert rate_warning(BEGINS_S, RECORDED, reference(1.0, step)) == ""
    assert rate_warning(BEGINS_S, RECORDED, reference(1.0003, step)) == ""


def test_few_contacts_or_a_reference_without_the_contacts_give_no_warning():
    assert rate_warning(BEGINS_S[:4], RECORDED, reference(1.01)) == ""
    noise = np.random.default_rng(2).normal(size=len(RECORDED.t_s))
    assert rate_warning(BEGINS_S, RECORDED, Signal(RECORDED.t_s, noise)) == ""
    assert rate_warning(BEGINS_S, RECORDED, Signal(RECORDED.t_s, np.ones_like(noise))) == ""
