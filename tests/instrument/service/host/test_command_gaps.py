"""Tests of the histogram of the gaps between commands."""

from pneuforce.instrument.service.host.command_gaps import BOUNDS_S, CommandGaps
from pneuforce.protocol.limits import HOST_SILENCE_S


def gaps_of(times_s):
    gaps = CommandGaps()
    for time_s in times_s:
        gaps.sent(time_s)
    return gaps.values()


def test_each_gap_is_in_the_first_bucket_whose_bound_is_not_below_the_gap():
    values = gaps_of([0.0, 0.0625, 0.3125, 0.625, 0.671875, 4.0])
    counted = dict(zip([*values["bounds_s"], "more"], values["counts"], strict=True))
    assert {bound: count for bound, count in counted.items() if count} == {
        0.055: 1,
        0.075: 1,
        HOST_SILENCE_S: 1,
        0.5: 1,
        "more": 1,
    }
    assert abs(values["sum_s"] - 4.0) < 1e-9


def test_the_time_without_a_port_is_no_gap():
    gaps = CommandGaps()
    gaps.sent(1.0)
    gaps.restart()
    gaps.sent(100.0)
    assert sum(gaps.values()["counts"]) == 0
    gaps.sent(100.05)
    assert gaps.values()["counts"] == [1] + [0] * len(BOUNDS_S)
