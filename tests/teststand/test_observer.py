"""Tests of event rates: one thread counts the events, and another thread reads the rate."""

import time
from threading import Event, Thread

from pneuforce.teststand.observer import EventRate


def test_a_rate_can_be_read_while_another_thread_counts():
    rate, stop = EventRate(), Event()

    def count():
        while not stop.is_set():
            rate.add(time.monotonic())

    counting = Thread(target=count)
    counting.start()
    try:
        until_s = time.monotonic() + 0.5
        while time.monotonic() < until_s:
            assert rate.per_s(time.monotonic()) <= 2000
    finally:
        stop.set()
        counting.join()


def test_a_rate_counts_the_last_second():
    rate = EventRate()
    for number in range(30):
        rate.add(number / 10)
    assert (rate.per_s(2.9), rate.count) == (10, 30)
