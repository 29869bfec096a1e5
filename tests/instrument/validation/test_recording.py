"""Recordings as CSV files, good and bad."""

import numpy as np
import pytest

from instrument.errors import ConfigurationError
from instrument.validation.recording import read, write
from tests.instrument.validation.pressing import force_n, trial

HEADER = "t_s,pressure_kpa,force_n\n"


def lines(count=1000, begin_s=0.0, step_s=0.002, rest=""):
    return "".join(f"{begin_s + n * step_s:.3f},8.0,0.0{rest}\n" for n in range(count))


def file_with(tmp_path, text):
    file = tmp_path / "rig.csv"
    file.write_text(text, encoding="utf-8")
    return file


def test_what_is_written_is_read_again(tmp_path):
    trials = [trial(*force_n(2.0, (0.5, 0.3, 0.3, peak_n))) for peak_n in (1.0, 2.0)]
    later = type(trials[1])(
        t_s=trials[1].t_s + 2.0, pressure_kpa=trials[1].pressure_kpa, force_n=trials[1].force_n
    )
    file = tmp_path / "rig.csv"
    write(file, [trials[0], later])
    again = read(file)
    assert len(again) == 2
    for old, new in zip([trials[0], later], again, strict=True):
        np.testing.assert_allclose(new.t_s, old.t_s, atol=5e-4)
        np.testing.assert_allclose(new.pressure_kpa, old.pressure_kpa, atol=1e-5)
        np.testing.assert_allclose(new.force_n, old.force_n, atol=1e-5)


def test_columns_may_come_in_any_order_beside_others_and_after_a_byte_order_mark(tmp_path):
    rows = "".join(f"x,{n},8.0,{n * 0.002:.3f}\n" for n in range(10)) + "".join(
        f"x,0.5,8.0,{n * 0.002:.3f}\n" for n in range(10, 1000)
    )
    [made] = read(file_with(tmp_path, "\ufeffnote, force_n ,pressure_kpa,t_s\n" + rows))
    assert made.force_n[:3].tolist() == [0.0, 1.0, 2.0]
    assert made.t_s[-1] == pytest.approx(1.998)


@pytest.mark.parametrize(
    ("text", "count"),
    [
        (HEADER + lines() + lines(begin_s=3.0), 2),  # a gap
        ("t_s,pressure_kpa,force_n,phase\n" + lines(rest=",1") + lines(begin_s=2.0, rest=",2"), 2),
        ("t_s,pressure_kpa,force_n,phase\n" + lines(rest=",1") + lines(begin_s=2.0, rest=","), 1),
        ("t_s,pressure_kpa,force_n,setpoint_kpa\n" + lines(rest=",5") + lines(begin_s=2.0, rest=",6"), 2),
        (HEADER + lines() + lines(count=50, begin_s=3.0), 1),  # too short to tell anything
    ],
)
def test_trials_end_at_gaps_and_where_phase_or_setpoint_change(tmp_path, text, count):
    assert len(read(file_with(tmp_path, text))) == count


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", ": empty"),
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
        (HEADER + "0,8000,0\n", "line 2: pressure_kpa = 8000 is more than the sensor can tell: is this Pa"),
        (HEADER + "0,80.5,0\n", "is this Pa, hPa or absolute?"),
        (
            HEADER + "0,8,1500\n",
            "line 2: force_n = 1500 is more than the balloon can bear: is this mN or g?",
        ),
        (HEADER + lines(step_s=2.0), "is t_s in seconds?"),
        (HEADER, "no samples of a locked balloon"),
    ],
)
def test_a_bad_file_is_refused_with_file_line_and_column(tmp_path, text, said):
    file = file_with(tmp_path, text)
    with pytest.raises(ConfigurationError) as refused:
        read(file)
    assert str(refused.value).startswith(str(file))
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_file_that_is_no_text_is_refused(tmp_path):
    file = tmp_path / "rig.csv"
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigurationError, match="not a text in UTF-8"):
        read(file)


def test_a_file_that_does_not_exist_is_refused(tmp_path):
    with pytest.raises(ConfigurationError, match="no such file"):
        read(tmp_path / "nothing.csv")


def test_a_folder_that_does_not_exist_cannot_be_written_into(tmp_path):
    with pytest.raises(ConfigurationError, match="cannot be written"):
        write(tmp_path / "nothing" / "rig.csv", [])


def test_a_disk_that_is_full_leaves_the_old_recording(tmp_path):
    file = tmp_path / "rig.csv"
    write(file, [trial(*force_n(2.0, (0.5, 0.3, 0.3, 1.0)))])
    old = file.read_bytes()

    def torn():
        yield trial(*force_n(2.0, (0.5, 0.3, 0.3, 1.0)))
        raise OSError(28, "No space left on device")

    with pytest.raises(ConfigurationError, match=r"cannot be written: No space left"):
        write(file, torn())
    assert file.read_bytes() == old
    assert [path.name for path in tmp_path.iterdir()] == ["rig.csv"]
