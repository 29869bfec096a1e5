"""Tests of the zero of the reference sensor: a forgotten tare gives a warning, honest contacts give none."""

from dataclasses import replace

import pytest

from pneuforce.instrument.calibration.force import fit_force
from pneuforce.instrument.calibration.reference_zero import apparent_zero, apparent_zero_warning
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from tests.instrument.calibration.plant_contacts import plant_contacts

SETTINGS = ChainSettings()


def calibration(zero_n, name="Mooney-Rivlin, 1 side", seed=1, settings=SETTINGS):
    contacts = plant_contacts(name, settings, seed)
    return fit_force(replace(contacts, force_n=contacts.force_n + zero_n), settings)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("name", ["Mooney-Rivlin, 1 side", "neo-Hookean, 2 sides"])
def test_honest_contacts_give_no_warning(name, seed):
    assert apparent_zero_warning(calibration(0.0, name, seed)) == ""


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_forgotten_tare_gives_a_warning(seed):
    assert apparent_zero_warning(calibration(0.3, seed=seed))


def test_the_zero_grows_with_the_tare():
    honest, wrong = apparent_zero(calibration(0.0)), apparent_zero(calibration(0.4))
    assert wrong.zero_n - honest.zero_n == pytest.approx(0.4, abs=2 * honest.std_n)


def test_contacts_at_one_setpoint_determine_no_zero_that_gives_a_warning():
    contacts = plant_contacts("Mooney-Rivlin, 1 side", SETTINGS, 1, 9, (8.0, 8.1), (1.4, 1.6))
    assert apparent_zero_warning(fit_force(contacts, SETTINGS)) == ""
