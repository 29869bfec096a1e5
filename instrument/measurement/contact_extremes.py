"""Highest and lowest pressure of a contact, and the decision that an upturn after them is a new contact.

An upturn is a new contact if the rise in the trough was below `RELEASE_RATIO` of the peak. Otherwise the same
contact continues. The lag-compensated pressure (noise 0.02 kPa) shows a trough without lag, but in a long
contact its noise alone can look like a trough. Therefore, the smoothed reading (noise 0.0024 kPa) must show
the fall and the upturn, too.
"""

from __future__ import annotations

from dataclasses import dataclass

#: The balloon counts as released if the rise falls below this fraction of its peak.
RELEASE_RATIO = 0.3
#: Smallest upturn after a trough that starts a new contact: the larger of six times the noise and a fraction
#: of the peak.
MIN_UPTURN_KPA = 0.12
MIN_UPTURN_RATIO = 0.1
#: Smallest fall of the smoothed reading before a new contact, as a fraction of the highest rise. The reading
#: lags, so that it falls less in a short trough.
MIN_SMOOTHED_FALL_RATIO = 0.15
#: Smallest upturn of the smoothed reading: eight times its noise.
MIN_SMOOTHED_UPTURN_KPA = 0.02


@dataclass(slots=True)
class ContactExtremes:
    """Extremes of the lag-compensated pressure and of the smoothed reading since a contact began [kPa]."""

    peak_kpa: float
    trough_kpa: float  #: lowest pressure since the peak
    smoothed_peak_kpa: float
    smoothed_trough_kpa: float  #: lowest smoothed reading since its peak

    @classmethod
    def start(cls, now_kpa: float, smoothed_kpa: float) -> ContactExtremes:
        """Return the extremes at the start of a contact."""
        return cls(now_kpa, now_kpa, smoothed_kpa, smoothed_kpa)

    def step(self, now_kpa: float, smoothed_kpa: float, baseline_kpa: float) -> bool:
        """Add one sample. Return True if a new contact has begun.

        Until the smoothed reading turns upwards, an upturn above the peak does not replace the peak.
        """
        self._add_smoothed(smoothed_kpa)
        released = self._released(baseline_kpa)
        if now_kpa > self.peak_kpa and not released:
            self.peak_kpa = self.trough_kpa = now_kpa
        self.trough_kpa = min(self.trough_kpa, now_kpa)
        upturn_kpa = now_kpa - max(self.trough_kpa, baseline_kpa)
        return (
            released
            and upturn_kpa > max(MIN_UPTURN_KPA, MIN_UPTURN_RATIO * (self.peak_kpa - baseline_kpa))
            and smoothed_kpa - self.smoothed_trough_kpa > MIN_SMOOTHED_UPTURN_KPA
        )

    def _add_smoothed(self, smoothed_kpa: float) -> None:
        if smoothed_kpa > self.smoothed_peak_kpa:
            self.smoothed_peak_kpa = self.smoothed_trough_kpa = smoothed_kpa
        self.smoothed_trough_kpa = min(self.smoothed_trough_kpa, smoothed_kpa)

    def _released(self, baseline_kpa: float) -> bool:
        rise_kpa = self.peak_kpa - baseline_kpa
        fallen_kpa = self.smoothed_peak_kpa - self.smoothed_trough_kpa
        return (
            self.trough_kpa - baseline_kpa < RELEASE_RATIO * rise_kpa
            and fallen_kpa > MIN_SMOOTHED_FALL_RATIO * rise_kpa
        )
