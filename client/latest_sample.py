"""Latest sample of a connection, passed from the receiving thread to the waiting threads."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import replace

from pneuforce.client.measurement import Measurement


class LatestSample:
    """Slot for the latest measurement. A waiting thread skips older samples, so that no sample is old."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._latest: Measurement | None = None
        self._received_s = -math.inf
        self._failure = ""  #: reason of the lost connection
        self._closed = False

    def put(self, measurement: Measurement) -> None:
        """Store the latest measurement and wake the waiting threads."""
        with self._changed:
            self._latest, self._received_s, self._failure = measurement, time.monotonic(), ""
            self._changed.notify_all()

    def fail(self, failure: str) -> None:
        """Store the reason of a lost connection, until the next measurement."""
        with self._changed:
            self._failure = failure

    @property
    def failure(self) -> str:
        """Return the reason of the lost connection, "" if the connection is not known to be lost."""
        with self._changed:
            return self._failure

    def close(self) -> None:
        """Wake the waiting threads. From now on, `wait_for_new` returns None at once."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def received_within(self, age_s: float) -> Measurement | None:
        """Return the latest measurement if it was received at most `age_s` ago, otherwise None."""
        with self._changed:
            return self._latest if time.monotonic() - self._received_s <= age_s else None

    def wait_for_new(self, counter: int | None, timeout_s: float, max_age_s: float) -> Measurement | None:
        """Return the latest measurement as soon as its sample counter differs from `counter`.

        A sample that is older than `max_age_s` is not returned: it has arrived while the caller did not wait,
        and no sample has followed. The age of the returned measurement includes the time in this slot.

        Returns None after `timeout_s` without a new sample, or if the slot is closed.
        """
        with self._changed:
            sample = self._changed.wait_for(lambda: self._closed or self._new(counter, max_age_s), timeout_s)
            return sample if isinstance(sample, Measurement) and not self._closed else None

    def _new(self, counter: int | None, max_age_s: float) -> Measurement | None:
        """Return the latest measurement with its present age; None if it is not new, or if it is too old."""
        if self._latest is None or self._latest.sample_counter in (None, counter):
            return None
        age_s = (self._latest.age_s or 0.0) + time.monotonic() - self._received_s
        return replace(self._latest, age_s=age_s) if age_s <= max_age_s else None
