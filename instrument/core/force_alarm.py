"""High alarm of the force with a hysteresis and an on-delay (ISA-18.2)."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(slots=True)
class ForceAlarm:
    """Alarm that is active while the force of a held balloon is above its limit."""

    active: bool = False
    _above_since_s: float = math.nan  # time of the first sample above the limit; NaN if the force is below

    def step(
        self, t_s: float, force_n: float, *, held: bool, limit_n: float, hysteresis_n: float, delay_s: float
    ) -> None:
        """Process one sample at the time `t_s`.

        The alarm begins when the force has been above the limit for the delay. It ends when the force is at
        or below the limit minus the hysteresis, but at the latest at 0 N, or when the balloon is not held. A
        NaN of a held balloon changes nothing: it neither ends the alarm nor restarts the delay.
        """
        if not held:
            self.active, self._above_since_s = False, math.nan
        elif math.isnan(force_n):
            return
        elif self.active:
            self.active = force_n > max(limit_n - hysteresis_n, 0.0)
        elif not force_n > limit_n:
            self._above_since_s = math.nan
        else:
            if math.isnan(self._above_since_s):
                self._above_since_s = t_s
            self.active = t_s - self._above_since_s >= delay_s
