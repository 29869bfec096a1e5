"""Selection of the samples for Force frames: at a constant rate, and each sample that raises the alarm."""

from __future__ import annotations

from pneuforce.registers.can.options import MAX_ALARM_FRAMES_PER_S, SAMPLE_RATE_HZ

_SAMPLES_BETWEEN_ALARMS = SAMPLE_RATE_HZ // MAX_ALARM_FRAMES_PER_S


class ForceDecimator:
    """Decimator that counts samples, so that its rate is exact even if the samples come irregularly."""

    def __init__(self, rate_hz: int) -> None:
        self._rate_hz = rate_hz
        self._alarm = False
        self._samples_since_alarm = _SAMPLES_BETWEEN_ALARMS
        self.restart()

    def restart(self) -> None:
        """Make `selects` return True for the next sample."""
        self._credit = SAMPLE_RATE_HZ - self._rate_hz

    def selects(self, *, alarm: bool) -> bool:
        """Return True if the force of this sample must be sent, because of the rate or a new alarm."""
        self._credit += self._rate_hz
        self._samples_since_alarm += 1
        early = alarm and not self._alarm and self._samples_since_alarm >= _SAMPLES_BETWEEN_ALARMS
        due = self._credit >= SAMPLE_RATE_HZ
        if due:
            self._credit -= SAMPLE_RATE_HZ
        if early:
            self._samples_since_alarm = 0
        if due or early:
            self._alarm = alarm
        return due or early
