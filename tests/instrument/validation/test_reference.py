"""Tests of recorded pressures combined with the force of a reference sensor: interpolation, gaps, phases."""

import math

import numpy as np
import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.validation import recording
from pneuforce.instrument.validation.reference import (
    PressureSample,
    ReferenceColumns,
    force_at,
    read,
    recording_lines,
    spread_times,
)

STEP_S = 0.002


def reference(path, rows):
    path.write_text("t_s,force_n\n" + "".join(f"{t_s},{force_n}\n" for t_s, force_n in rows))
    return read(path)


def samples(duration_s, begin_s=0.0, locked=True):
    return [PressureSample(begin_s + n * STEP_S, 8.0, locked) for n in range(round(duration_s / STEP_S))]


def rows_of(pressures, known):
    return [line.strip().split(",") for line in list(recording_lines(pressures, known))[1:]]


def test_the_force_is_interpolated_linearly_between_two_readings(tmp_path):
    known = reference(tmp_path / "r.csv", [(1.0, 0.0), (1.1, 2.0), (1.2, 1.0)])
    assert force_at(np.array([1.0, 1.05, 1.15, 1.2]), known) == pytest.approx([0.0, 1.0, 1.5, 1.0])


def test_a_reference_in_another_unit_and_with_the_opposite_sign_is_converted(tmp_path):
    (tmp_path / "r.csv").write_text("t_s,force_n\n0,-100\n1,50\n")
    known = read(tmp_path / "r.csv", ReferenceColumns(unit="gf", inverted=True))
    assert known["force_n"] == pytest.approx([0.980665, -0.4903325])


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("time,force_n\n0,1\n1,1\n", "--time-column"),
        ("t_s,load\n0,1\n1,1\n", "--force-column"),
        ("t_s;force_n\n0;1,5\n1;1,5\n", "semicolons.* sed "),
        ("t_s\tforce_n\n0\t1,5\n1\t1,5\n", "tabs.* sed "),
    ],
)
def test_another_column_or_separator_is_rejected_with_the_remedy(tmp_path, text, expected):
    (tmp_path / "r.csv").write_text(text)
    with pytest.raises(ConfigurationError, match=expected):
        read(tmp_path / "r.csv")


def test_there_is_no_force_outside_the_reference_and_in_a_gap(tmp_path):
    known = reference(tmp_path / "r.csv", [(1.0, 0.0), (1.05, 1.0), (3.0, 1.0), (3.05, 1.0)])
    force_n = force_at(np.array([0.99, 1.02, 2.0, 3.02, 3.06]), known)
    assert np.isfinite(force_n).tolist() == [False, True, False, True, False]


def test_only_samples_that_the_reference_covers_become_rows(tmp_path):
    known = reference(tmp_path / "r.csv", [(0.1 * n, 1.5) for n in range(10, 21)])
    times = [float(row[0]) for row in rows_of(samples(5.0), known)]
    assert (times[0], times[-1]) == (1.0, 2.0)


def test_each_locked_period_is_a_phase_and_the_phase_is_empty_when_not_locked(tmp_path):
    known = reference(tmp_path / "r.csv", [(0.05 * n, 1.5) for n in range(100)])
    pressures = samples(1.0, 0.0) + samples(0.5, 1.0, locked=False) + samples(1.0, 1.5)
    assert {row[3] for row in rows_of(pressures[:500], known)} == {"1"}
    assert {row[3] for row in rows_of(pressures[:700], known)} == {"1", ""}
    (tmp_path / "out.csv").write_text("".join(recording_lines(pressures, known)))
    assert [len(trial.t_s) for trial in recording.read(tmp_path / "out.csv")] == [500, 500]


def test_a_sample_without_pressure_or_with_an_earlier_time_is_skipped(tmp_path):
    known = reference(tmp_path / "r.csv", [(0.0, 1.0), (0.1, 1.0)])
    pressures = [
        PressureSample(0.01, 8.0, True),
        PressureSample(0.02, math.nan, True),
        PressureSample(0.005, 8.0, True),
    ]
    assert [row[0] for row in rows_of(pressures, known)] == ["0.010000"]


def test_samples_whose_times_stand_still_are_distributed_up_to_the_next_time():
    times_s = [0.0, 0.002, 0.002, 0.002, 0.008, 5.0, 5.0]
    spread = spread_times(PressureSample(t_s, 8.0, True) for t_s in times_s)
    assert [sample.t_s for sample in spread] == pytest.approx([0.0, 0.002, 0.004, 0.006, 0.008, 5.0, 5.0])


def test_a_reference_from_another_time_is_rejected(tmp_path):
    known = reference(tmp_path / "r.csv", [(1.8e9, 1.0), (1.8e9 + 0.1, 1.0)])
    with pytest.raises(ConfigurationError, match="covers no sample"):
        rows_of(samples(1.0), known)


def test_readings_with_the_same_time_become_their_mean(tmp_path):
    known = reference(tmp_path / "r.csv", [(0.0, 1.0), (0.1, 1.0), (0.1, 2.0), (0.1, 6.0), (0.2, 4.0)])
    assert (known["t_s"].tolist(), known["force_n"].tolist()) == ([0.0, 0.1, 0.2], [1.0, 3.0, 4.0])


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        ([(0.0, 1.0)], "at least 2"),
        ([(0.0, 1.0), (0.0, 1.0)], "at least 2"),
        ([(0.0, 1.0), (0.1, 1.0), (0.09, 2.0)], "line 4: t_s: the time falls"),
        ([(float(n // 10), 1.0) for n in range(50)], "t_s: the times have steps of 1 s"),
    ],
)
def test_an_invalid_reference_is_rejected_with_its_line(tmp_path, rows, expected):
    with pytest.raises(ConfigurationError, match=expected):
        reference(tmp_path / "r.csv", rows)
