"""Measurement and its quality: the quantities that follow from one rig frame."""

from __future__ import annotations

import math
from enum import Flag, auto
from typing import NamedTuple


class Quality(Flag):
    """Reasons why a measurement is limited or has no force. Without a reason, the quality is GOOD."""

    GOOD = 0
    INTERPOLATED = auto()  #: rise below the lower range limit of the model: touch only
    #: ΔP_i outside the validated range, or calibrated force outside the plausible range: no force
    OUT_OF_RANGE = auto()
    NO_SOLUTION = auto()  #: the force law has no physical root: no force
    NOT_HOLDING = auto()  #: the balloon is not locked at a setpoint: no force
    SENSOR_FAULT = auto()  #: invalid reading of the pressure sensor: no pressure, no force
    NO_BASELINE = auto()  #: the pressure before the contact, or around the balloon, is unknown: no force
    NOT_ZEROED = auto()  #: no zero adjustment of the sensor: no force
    TESTING = auto()  #: proof test of the held balloon: no force
    FLAT = auto()  #: the balloon may be pressed flat: no force


#: Qualities of a contact that has a force.
WITH_FORCE = (Quality.GOOD, Quality.INTERPOLATED)


class Measurement(NamedTuple):
    """Quantities at one instant, from exactly one rig frame. NaN marks a missing value.

    The class is a named tuple, because it is created every 2 ms and a frozen dataclass takes twice as long.
    """

    #: Time at which the board took the sample, on the monotonic clock of the host process [s].
    t_s: float
    pressure_kpa: float = math.nan  #: filtered gauge pressure
    unfiltered_kpa: float = math.nan  #: gauge pressure as sampled, for the interlocks
    baseline_kpa: float = math.nan  #: ΔP_i of the contact in progress; without contact, the baseline
    rise_kpa: float = math.nan  #: ΔP_f − ΔP_i, with the lag-compensated ΔP_f in the balloon
    radius_mm: float = math.nan  #: inflated radius R_i before contact
    indentation_mm: float = math.nan  #: indentation d
    contact_radius_mm: float = math.nan  #: radius a of the contact area
    force_n: float = math.nan  #: contact force; if it is NaN, `quality` gives the reason
    force_std_n: float = math.nan  #: standard uncertainty of `force_n`
    force_uncompensated_n: float = math.nan  #: force from the filtered pressure, without lag compensation
    force_lower_range_limit_n: float = math.nan  #: force at the lower range limit of the model
    in_contact: bool = False
    quality: Quality = Quality.GOOD

    def without_contact_force(self, reason: Quality) -> Measurement:
        """Return the measurement with an unknown force. Contact, baseline and force alarm remain."""
        return self._replace(
            indentation_mm=math.nan,
            contact_radius_mm=math.nan,
            force_n=math.nan,
            force_std_n=math.nan,
            quality=self.quality | reason,
        )

    def without_force(self, reason: Quality = Quality.NOT_HOLDING) -> Measurement:
        """Return the pressure alone, for example because the state of the balloon is not certain."""
        return Measurement(
            t_s=self.t_s,
            pressure_kpa=self.pressure_kpa,
            unfiltered_kpa=self.unfiltered_kpa,
            quality=self.quality | reason,
        )
