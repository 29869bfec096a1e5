"""Tests of the warning about contacts whose pressure is clipped."""

import numpy as np

from pneuforce.instrument.calibration.clipped_contacts import clipped_contacts_warning
from pneuforce.instrument.calibration.contacts import CalibrationContacts
from tests.command_runner import pneuforce


def warning_about(final_kpa, force_n):
    baseline_kpa = np.full(len(force_n), 8.0)
    unused = np.zeros(len(force_n))
    rises_kpa = np.array(final_kpa) - baseline_kpa
    return clipped_contacts_warning(
        CalibrationContacts(baseline_kpa, rises_kpa, np.array(force_n), unused, unused, unused)
    )


def test_equal_pressures_of_different_forces_are_clipped():
    warning = warning_about([9.0, 10.0, 11.8, 11.8, 11.8], [1.0, 1.8, 2.5, 2.9, 3.4])
    assert warning.startswith("3 contacts with forces from 2.50 to 3.40 N have the same pressure of 11.8 kPa")


def test_repeated_contacts_are_not_clipped():
    assert warning_about([9.5] * 5, np.linspace(1.0, 1.05, 5)) == ""
    assert warning_about([9.0, 9.5, 9.5], [1.0, 1.4, 1.8]) == ""


def test_the_command_prints_the_warning(tmp_path):
    lines = [f"8.0,{min(8.0 + 0.9 * force_n, 10.3):.3f},{force_n}" for force_n in np.linspace(0.5, 3.4, 16)]
    file = tmp_path / "contacts.csv"
    file.write_text("\n".join(["baseline_kpa,final_kpa,force_n", *lines]) + "\n")
    done = pneuforce("calibrate", "force", file)
    assert done.returncode == 0, done.stderr
    assert "so the pressure is probably clipped" in done.stdout
