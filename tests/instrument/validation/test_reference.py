"""A reference force beside recorded pressures."""

import math

import numpy as np
import pytest

from instrument.errors import ConfigurationError
from instrument.validation import recording
from instrument.validation.reference import Pressure, beside, force_at, read

STEP_S = 0.002


def reference(path, rows):
    path.write_text("t_s,force_n\n" + "".join(f"{t_s},{force_n}\n" for t_s, force_n in rows))
    return read(path)


def held(seconds, begin_s=0.0, locked=True):
    return [Pressure(begin_s + n * STEP_S, 8.0, locked) for n in range(round(seconds / STEP_S))]


def rows_of(samples, known):
    return [line.strip().split(",") for line in list(beside(samples, known))[1:]]


def test_between_two_points_the_force_is_on_their_line(tmp_path):
    known = reference(tmp_path / "r.csv", [(1.0, 0.0), (1.1, 2.0), (1.2, 1.0)])
    assert force_at(np.array([1.0, 1.05, 1.15, 1.2]), known) == pytest.approx([0.0, 1.0, 1.5, 1.0])


def test_outside_and_in_a_gap_there_is_no_force(tmp_path):
    known = reference(tmp_path / "r.csv", [(1.0, 0.0), (1.05, 1.0), (3.0, 1.0), (3.05, 1.0)])
    force_n = force_at(np.array([0.99, 1.02, 2.0, 3.02, 3.06]), known)
    assert np.isfinite(force_n).tolist() == [False, True, False, True, False]


def test_only_samples_that_the_reference_covers_become_rows(tmp_path):
    known = reference(tmp_path / "r.csv", [(0.1 * n, 1.5) for n in range(10, 21)])
    times = [float(row[0]) for row in rows_of(held(5.0), known)]
    assert (times[0], times[-1]) == (1.0, 2.0)


def test_each_lock_is_a_phase_and_none_is_without(tmp_path):
    known = reference(tmp_path / "r.csv", [(0.05 * n, 1.5) for n in range(100)])
    samples = held(1.0, 0.0) + held(0.5, 1.0, locked=False) + held(1.0, 1.5)
    assert {row[3] for row in rows_of(samples[:500], known)} == {"1"}
    assert {row[3] for row in rows_of(samples[:700], known)} == {"1", ""}
    (tmp_path / "out.csv").write_text("".join(beside(samples, known)))
    assert [len(trial.t_s) for trial in recording.read(tmp_path / "out.csv")] == [500, 500]


def test_a_sample_without_pressure_or_whose_time_does_not_rise_is_left_out(tmp_path):
    known = reference(tmp_path / "r.csv", [(0.0, 1.0), (0.1, 1.0)])
    samples = [Pressure(0.01, 8.0, True), Pressure(0.02, math.nan, True), Pressure(0.005, 8.0, True)]
    assert [row[0] for row in rows_of(samples, known)] == ["0.010000"]


def test_a_reference_of_another_time_is_refused(tmp_path):
    known = reference(tmp_path / "r.csv", [(1.8e9, 1.0), (1.8e9 + 0.1, 1.0)])
    with pytest.raises(ConfigurationError, match="covers no sample"):
        rows_of(held(1.0), known)


@pytest.mark.parametrize(
    ("rows", "why"),
    [([(0.0, 1.0)], "at least 2"), ([(0.0, 1.0), (0.1, 1.0), (0.1, 2.0)], "line 4: t_s: time must rise")],
)
def test_a_reference_that_is_none_is_refused_with_its_line(tmp_path, rows, why):
    with pytest.raises(ConfigurationError, match=why):
        reference(tmp_path / "r.csv", rows)
