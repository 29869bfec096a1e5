"""Stream of the new samples of a connection, which also reports that samples are missing."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator

from pneuforce.client.connection import SensorConnection
from pneuforce.client.latest_sample import LatestSample
from pneuforce.client.measurement import Measurement, Status
from pneuforce.errors import ConnectionLost


def new_samples(
    connection: SensorConnection, url: str, timeout_s: float, check_open: Callable[[], None]
) -> Generator[Measurement, None, None]:
    """Yield each new sample, and an invalid measurement if no new sample arrives for about 0.1 s.

    `check_open` is called after each wait, and raises an exception if the connection was closed meanwhile.
    Raises ConnectionLost if no new sample arrives for `timeout_s`. The time for which this process was
    stopped is not counted, because nothing could arrive in this time.
    """
    counter: int | None = None
    wait_s = min(connection.silence_s, timeout_s)
    with connection.sampling() as slot:
        waiting_since_s = time.monotonic()
        while True:
            begin_s = time.monotonic()
            try:
                sample = slot.wait_for_new(counter, wait_s, connection.silence_s)
            finally:
                check_open()
            if sample is None:
                waiting_since_s += max(0.0, time.monotonic() - begin_s - wait_s)
                if time.monotonic() - waiting_since_s >= timeout_s:
                    raise ConnectionLost(_silence_message(slot, url, timeout_s))
                yield _without_sample(slot, connection)
            else:
                counter = sample.sample_counter
                yield sample
                waiting_since_s = time.monotonic()


def _silence_message(slot: LatestSample, url: str, timeout_s: float) -> str:
    cause = slot.failure or "the instrument does not answer: check the cable and the instrument"
    if slot.received_within(timeout_s):
        cause = "the instrument answers, but the rig sends no samples: check the rig and its cable"
    return f"no new sample arrived over {url} for {timeout_s:g} s; {cause}"


def _without_sample(slot: LatestSample, connection: SensorConnection) -> Measurement:
    """Return an invalid measurement, with the state and the status if they are known."""
    known = slot.received_within(connection.silence_s) or Measurement()
    status = (known.status_or_none or frozenset()) | {Status.STALE} if connection.transmits_status else None
    return Measurement(state=known.state, status_or_none=status, age_s=known.age_s)
