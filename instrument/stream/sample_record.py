"""Record of one sample: the frame from the board and the measurement that was computed from it."""

from __future__ import annotations

import struct
from operator import attrgetter
from typing import NamedTuple

from pneuforce.instrument.measurement.measurement import Measurement
from pneuforce.instrument.rig.link import RawSample

_LAYOUT = struct.Struct("<HIHHBBBHBHd??12d?H")
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


class SampleRecord(NamedTuple):
    """One sample, raw and measured. A quantity that is not available is NaN."""

    # Fields from the frame of the board.
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
    # Fields that the link computes.
    elapsed_s: float
    clock_invalid: bool
    clock_off: bool
    # Fields of the measurement, see instrument/measurement/measurement.py.
    t_s: float
    pressure_kpa: float
    unfiltered_kpa: float
    baseline_kpa: float
    rise_kpa: float
    radius_mm: float
    indentation_mm: float
    contact_radius_mm: float
    force_n: float
    force_std_n: float
    force_uncompensated_n: float
    force_lower_range_limit_n: float
    in_contact: bool
    quality: int


def pack(raw: RawSample, m: Measurement) -> bytes:
    """Return the body of a SAMPLE entry."""
    *numbers, in_contact, quality = m
    link = raw.elapsed_s, raw.clock_invalid, raw.clock_off
    return _LAYOUT.pack(raw.sequence, *_MESSAGE(raw.message), *link, *numbers, in_contact, quality.value)


def is_valid(sample: SampleRecord) -> bool:
    """Return True if each field has a type and a value that a SAMPLE entry can contain."""
    try:
        _LAYOUT.pack(*sample)
    except struct.error:
        return False
    return True


def unpack(body: bytes) -> SampleRecord:
    """Return the sample of a SAMPLE entry. Raises struct.error if the body has the wrong length."""
    return SampleRecord(*_LAYOUT.unpack(body))
