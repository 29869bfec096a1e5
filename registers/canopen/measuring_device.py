"""Objects of the device profile for measuring devices (CiA 404): analogue inputs.

Each object is an array with one value for each channel: sub-index 1 is the force, sub-index 2 the pressure.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pneuforce.registers.can.options import SAMPLE_RATE_HZ
from pneuforce.registers.canopen.communication import PROFILE_FIELDS, compound
from pneuforce.registers.canopen.entry import (
    DataType,
    DictionaryObject,
    ObjectCode,
    ObjectEntry,
    entry_of_field,
)
from pneuforce.registers.field import Field, WireType
from pneuforce.registers.map import BY_NAME

CHANNELS = ("force", "pressure")
#: Sensor types (6110h). Types from 10000 are manufacturer-specific.
PRESSURE_SENSOR, FORCE_FROM_PRESSURE = 90, 10_000
NORMAL_OPERATION = 1  #: operating mode (6112h)
NO_FILTER, MOVING_AVERAGE = 0, 1  #: filter types (61A0h)
#: Physical units of CiA 303-2: prefix code, then unit code.
NEWTON, KILOPASCAL = 0x0021_0000, 0x0322_0000

AI_STATUS, AUTOZERO = 0x6150, 0x6125
AUTOZERO_PRESSURE = (AUTOZERO, 2)
AUTOZERO_SIGNATURE = int.from_bytes(b"zero", "little")
FORCE_SPAN, PRESSURE_SPAN = BY_NAME["force"], BY_NAME["pressure"]

_F32, _I16, _U16, _I32 = WireType.F32, WireType.I16, WireType.U16, WireType.I32
_FORCE, _PRESSURE = BY_NAME["force_mn"], BY_NAME["pressure_pa"]
_SAMPLE_US = 1_000_000 // SAMPLE_RATE_HZ
_STATUS = {"doc": "Bit 0: not valid; bit 1: above the span end; bit 2: below the span start."}


def _array(
    index: int, name: str, data_type: DataType, access: str, *channels: Mapping[str, Any]
) -> DictionaryObject:
    """Return an array of entries without a field. `channels` has further attributes of each entry."""
    entries = tuple(
        ObjectEntry(index=index, subindex=subindex, name=channel, type=data_type, access=access, **attributes)
        for subindex, (channel, attributes) in enumerate(zip(CHANNELS, channels, strict=True), 1)
    )
    return compound(index, name, entries, ObjectCode.ARRAY)


def _constants(
    index: int, name: str, data_type: DataType, force: int, pressure: int, doc: str = ""
) -> DictionaryObject:
    channels = ({"default": value, "doc": doc} for value in (force, pressure))
    return _array(index, name, data_type, "const", *channels)


def _fields(index: int, name: str, force: Field, pressure: Field) -> DictionaryObject:
    entries = tuple(
        entry_of_field(
            field,
            index,
            subindex,
            access="ro" if field.constant is None else "const",
            mappable=(index, subindex) in PROFILE_FIELDS.values(),
        )
        for subindex, field in enumerate((force, pressure), 1)
    )
    return compound(index, name, entries, ObjectCode.ARRAY)


def _constant(name: str, unit: str, value: float | None, doc: str) -> Field:
    return Field(name=name, wire=_F32, unit=unit, constant=value, doc=doc)


MEASURING_DEVICE: tuple[DictionaryObject, ...] = (
    _constants(0x6110, "AI sensor type", DataType.U16, FORCE_FROM_PRESSURE, PRESSURE_SENSOR,
               "90: pressure sensor; 10000: no sensor, the force is computed from the pressure."),
    _constants(0x6112, "AI operating mode", DataType.U8, NORMAL_OPERATION, NORMAL_OPERATION,
               "1: normal operation."),
    _constants(0x6114, "AI ADC sample rate", DataType.U32, _SAMPLE_US, _SAMPLE_US,
               "Time between two samples [µs]."),
    _fields(
        0x6124, "AI input offset",
        _constant("force", "N", 0.0, "The force has no offset."),
        Field(name="pressure", wire=_F32, unit="kPa", quantity="zero_offset_kpa",
              doc="Offset that the zero adjustment adds to the pressure; not available before the first "
              "zero adjustment."),
    ),
    _array(AUTOZERO, "AI autozero", DataType.U32, "wo",
           {"doc": "Rejected, because the force has no zero adjustment."},
           {"doc": "6F72657Ah (zero in ASCII) runs the zero adjustment, like command 1."}),
    _fields(0x6130, "AI process value", FORCE_SPAN, PRESSURE_SPAN),
    _constants(0x6131, "AI physical unit process value", DataType.U32, NEWTON, KILOPASCAL),
    _constants(0x6132, "AI decimal digits process value", DataType.U8, 3, 3,
               "The integer process values are in thousandths of the unit: in mN and Pa."),
    _fields(0x6148, "AI span start",
            _constant("force", "N", FORCE_SPAN.low, "Lowest force of the range."),
            _constant("pressure", "kPa", PRESSURE_SPAN.low, "Lowest pressure of the range.")),
    _fields(0x6149, "AI span end",
            _constant("force", "N", FORCE_SPAN.high, "Highest force of the range."),
            _constant("pressure", "kPa", PRESSURE_SPAN.high, "Highest pressure of the range.")),
    _array(AI_STATUS, "AI status", DataType.U8, "ro", _STATUS, _STATUS),
    _constants(0x61A0, "AI filter type", DataType.U8, NO_FILTER, MOVING_AVERAGE,
               "0: no filter; 1: moving average."),
    _fields(
        0x61A1, "AI filter constant",
        Field(name="force", wire=_U16, constant=1, doc="No filter."),
        Field(name="pressure", wire=_U16, quantity="filter_samples",
              doc="n: each sample changes the pressure by 1/n of the difference to the new reading."),
    ),
    _fields(0x7130, "AI process value int16", _FORCE.with_wire_type(_I16, "mN", "force"),
            _PRESSURE.with_wire_type(_I16, "Pa", "pressure")),
    _fields(0x9130, "AI process value int32", _FORCE.with_wire_type(_I32, "mN", "force"),
            _PRESSURE.with_wire_type(_I32, "Pa", "pressure")),
)  # fmt: skip
