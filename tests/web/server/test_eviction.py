"""Tests of the order in which connections are closed, in virtual time."""

import pytest

from pneuforce.web.server.eviction import HEAD_ADVANTAGE_S, EvictionQueue, Protection


@pytest.fixture
def queue():
    return EvictionQueue()


def order(queue):
    return list(queue.candidates())


def test_connections_of_the_same_kind_are_closed_oldest_first(queue):
    for now_s, name in enumerate(["first", "second", "third"]):
        queue.place(name, Protection.NONE, float(now_s))
    assert order(queue) == ["first", "second", "third"]


def test_a_new_connection_is_closed_after_connections_that_made_progress_soon_after_its_start(queue):
    queue.place("new", Protection.LATER, 10.0)
    queue.place("before", Protection.NONE, 9.0)
    queue.place("soon after", Protection.NONE, 10.0 + 0.9 * HEAD_ADVANTAGE_S)
    queue.place("later", Protection.NONE, 10.0 + 1.1 * HEAD_ADVANTAGE_S)
    assert order(queue) == ["before", "soon after", "new", "later"]


def test_a_connection_with_a_vent_or_an_event_stream_is_never_closed(queue):
    queue.place("vent", Protection.FULL, 0.0)
    queue.place("idle", Protection.NONE, 1.0)
    assert order(queue) == ["idle"]
    assert len(queue) == 2


def test_progress_moves_a_connection_to_the_end(queue):
    for name in ("one", "two"):
        queue.place(name, Protection.NONE, 0.0)
    queue.place("one", Protection.LATER, 1.0)
    queue.place("one", Protection.NONE, 2.0)
    assert order(queue) == ["two", "one"]


def test_bytes_without_progress_do_not_move_a_connection(queue):
    queue.place("slow", Protection.LATER, 0.0)
    queue.place("new", Protection.LATER, 1.0)
    queue.place("slow", Protection.LATER, 2.0)
    assert order(queue) == ["slow", "new"]


def test_a_removed_connection_is_no_candidate(queue):
    queue.place("closed", Protection.LATER, 0.0)
    queue.remove("closed")
    assert order(queue) == []
    assert len(queue) == 0
