"""Calls that are repeated in a thread while a test runs."""

import threading
from contextlib import contextmanager


@contextmanager
def repeated(call, period_s):
    """Call a function in a thread, once in each period, until the block ends."""
    stop = threading.Event()

    def run():
        while not stop.wait(period_s):
            call()

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()
