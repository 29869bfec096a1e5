"""Tests of CSV files with named columns: the error of an invalid file names the line."""

import hashlib

import pytest

from pneuforce.support.columns import CSV_FORMAT_HINT, MAX_ROWS, parse_points
from tests.instrument.calibration.points import error_message

ALTERNATIVES = [("a", "b"), ("a", "c")]


def test_columns_are_found_by_name_among_other_columns():
    data = '\ufeffnote, c ,a\n# a "comment", of "two\nx,1.5,2\n\n y , -1e3,4\n'.encode()
    points = parse_points(data, "f.csv", ALTERNATIVES)
    assert points["a"].tolist() == [2, 4]
    assert points["c"].tolist() == [1.5, -1000]
    assert list(points.lines) == [3, 5]
    assert points.sha256 == hashlib.sha256(data).hexdigest()


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_the_line_ends_of_every_system_are_accepted(end):
    data = end.join(["a,b", "1,2", "3,4"]).encode()
    assert parse_points(data, "f.csv", ALTERNATIVES)["b"].tolist() == [2, 4]


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (b"", "f.csv is empty: name a file"),
        (b"# only this\n", "f.csv is empty: name a file"),
        (b"x,y\n1,2\n", "f.csv: the first line must name the columns a, b or a, c, not x, y"),
        (b"1,2\n3,4\n", "must name the columns"),
        (b"a,b,b\n1,2,3\n", "f.csv: two columns have the name b"),
        (b"a,b\n1,2\n1,two\n", "f.csv, line 3: b = 'two' is not a number"),
        (b"a,b\n1\n", "f.csv, line 2: 1 column, the header has 2"),
        (b"a,b\n1,\n", "f.csv, line 2: b = '' is not a number"),
        (b"a,b\n1,nan\n", "f.csv, line 2: b = 'nan' is not a number"),
        (b"a,b\n1,inf\n", "f.csv, line 2: b = 'inf' is not a number"),
        (b"a,b\n1,1_0\n", "f.csv, line 2: b = '1_0' is not a number"),
        ("a,b\n1,\uff19\n".encode(), "f.csv, line 2: b = '\uff19' is not a number"),
        (b"a,b\n1,1e308\n", "f.csv, line 2: b = '1e308' is too large"),
        (b"a,b\n1,\xff\n", "f.csv: not a text in UTF-8"),
        (b'a,b\n1,"2\n', "not CSV"),
        (b"a,b\n1,\0\n", "f.csv, line 2: "),
        (b"a;b\n1,5;2,5\n", f"f.csv: the columns are separated by semicolons: {CSV_FORMAT_HINT}"),
        (b"a\tb\n1\t2\n", f"f.csv: the columns are separated by tabs: {CSV_FORMAT_HINT}"),
        (b"a,b\n1,5,2,5\n", f"f.csv, line 2: 4 columns, the header has 2: {CSV_FORMAT_HINT}"),
        (b'a,b\n"1,5","2,5"\n', f"f.csv, line 2: a = '1,5' is not a number: {CSV_FORMAT_HINT}"),
    ],
)
def test_an_invalid_table_is_rejected_with_the_line(data, expected):
    assert expected in error_message(parse_points, data, "f.csv", ALTERNATIVES)


def test_a_file_with_too_many_lines_is_rejected_before_it_is_decoded():
    data = b"no text: \xff\n" * (MAX_ROWS + 1)
    message = error_message(parse_points, data, "f.csv", ALTERNATIVES)
    assert message.startswith("f.csv: ")
    assert str(MAX_ROWS) in message
