"""Files of points: what is not one is refused with its line."""

import hashlib

import pytest

from instrument.calibration.columns import recording
from tests.instrument.calibration.points import refusal_of

CHOICES = [("a", "b"), ("a", "c")]


def test_the_columns_are_found_by_name_whatever_else_the_file_has():
    data = "\ufeffnote, c ,a\n# a comment\nx,1.5,2\n\n y , -1e3,4\n".encode()
    read = recording(data, "f.csv", CHOICES)
    assert read["a"].tolist() == [2, 4]
    assert read["c"].tolist() == [1.5, -1000]
    assert read.lines == (3, 5)
    assert read.sha256 == hashlib.sha256(data).hexdigest()


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "f.csv: empty"),
        (b"# only this\n", "f.csv: empty"),
        (b"x,y\n1,2\n", "f.csv: the first line must name the columns a, b or a, c, not x, y"),
        (b"1,2\n3,4\n", "must name the columns"),
        (b"a,b\n1,2\n1,two\n", "f.csv, line 3: b = 'two' is not a number"),
        (b"a,b\n1\n", "f.csv, line 2: b = '' is not a number"),
        (b"a,b\n1,nan\n", "f.csv, line 2: b = 'nan' is not a number"),
        (b"a,b\n1,inf\n", "f.csv, line 2: b = 'inf' is not a number"),
        (b"a,b\n1,\xff\n", "f.csv: not a text in UTF-8"),
        (b'a,b\n1,"2\n', "not CSV"),
    ],
)
def test_what_is_no_table_of_numbers_is_refused_with_its_line(data, said):
    assert said in refusal_of(recording, data, "f.csv", CHOICES)
