"""Tests of the log lines about counters: content and interval."""

from pneuforce.registers.can.counter_logger import PERIOD_S, CounterLogger


def counts(unsent=0, errors=0):
    return {"frames not sent": unsent, "error frames": errors}


def test_unchanged_counters_give_no_line():
    logger = CounterLogger()
    assert [logger.line(counts(), now_s) for now_s in range(200)] == 200 * [""]


def test_the_first_increase_is_logged_at_once_and_later_ones_once_a_minute():
    logger = CounterLogger()
    lines = [(now_s, logger.line(counts(unsent=3 * (now_s + 1)), now_s)) for now_s in range(150)]
    assert [(now_s, line) for now_s, line in lines if line] == [
        (0, "frames not sent 3"),
        (round(PERIOD_S), "frames not sent 180"),
        (round(2 * PERIOD_S), "frames not sent 180"),
    ]


def test_a_line_contains_only_counters_that_have_increased():
    logger = CounterLogger()
    logger.line(counts(unsent=5), 0.0)
    assert logger.line(counts(unsent=5, errors=2), 1.0) == ""
    assert logger.line(counts(unsent=5, errors=2), 61.0) == "error frames 2"
    assert logger.line(counts(unsent=6, errors=4), 200.0) == "frames not sent 1, error frames 2"
