"""Rates that one thread notes and another asks for."""

import time
from threading import Event, Thread

from instrument.cli.observe import Rate


def test_a_rate_is_asked_for_while_it_is_noted():
    rate, stop = Rate(), Event()

    def note():
        while not stop.is_set():
            rate.note(time.monotonic())

    noting = Thread(target=note)
    noting.start()
    try:
        until_s = time.monotonic() + 0.5
        while time.monotonic() < until_s:
            assert rate.per_s(time.monotonic()) <= 2000
    finally:
        stop.set()
        noting.join()


def test_a_rate_counts_the_last_second():
    rate = Rate()
    for number in range(30):
        rate.note(number / 10)
    assert (rate.per_s(2.9), rate.count) == (10, 30)
