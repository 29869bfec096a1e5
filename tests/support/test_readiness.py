"""Tests of waiting for descriptors."""

import contextlib
import fcntl
import os
import socket
import time

import pytest

from pneuforce.support.readiness import is_writable, readable


@pytest.fixture
def pair():
    ends = socket.socketpair()
    yield ends
    for end in ends:
        end.close()


def test_only_descriptors_with_data_are_readable(pair):
    near, far = pair
    assert readable([near.fileno(), far.fileno()], 0) == []
    far.send(b"x")
    assert readable([near.fileno(), far.fileno()], 1.0) == [near.fileno()]


def test_a_closed_connection_is_readable(pair):
    near, far = pair
    far.close()
    assert readable([near.fileno()], 1.0) == [near.fileno()]


def test_the_time_limit_is_kept(pair):
    started_s = time.monotonic()
    assert readable([pair[0].fileno()], 0.02) == []
    assert time.monotonic() - started_s >= 0.02


def test_a_full_socket_is_not_writable(pair):
    near, _ = pair
    assert is_writable(near.fileno(), 0)
    near.setblocking(False)
    with contextlib.suppress(BlockingIOError):
        while near.send(bytes(65536)):
            pass
    assert not is_writable(near.fileno(), 0.01)


def test_descriptors_above_1023_work(pair):
    near, far = pair
    try:
        high = fcntl.fcntl(near.fileno(), fcntl.F_DUPFD, 1500)
    except OSError:
        pytest.skip("this user may not open 1500 files: ulimit -n")
    try:
        far.send(b"x")
        assert readable([high], 1.0) == [high]
        assert is_writable(high, 1.0)
    finally:
        os.close(high)
