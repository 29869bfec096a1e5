"""Files of columns: what is none is refused with its line, and soon."""

import hashlib

import pytest

from instrument.columns import MOST_ROWS, points_in
from tests.instrument.calibration.points import refusal_of

CHOICES = [("a", "b"), ("a", "c")]
AS_HERE = "use commas between columns, points in numbers"


def test_the_columns_are_found_by_name_whatever_else_the_file_has():
    data = '\ufeffnote, c ,a\n# a "comment", of "two\nx,1.5,2\n\n y , -1e3,4\n'.encode()
    read = points_in(data, "f.csv", CHOICES)
    assert read["a"].tolist() == [2, 4]
    assert read["c"].tolist() == [1.5, -1000]
    assert list(read.lines) == [3, 5]
    assert read.sha256 == hashlib.sha256(data).hexdigest()


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_lines_may_end_as_on_any_machine(end):
    assert points_in(end.join(["a,b", "1,2", "3,4"]).encode(), "f.csv", CHOICES)["b"].tolist() == [2, 4]


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "f.csv: empty"),
        (b"# only this\n", "f.csv: empty"),
        (b"x,y\n1,2\n", "f.csv: the first line must name the columns a, b or a, c, not x, y"),
        (b"1,2\n3,4\n", "must name the columns"),
        (b"a,b\n1,2\n1,two\n", "f.csv, line 3: b = 'two' is not a number"),
        (b"a,b\n1\n", "f.csv, line 2: 1 columns, the header has 2"),
        (b"a,b\n1,\n", "f.csv, line 2: b = '' is not a number"),
        (b"a,b\n1,nan\n", "f.csv, line 2: b = 'nan' is not a number"),
        (b"a,b\n1,inf\n", "f.csv, line 2: b = 'inf' is not a number"),
        (b"a,b\n1,1e308\n", "f.csv, line 2: b = '1e308' is too large"),
        (b"a,b\n1,\xff\n", "f.csv: not a text in UTF-8"),
        (b'a,b\n1,"2\n', "not CSV"),
        (b"a,b\n1,\0\n", "f.csv, line 2: "),
        (b"a;b\n1,5;2,5\n", f"f.csv: {AS_HERE}"),
        (b"a\tb\n1\t2\n", f"f.csv: {AS_HERE}"),
        (b"a,b\n1,5,2,5\n", f"f.csv, line 2: 4 columns, the header has 2: {AS_HERE}"),
        (b'a,b\n"1,5","2,5"\n', f"f.csv, line 2: a = '1,5' is not a number: {AS_HERE}"),
    ],
)
def test_what_is_no_table_of_numbers_is_refused_with_its_line(data, said):
    assert said in refusal_of(points_in, data, "f.csv", CHOICES)


def test_a_file_of_too_many_lines_is_refused_before_any_is_read():
    data = b"no text: \xff\n" * (MOST_ROWS + 1)
    assert refusal_of(points_in, data, "f.csv", CHOICES) == f"f.csv: more than {MOST_ROWS} lines"
