"""Tests of the delay of requests during a flood, in virtual time."""

import pytest

from pneuforce.web.server.request_pacer import BURST, MAX_DELAY_S, REQUESTS_PER_S, PacingSchedule


def test_a_page_is_loaded_without_a_delay():
    schedule = PacingSchedule()
    assert [schedule.delay_s(100.0) for _ in range(BURST)] == pytest.approx([0.0] * BURST, abs=1e-6)


@pytest.mark.parametrize("per_s", [2 * REQUESTS_PER_S, 50 * REQUESTS_PER_S])
def test_during_a_flood_the_mean_rate_is_limited_and_further_requests_are_rejected(per_s):
    schedule = PacingSchedule()
    times_s = [i / per_s for i in range(round(60 * per_s))]
    starts_s = [now_s + delay_s for now_s in times_s if (delay_s := schedule.delay_s(now_s)) is not None]
    assert len(starts_s) == pytest.approx(BURST + REQUESTS_PER_S * (60 + MAX_DELAY_S), rel=0.01)
    assert max(starts_s) <= 60.0 + MAX_DELAY_S
    assert starts_s == sorted(starts_s)


def test_after_a_flood_there_is_no_delay():
    schedule = PacingSchedule()
    for _ in range(10_000):
        schedule.delay_s(0.0)
    assert schedule.delay_s(MAX_DELAY_S) == pytest.approx(0.0, abs=0.05)
    assert [schedule.delay_s(60.0) for _ in range(BURST)] == pytest.approx([0.0] * BURST, abs=1e-6)
