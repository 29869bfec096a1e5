"""Fake instrument whose state a test sets, behind a real web server and in a real browser."""

import threading
import time

from tests.system.waiting import wait_for
from tests.web.entries import header, real_snapshot, sample, snapshot
from tests.web.serving import FakeInstrument, Site


class ShownState:
    """State that a fake instrument sends to a real web server until `close`: a held balloon, with changes."""

    def __init__(self, path, browser):
        self._instrument, self._browser = FakeInstrument(path), browser
        self._site = Site(path)
        wait_for(lambda: self._instrument.subscriptions, bool)
        self._instrument.send(header())
        self._normal = {**real_snapshot()[1], "status": ["holding"]}
        self._late_s, self._samples = 0.0, []
        self._changes, self._ended, self._silent = {}, threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._send)
        self._thread.start()
        self.open()

    def _send(self):
        while not self._ended.wait(0.1):
            samples, self._samples = self._samples, []
            if not self._silent.is_set():
                self._instrument.send(
                    *samples, snapshot(time.monotonic() - self._late_s, **{**self._normal, **self._changes})
                )

    def set(self, **changes):
        """Send the held balloon with these changes, also after `be_silent`."""
        self._changes = changes
        self._silent.clear()

    def be_late(self, late_s):
        """Send states that are this old, as over a slow network."""
        self._late_s = late_s

    def send_samples(self, seconds, **measurement):
        """Send samples at 500 Hz. The last of them has the present time."""
        begin_s = time.monotonic() - seconds
        self._samples = [sample(begin_s + n / 500, **measurement) for n in range(round(seconds * 500))]

    def be_silent(self):
        """Send no more states, as an instrument that hangs."""
        self._silent.set()

    def open(self, address="", **options):
        self._browser("open", url=f"http://127.0.0.1:{self._site.port}/{address}", **options)

    @property
    def requests(self):
        return self._instrument.requests

    def close(self):
        self._ended.set()
        self._thread.join()
        self._site.stop()
        self._instrument.close()
