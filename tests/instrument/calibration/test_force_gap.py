"""Tests of the warning about a range of the force without contacts."""

from pathlib import Path

import numpy as np
import pytest

from pneuforce.instrument.calibration.force_gap import force_gap_warning
from tests.command_runner import pneuforce

EXAMPLE = Path(__file__).parents[3] / "docs/examples/reference-contacts.csv"


def calibrated(contacts):
    done = pneuforce("calibrate", "force", contacts)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("count", [5, 6, 24])
def test_evenly_distributed_forces_give_no_warning(count):
    assert force_gap_warning(np.linspace(3.5, 0.2, count)) == ""


def test_equal_forces_give_no_warning():
    assert force_gap_warning(np.full(6, 1.0)) == ""


def test_random_forces_rarely_give_a_warning():
    draw = np.random.default_rng(1)
    assert sum(force_gap_warning(draw.uniform(0.2, 3.5, 24)) != "" for _ in range(1000)) < 20


def test_the_warning_names_the_range_without_contacts():
    forces_n = np.array([2.1, 0.3, 3.5, 0.62, 0.4, 2.8, 0.5])
    assert "between 0.62 and 2.10 N, which is 46 % of the range" in force_gap_warning(forces_n)


def test_the_command_prints_the_warning(tmp_path):
    text = EXAMPLE.read_text()
    assert "no contact has a force" not in calibrated(EXAMPLE)
    header, *lines = [line for line in text.splitlines() if not line.startswith("#")]
    column = header.split(",").index("force_n")
    kept = [line for line in lines if not 0.5 < float(line.split(",")[column]) < 2.0]
    some = tmp_path / "contacts.csv"
    some.write_text("\n".join([header, *kept]) + "\n")
    assert "note: no contact has a force between" in calibrated(some)
