"""Check of the board's clock: each sample must have the time that its sequence number requires.

The firmware counts samples and adds 2 ms to its clock for each sample. A simulated board adds up to 2 % more
or less. Lost and late frames change nothing, because sequence number and time both count the lost samples.
"""

from __future__ import annotations

from dataclasses import dataclass

from pneuforce.protocol.frames import SAMPLES_PER_S

SAMPLE_US = 1_000_000 // SAMPLES_PER_S
TOLERANCE = 0.05  #: largest relative difference between two times that must be equal
#: The counter of wrong samples grows by `WRONG_WEIGHT` with each wrong sample and falls by 1 with each
#: correct sample. The clock is invalid from `INVALID_COUNT` on: after 8 wrong samples in a row, or if more
#: than one sample in nine is wrong. Noise that passes the CRC does not reach this count.
WRONG_WEIGHT, INVALID_COUNT, MAX_COUNT = 8, 64, 128
#: The board's clock may gain on the host's clock by the longest time for which bytes wait in a buffer. This
#: time is the host timeout, after which the rig trips anyway, plus this tolerance [s].
LEAD_TOLERANCE_S = 1.0


@dataclass(slots=True)
class ClockCheck:
    """Check of the times of all samples since the last handshake."""

    _wrong_count: int = 0
    _lead_s: float = 0.0  # time by which the board's clock has gained on the host's clock
    _received_s: float = 0.0

    @property
    def invalid(self) -> bool:
        """Return True if the clock has stopped, jumps or runs far too fast."""
        return not self._wrong_count < INVALID_COUNT

    def start(self, received_s: float, buffered_s: float = 0.0) -> None:
        """Start with the first sample after a handshake. It can have waited in a buffer for `buffered_s`."""
        self._wrong_count, self._lead_s, self._received_s = 0, -buffered_s, received_s

    def allows(
        self,
        samples: int,
        passed_us: int,
        received_s: float,
        host_timeout_s: float,
        buffered_s: float = 0.0,
    ) -> bool:
        """Return True if a sample may be used.

        `samples` is the difference of the sequence numbers since the last used sample, and `passed_us` is the
        difference of the board times. `buffered_s` is the longest time for which the sample can have waited
        in a buffer of the host: the samples of a stall arrive late, and those after it at once.

        A single wrong sample is not used. After several wrong samples the clock is invalid, and samples are
        used again, so that their faults are visible.
        """
        expected_us = samples * SAMPLE_US
        if not abs(passed_us - expected_us) <= TOLERANCE * expected_us:
            self._wrong_count = min(self._wrong_count + WRONG_WEIGHT, MAX_COUNT)
            return self.invalid
        self._wrong_count = max(self._wrong_count - 1, 0)
        host_s = (received_s - self._received_s) * (1 + TOLERANCE)
        self._received_s = received_s
        self._lead_s = max(self._lead_s + passed_us * 1e-6 - host_s, -buffered_s)
        if not self._lead_s <= host_timeout_s + LEAD_TOLERANCE_S:
            self._wrong_count, self._lead_s = MAX_COUNT, 0.0
        return True
