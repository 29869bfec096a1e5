"""Tests of validation recordings as CSV files: valid files are read, invalid files are rejected."""

import numpy as np
import pytest

from pneuforce.errors import ConfigurationError, WriteFailed
from pneuforce.instrument.recording.schema import SAMPLE_TYPES
from pneuforce.instrument.validation.recording import read, write
from pneuforce.instrument.validation.trial import Trial
from tests.instrument.validation.synthetic_trials import force_n, trial

HEADER = "t_s,pressure_kpa,force_n\n"


def lines(count=1000, begin_s=0.0, step_s=0.002, suffix=""):
    return "".join(f"{begin_s + n * step_s:.3f},8.0,0.0{suffix}\n" for n in range(count))


def write_file(tmp_path, text):
    file = tmp_path / "rig.csv"
    file.write_text(text, encoding="utf-8")
    return file


def test_written_trials_are_read_unchanged(tmp_path):
    first, second = (trial(*force_n(2.0, (0.5, 0.3, 0.3, peak_n))) for peak_n in (1.0, 2.0))
    later = Trial(t_s=second.t_s + 2.0, pressure_kpa=second.pressure_kpa, force_n=second.force_n)
    file = tmp_path / "rig.csv"
    write(file, [first, later])
    trials = read(file)
    assert len(trials) == 2
    for written, loaded in zip([first, later], trials, strict=True):
        np.testing.assert_allclose(loaded.t_s, written.t_s, atol=5e-4)
        np.testing.assert_allclose(loaded.pressure_kpa, written.pressure_kpa, atol=1e-5)
        np.testing.assert_allclose(loaded.force_n, written.force_n, atol=1e-5)


def test_columns_may_be_in_any_order_among_others_and_after_a_byte_order_mark(tmp_path):
    rows = "".join(f"x,{n},8.0,{n * 0.002:.3f}\n" for n in range(10)) + "".join(
        f"x,0.5,8.0,{n * 0.002:.3f}\n" for n in range(10, 1000)
    )
    [only] = read(write_file(tmp_path, "\ufeffnote, force_n ,pressure_kpa,t_s\n" + rows))
    assert only.force_n[:3].tolist() == [0.0, 1.0, 2.0]
    assert only.t_s[-1] == pytest.approx(1.998)


def test_the_samples_of_an_instrument_are_no_reference(tmp_path):
    names = ",".join(SAMPLE_TYPES)
    with pytest.raises(ConfigurationError, match="--reference"):
        read(write_file(tmp_path, names + "\n" + "0," * (len(SAMPLE_TYPES) - 1) + "0\n"))
    own = "t_s,pressure_kpa,force_n,force_std_n\n" + lines(suffix=",0.01")
    assert len(read(write_file(tmp_path, own))) == 1


@pytest.mark.parametrize(
    ("text", "count"),
    [
        (HEADER + lines() + lines(begin_s=3.0), 2),  # a gap of 1 s ends the first trial
        ("t_s,pressure_kpa,force_n,phase\n" + lines(suffix=",1") + lines(begin_s=2.0, suffix=",2"), 2),
        ("t_s,pressure_kpa,force_n,phase\n" + lines(suffix=",1") + lines(begin_s=2.0, suffix=","), 1),
        ("t_s,pressure_kpa,force_n,setpoint_kpa\n" + lines(suffix=",5") + lines(begin_s=2.0, suffix=",6"), 2),
        (HEADER + lines() + lines(count=50, begin_s=3.0), 1),  # the second trial is too short
    ],
)
def test_a_trial_ends_at_a_gap_and_at_a_new_phase_or_setpoint(tmp_path, text, count):
    assert len(read(write_file(tmp_path, text))) == count


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", " is empty: name a file"),
        (
            "t_s,pressure,force_n\n0,8,0\n",
            "must name the columns t_s, pressure_kpa, force_n, not t_s, pressure,",
        ),
        (HEADER + "0,8,0\n0.002,much,0\n", "line 3: pressure_kpa = 'much' is not a number"),
        (HEADER + "0,8,0\n0.002,8,\n", "line 3: force_n = '' is not a number"),
        (HEADER + "0,8,nan\n", "line 2: force_n = 'nan' is not a number"),
        (HEADER + "inf,8,0\n", "line 2: t_s = 'inf' is not a number"),
        (HEADER + "0,8\n", "line 2: 2 columns, the header has 3"),
        (HEADER + "# comment\n0,8,0\n1,8,0\n0.5,8,0\n", "line 5: t_s: time must rise, from 1 s to 0.5 s"),
        (HEADER + "0,8,0\n0,8,0\n", "line 3: t_s: time must rise"),
        (HEADER + "0,8000,0\n", "line 2: pressure_kpa = 8000 is "),
        (HEADER + "0,80.5,0\n", "hPa"),
        (HEADER + "0,8,1500\n", "line 2: force_n = 1500 is "),
        (HEADER + "0,8,1500\n", "mN"),
        (HEADER + lines(step_s=2.0), "is t_s in seconds?"),
        (HEADER, "no samples of a locked balloon"),
    ],
)
def test_an_invalid_file_is_rejected_with_file_line_and_column(tmp_path, text, expected):
    file = write_file(tmp_path, text)
    with pytest.raises(ConfigurationError) as raised:
        read(file)
    assert str(raised.value).startswith(str(file))
    assert expected in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_file_that_is_not_text_is_rejected(tmp_path):
    file = tmp_path / "rig.csv"
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigurationError, match="not a text in UTF-8"):
        read(file)


def test_a_missing_file_is_rejected(tmp_path):
    with pytest.raises(ConfigurationError, match="no such file"):
        read(tmp_path / "nothing.csv")


def test_a_file_in_a_missing_folder_cannot_be_written(tmp_path):
    with pytest.raises(ConfigurationError, match="cannot be written"):
        write(tmp_path / "nothing" / "rig.csv", [])


def test_a_full_disk_leaves_the_old_recording_unchanged(tmp_path):
    file = tmp_path / "rig.csv"
    write(file, [trial(*force_n(2.0, (0.5, 0.3, 0.3, 1.0)))])
    old = file.read_bytes()

    def interrupted():
        yield trial(*force_n(2.0, (0.5, 0.3, 0.3, 1.0)))
        raise OSError(28, "No space left on device")

    with pytest.raises(WriteFailed, match=r"cannot be written: No space left"):
        write(file, interrupted())
    assert file.read_bytes() == old
    assert [path.name for path in tmp_path.iterdir()] == ["rig.csv"]
