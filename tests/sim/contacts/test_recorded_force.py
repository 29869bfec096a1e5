import pytest

from sim.contacts.recorded import recorded


def written(tmp_path, text):
    path = tmp_path / "profile.csv"
    path.write_text(text)
    return path


def test_a_recorded_course_is_counted_from_its_first_row(tmp_path):
    course = recorded(written(tmp_path, "t_s,force_n\n10.0,0.5\n10.5,1.5\n\n11.5,1\n"))
    assert course.lasts_s == pytest.approx(1.5)
    assert course.at(0.25) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "row 1: the header must be t_s,force_n"),
        ("time,force\n0,1\n1,1\n", "row 1: the header must be t_s,force_n"),
        ("t_s,force_n\n0,1\n1,\n", "row 3: two numbers are expected, not '1,'"),
        ("t_s,force_n\n0,1\n1,2,3\n", "row 3: two numbers are expected, not '1,2,3'"),
        ("t_s,force_n\n0,1\n1,two\n", "row 3: two numbers are expected, not '1,two'"),
        ("t_s,force_n\n0,1\n0,2\n", "row 3: time must rise, from 0 s to 0 s"),
        ("t_s,force_n\n0,1\n1,nan\n", "row 3: nan N is outside 0 to 20 N"),
        ("t_s,force_n\n0,1\n1,-0.1\n", "row 3: -0.1 N is outside 0 to 20 N"),
        ("t_s,force_n\ninf,1\n", "row 2: inf is not a time"),
        ("t_s,force_n\n0,1\n", "two rows at least make a course"),
    ],
)
def test_a_bad_file_is_told_with_its_row(tmp_path, text, sentence):
    path = written(tmp_path, text)
    with pytest.raises(ValueError, match=r"profile\.csv") as refused:
        recorded(path)
    assert str(refused.value).startswith(str(path))
    assert sentence in str(refused.value)


def test_a_file_that_is_no_text_or_not_there_is_told_in_a_sentence(tmp_path):
    path = tmp_path / "profile.csv"
    path.write_bytes(b"t_s,force_n\n\xff\xfe,1\n")
    for absent in (path, tmp_path, tmp_path / "no.csv"):
        with pytest.raises(ValueError, match="cannot be read"):
            recorded(absent)
