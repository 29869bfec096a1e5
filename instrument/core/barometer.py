"""Plausibility of a written ambient pressure."""

from __future__ import annotations

#: Largest difference from the configured P_0 [kPa]. The weather changes the pressure of one place by less. A
#: pressure that was reduced to sea level differs by more above 500 m.
MAX_DEVIATION_KPA = 6.0
#: Largest difference from the last written P_0 while this value is recent [kPa]. The weather does not change
#: the pressure so fast, but a defective barometer or a wrong conversion does.
MAX_JUMP_KPA = 1.0


def is_plausible(written_kpa: float, configured_kpa: float, recent_kpa: float) -> bool:
    """Return True if a written P_0 [kPa] agrees with the configured P_0 and with the recent one.

    `recent_kpa` is NaN if no recent value was written.
    """
    near = abs(written_kpa - configured_kpa) <= MAX_DEVIATION_KPA
    return near and not abs(written_kpa - recent_kpa) > MAX_JUMP_KPA
