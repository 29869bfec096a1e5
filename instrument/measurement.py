"""A measurement: what the instrument knows at one instant, derived from exactly one rig frame."""

from __future__ import annotations

import math
from enum import Flag, auto
from typing import NamedTuple


class Quality(Flag):
    """Why a number may not be trusted; GOOD where nothing speaks against it."""

    GOOD = 0
    INTERPOLATED = auto()  #: rise below 0.5 kPa: on the line to zero
    OUT_OF_RANGE = auto()  #: ΔP_i outside the validated range: no force
    NO_SOLUTION = auto()  #: the model has no physical root: no force
    NOT_HOLDING = auto()  #: the balloon is not locked at a setpoint: no force
    SENSOR = auto()  #: the sensor cannot be believed: no pressure, no force
    NO_BASELINE = auto()  #: a contact ended that drift may have hidden: no force until the next lock
    NOT_ZEROED = auto()  #: the sensor has no zero: no force


class Measurement(NamedTuple):
    """What the instrument knows at one instant, derived from exactly one rig frame.

    A tuple, because one is made each 2 ms and a frozen dataclass takes twice as long.
    """

    t_s: float  # when the board took it, on the host's monotonic clock [s]
    pressure_kpa: float = math.nan  # filtered gauge pressure [kPa]
    unfiltered_kpa: float = math.nan  # gauge pressure as sampled, for the interlocks [kPa]
    initial_kpa: float = math.nan  # ΔP_i of the contact in progress, else the baseline [kPa]
    rise_kpa: float = math.nan  # ΔP_f − ΔP_i, ΔP_f in the balloon now [kPa]
    radius_mm: float = math.nan  # inflated radius R_i before contact [mm]
    indentation_mm: float = math.nan  # d [mm]
    contact_radius_mm: float = math.nan  # a [mm]
    force_n: float = math.nan  # contact force [N], NaN where `quality` says why
    force_std_n: float = math.nan  # standard uncertainty of force_n [N]
    force_uncompensated_n: float = math.nan  # the same from the filtered pressure, lag and all [N]
    force_low_n: float = math.nan  # force at a rise of 0.5 kPa: lower limit of the model's range [N]
    in_contact: bool = False
    quality: Quality = Quality.GOOD
