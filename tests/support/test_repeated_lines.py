"""Tests of the pauses between equal lines of a log."""

from pneuforce.support.repeated_lines import MAX_LINES, RepeatedLines


def test_an_equal_line_is_logged_again_after_growing_pauses():
    lines = RepeatedLines()
    logged_s = [t_s for t_s in range(20_000) if lines.is_due("the broker does not answer", t_s)]
    assert logged_s == [0, 10, 30, 70, 150, 310, 630, 1270, 2550, 5110, 8710, 12310, 15910, 19510]


def test_another_line_is_logged_at_once_and_the_memory_is_limited():
    lines = RepeatedLines()
    assert all(lines.is_due(f"line {number}", 0.0) for number in range(MAX_LINES + 1))
    assert lines.is_due("line 0", 1.0)  # it was forgotten
    assert not lines.is_due(f"line {MAX_LINES}", 1.0)
    lines.clear()
    assert lines.is_due(f"line {MAX_LINES}", 1.0)
