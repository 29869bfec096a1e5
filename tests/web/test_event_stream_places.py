"""Tests of the rule that selects the event stream to close for a new browser."""

import random
from collections import Counter

import pytest

from pneuforce.web.event_stream import MAX_STREAMS, StreamOwner, stream_to_close

LAPTOP, TABLET = StreamOwner("10.0.0.5", False), StreamOwner("10.0.0.6", False)
OPERATOR = StreamOwner("10.0.0.5", True)


def test_the_address_with_the_most_streams_gives_its_newest_stream_to_another_address():
    owners = [LAPTOP] * 5 + [StreamOwner("10.0.0.7", False)] * 3
    assert stream_to_close(owners, TABLET) == 4


def test_an_address_cannot_replace_its_own_streams():
    assert stream_to_close([LAPTOP] * MAX_STREAMS, LAPTOP) is None


@pytest.mark.parametrize(("laptop", "tablet", "index"), [(17, 15, 16), (16, 15, None), (16, 16, None)])
def test_a_stream_is_given_away_only_if_the_address_keeps_at_least_as_many(laptop, tablet, index):
    assert stream_to_close([LAPTOP] * laptop + [TABLET] * tablet, TABLET) == index


def test_a_browser_that_has_logged_in_replaces_one_that_has_not():
    assert stream_to_close([LAPTOP] * MAX_STREAMS, OPERATOR) == MAX_STREAMS - 1
    assert stream_to_close([OPERATOR, TABLET, OPERATOR], OPERATOR) == 1
    assert stream_to_close([OPERATOR] * MAX_STREAMS, TABLET) is None
    assert stream_to_close([OPERATOR] * MAX_STREAMS, OPERATOR) is None


def test_browsers_that_connect_again_stop_replacing_each_other():
    """Each browser without a stream tries again and again. After some time no stream is closed any more."""
    choice = random.Random(1)
    owners, outside = [LAPTOP] * MAX_STREAMS, []
    for number, count in [(6, 20), (7, 8), (8, 1), (9, 40)]:
        outside += [StreamOwner(f"10.0.0.{number}", known) for known in (False, True) for _ in range(count)]
    closed = []
    for attempt in range(5000):
        newcomer = outside.pop(choice.randrange(len(outside)))
        index = stream_to_close(owners, newcomer)
        if index is None:
            outside.append(newcomer)
            continue
        closed.append(attempt)
        outside.append(owners.pop(index))
        owners.append(newcomer)
    assert len(closed) < 200
    assert max(closed) < 4000
    counts = Counter(owner.network for owner in owners)
    assert max(counts.values()) - min(counts[f"10.0.0.{n}"] for n in (6, 9)) <= 2
