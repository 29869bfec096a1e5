"""A measured sample: what the board sent, and what the chain made of it."""

from __future__ import annotations

import struct
from operator import attrgetter
from typing import NamedTuple

from instrument.measurement import Measurement
from instrument.rig.link import RawSample

_LAYOUT = struct.Struct("<HIHHBBBHBHd??12d?B")
_MESSAGE = attrgetter(
    "board_time_us",
    "adc_sum",
    "supply_mv",
    "valves",
    "state",
    "fault",
    "faults",
    "command",
    "setpoint_pa",
)


class Measured(NamedTuple):
    """One sample, raw and derived; NaN where a quantity is not available."""

    # the board's frame
    sequence: int
    board_time_us: int
    adc_sum: int
    supply_mv: int
    valves: int
    state: int
    fault: int
    faults: int
    command: int
    setpoint_pa: int
    # the link
    elapsed_s: float
    frozen: bool
    clock_off: bool
    # the measurement: see instrument/measurement.py
    t_s: float
    pressure_kpa: float
    unfiltered_kpa: float
    initial_kpa: float
    rise_kpa: float
    radius_mm: float
    indentation_mm: float
    contact_radius_mm: float
    force_n: float
    force_std_n: float
    force_uncompensated_n: float
    force_low_n: float
    in_contact: bool
    quality: int


def pack(raw: RawSample, m: Measurement) -> bytes:
    """The body of a MEASURED entry."""
    *numbers, in_contact, quality = m
    link = raw.elapsed_s, raw.frozen, raw.clock_off
    return _LAYOUT.pack(raw.sequence, *_MESSAGE(raw.message), *link, *numbers, in_contact, quality.value)


def unpack(body: bytes) -> Measured:
    """The sample of a MEASURED entry. Raises struct.error where the body is of another length."""
    return Measured(*_LAYOUT.unpack(body))
