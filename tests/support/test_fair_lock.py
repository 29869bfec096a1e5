"""Tests of the fair lock: order of the threads, repeated requests of the owner, and an interrupted wait."""

import threading

import pytest

from pneuforce.support.fair_lock import FairLock
from tests.system.waiting import wait_for


def waiting(lock, count):
    """Wait until a number of threads wait for the lock."""
    wait_for(lambda: len(lock._waiting), lambda found: found == count)


def test_the_thread_that_waits_longest_gets_the_lock_also_from_a_thread_that_requests_it_at_once():
    lock, order = FairLock(), []

    def take(name):
        with lock:
            order.append(name)

    threads = [threading.Thread(target=take, args=(name,)) for name in range(5)]
    with lock:
        for count, thread in enumerate(threads, 1):
            thread.start()
            waiting(lock, count)
    with lock:
        order.append("releaser")
    for thread in threads:
        thread.join()
    assert order == [0, 1, 2, 3, 4, "releaser"]


def test_the_owner_takes_the_lock_again_and_keeps_it_until_the_last_release():
    lock, taken = FairLock(), threading.Event()

    def take():
        with lock:
            taken.set()

    thread = threading.Thread(target=take)
    with lock:
        with lock:
            thread.start()
            waiting(lock, 1)
        assert not taken.is_set()
    thread.join()
    assert taken.is_set()


class Interrupted(BaseException):
    """Ctrl-C."""


def test_a_wait_that_is_interrupted_gives_its_place_to_the_next_thread(monkeypatch):
    lock, interrupted, taken = FairLock(), threading.Event(), threading.Event()

    class Gate:
        """Lock whose second request is interrupted."""

        def __init__(self):
            self._requests = 0

        def acquire(self):
            self._requests += 1
            if self._requests == 2:
                raise Interrupted

        def release(self):
            pass

    def take_interrupted():
        with monkeypatch.context() as patch:
            patch.setattr("pneuforce.support.fair_lock.threading.Lock", Gate)
            with pytest.raises(Interrupted), lock:
                pass
        interrupted.set()

    def take():
        with lock:
            taken.set()

    with lock:
        for target in (take_interrupted, take):
            threading.Thread(target=target).start()
        assert interrupted.wait(600.0)
        waiting(lock, 1)
    assert taken.wait(600.0)


def test_an_error_releases_the_lock():
    lock = FairLock()
    with pytest.raises(ValueError, match="x"), lock:
        raise ValueError("x")
    assert lock._owner is None
