"""Which samples' force is sent: an even share of them, and at once the one with which the alarm comes."""

from __future__ import annotations

from registers.can.options import ALARMS_PER_S, RIG_RATE_HZ

_ALARM_APART = RIG_RATE_HZ // ALARMS_PER_S


class Decimation:
    """Counted in samples, so that the rate is exact whenever they come."""

    def __init__(self, rate_hz: int) -> None:
        self._rate_hz = rate_hz
        self._alarm = False
        self._since_alarm = _ALARM_APART
        self.restart()

    def restart(self) -> None:
        """Have the next sample sent."""
        self._credit = RIG_RATE_HZ - self._rate_hz

    def takes(self, *, alarm: bool) -> bool:
        """Whether to send this sample: at its turn, or because it raises the alarm."""
        self._credit += self._rate_hz
        self._since_alarm += 1
        early = alarm and not self._alarm and self._since_alarm >= _ALARM_APART
        on_turn = self._credit >= RIG_RATE_HZ
        if on_turn:
            self._credit -= RIG_RATE_HZ
        if early:
            self._since_alarm = 0
        if on_turn or early:
            self._alarm = alarm
        return on_turn or early
