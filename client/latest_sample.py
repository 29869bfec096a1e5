"""Latest sample of a connection, passed from the receiving thread to the waiting threads."""

from __future__ import annotations

import math
import threading
import time

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

    def wait_for_new(self, counter: int | None, timeout_s: float) -> Measurement | None:
        """Return the latest measurement as soon as its sample counter differs from `counter`.

        Returns None after `timeout_s` without a new sample, or if the slot is closed.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._is_new(counter) or self._closed, timeout_s)
            return self._latest if self._is_new(counter) and not self._closed else None

    def _is_new(self, counter: int | None) -> bool:
        return self._latest is not None and self._latest.sample_counter not in (None, counter)
