"""Time of the samples of a recording on the clock of the board, in seconds without an overflow."""

from __future__ import annotations

from collections.abc import Mapping

from pneuforce.instrument.recording.schema import SAMPLE_TYPES
from pneuforce.instrument.stream.sample_record import SampleRecord

WRAP_US = 2**32
#: Largest difference between the intervals of both clocks that a late delivery can cause [s]. A larger
#: difference means that the board has restarted.
MAX_LATE_S = 5.0
#: Python type of each column of an exported sample.
EXPORT_TYPES: Mapping[str, type] = {**SAMPLE_TYPES, "board_s": float}


class BoardTime:
    """Time on the clock of the board since the first sample. It never decreases."""

    def __init__(self) -> None:
        self._passed_us = 0
        self._before: SampleRecord | None = None

    def at_s(self, sample: SampleRecord) -> float:
        """Return the time of the next sample [s].

        After a restart of the board, the host clock bridges the gap.
        """
        if self._before is not None:
            passed_us = (sample.board_time_us - self._before.board_time_us) % WRAP_US
            host_us = max(round(1e6 * (sample.t_s - self._before.t_s)), 0)
            restarted = abs(passed_us - host_us) > 1e6 * MAX_LATE_S
            self._passed_us += host_us if restarted else passed_us
        self._before = sample
        return self._passed_us / 1e6
