import pytest

from pneuforce.sim.contacts.recorded_force import read_recorded_force


def written(tmp_path, text):
    path = tmp_path / "profile.csv"
    path.write_text(text)
    return path


def test_the_time_of_a_recorded_force_starts_at_the_first_row(tmp_path):
    force = read_recorded_force(written(tmp_path, "t_s,force_n\n10.0,0.5\n10.5,1.5\n\n11.5,1\n"))
    assert force.duration_s == pytest.approx(1.5)
    assert force.at(0.25) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("text", "fact"),
    [
        ("", "row 1: the header must be t_s,force_n"),
        ("time,force\n0,1\n1,1\n", "row 1: the header must be t_s,force_n"),
        ("t_s,force_n\n0,1\n1,\n", "row 3: two numbers are expected, not '1,'"),
        ("t_s,force_n\n0,1\n1,2,3\n", "row 3: two numbers are expected, not '1,2,3'"),
        ("t_s,force_n\n0,1\n1,two\n", "row 3: two numbers are expected, not '1,two'"),
        ("t_s,force_n\n0,1\n0,2\n", "row 3: the time must increase"),
        ("t_s,force_n\n0,1\n1,nan\n", "row 3: nan N is outside 0 to 20 N"),
        ("t_s,force_n\n0,1\n1,-0.1\n", "row 3: -0.1 N is outside 0 to 20 N"),
        ("t_s,force_n\ninf,1\n", "row 2: inf is not a valid time"),
        ("t_s,force_n\n0,1\n", "at least two rows"),
    ],
)
def test_an_invalid_file_is_rejected_with_its_row(tmp_path, text, fact):
    path = written(tmp_path, text)
    with pytest.raises(ValueError, match=r"profile\.csv") as error:
        read_recorded_force(path)
    assert str(error.value).startswith(str(path))
    assert fact in str(error.value)


def test_a_file_that_cannot_be_read_is_rejected(tmp_path):
    path = tmp_path / "profile.csv"
    path.write_bytes(b"t_s,force_n\n\xff\xfe,1\n")
    for unreadable in (path, tmp_path, tmp_path / "no.csv"):
        with pytest.raises(ValueError, match=r"cannot be read|no such file"):
            read_recorded_force(unreadable)
