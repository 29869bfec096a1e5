"""Object dictionary as an electronic data sheet (EDS, CiA 306), for CANopen configuration tools."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from pneuforce.registers.can.frames import FRAMES
from pneuforce.registers.canopen.communication import PRODUCT_CODE, REVISION, VENDOR_ID, revision_number
from pneuforce.registers.canopen.entry import DataType, DictionaryObject, ObjectCode, ObjectEntry
from pneuforce.registers.canopen.object_dictionary import OBJECTS
from pneuforce.registers.document_text import ascii_text, format_number
from pneuforce.registers.map import MAP_VERSION
from pneuforce.registers.map_hash import MAP_HASH

FILE_NAME = "pneuforce.eds"
PRODUCT_NAME = "pneumatic force sensor"
ORDER_CODE = "PF-1"
_DATE, _TIME = "11-21-2026", "12:00PM"  # constant, so that the same map gives the same file

#: Bit rate [kbit/s] → 1 if supported.
_BIT_RATES_KBIT = {10: 0, 20: 0, 50: 0, 125: 1, 250: 1, 500: 1, 800: 0, 1000: 1}
_DUMMIES = range(1, 8)
_MANDATORY = (0x1000, 0x1001, 0x1018)
_MANUFACTURER = range(0x2000, 0x6000)

Keys = Iterable[tuple[str, object]]


def render() -> str:
    """Return the data sheet. CAN identifiers are relative to the node id."""
    sections = [*_head(), *_objects()]
    return "\n".join(
        f"[{name}]\n" + "".join(f"{key}={value}\n" for key, value in keys) for name, keys in sections
    )


def _head() -> Iterator[tuple[str, Keys]]:
    yield (
        "FileInfo",
        (
            ("FileName", FILE_NAME),
            ("FileVersion", MAP_VERSION),
            ("FileRevision", 0),
            ("EDSVersion", "4.0"),
            ("Description", "Pneumatic force sensor: register map and process data"),
            ("CreationTime", _TIME),
            ("CreationDate", _DATE),
            ("CreatedBy", "pneuforce map --format eds"),
            ("ModificationTime", _TIME),
            ("ModificationDate", _DATE),
            ("ModifiedBy", "pneuforce map --format eds"),
        ),
    )
    yield (
        "DeviceInfo",
        (
            ("VendorName", "pneuforce"),
            ("VendorNumber", _hex(VENDOR_ID, 8)),
            ("ProductName", PRODUCT_NAME),
            ("ProductNumber", _hex(PRODUCT_CODE, 8)),
            ("RevisionNumber", _hex(revision_number(MAP_HASH), 8)),
            ("OrderCode", ORDER_CODE),
            *((f"BaudRate_{rate}", supported) for rate, supported in _BIT_RATES_KBIT.items()),
            ("SimpleBootUpMaster", 0),
            ("SimpleBootUpSlave", 1),
            ("Granularity", 0),
            ("DynamicChannelsSupported", 0),
            ("CompactPDO", 0),
            ("GroupMessaging", 0),
            ("NrOfRXPDO", sum(frame.received for frame in FRAMES)),
            ("NrOfTXPDO", sum(object_.index in range(0x1800, 0x1A00) for object_ in OBJECTS)),
            ("LSS_Supported", 1),
        ),
    )
    yield "DummyUsage", ((f"Dummy{dummy:04X}", 0) for dummy in _DUMMIES)
    yield (
        "Comments",
        (
            ("Lines", 2),
            ("Line1", "Object 2000h + n is Modbus register n; see docs/canopen.md."),
            ("Line2", f"Map hash {MAP_HASH:08x}: compare with object 2302h."),
        ),
    )


def _objects() -> Iterator[tuple[str, Keys]]:
    mandatory = [object_ for object_ in OBJECTS if object_.index in _MANDATORY]
    manufacturer = [object_ for object_ in OBJECTS if object_.index in _MANUFACTURER]
    optional = [object_ for object_ in OBJECTS if object_ not in mandatory and object_ not in manufacturer]
    for name, listed in (("Mandatory", mandatory), ("Optional", optional), ("Manufacturer", manufacturer)):
        numbered = ((str(n), _hex(object_.index, 4)) for n, object_ in enumerate(listed, 1))
        yield f"{name}Objects", (("SupportedObjects", len(listed)), *numbered)
        for object_ in listed:
            yield from _object(object_)


def _object(object_: DictionaryObject) -> Iterator[tuple[str, Keys]]:
    if object_.object_code is ObjectCode.VAR:
        yield f"{object_.index:04X}", _entry(object_.entries[0])
        return
    yield (
        f"{object_.index:04X}",
        (
            ("ParameterName", ascii_text(object_.name)),
            ("ObjectType", _hex(object_.object_code.value, 1)),
            ("SubNumber", _hex(len(object_.entries), 1)),
        ),
    )
    for entry in object_.entries:
        yield f"{object_.index:04X}sub{entry.subindex:X}", _entry(entry)


def _entry(entry: ObjectEntry) -> Iterator[tuple[str, object]]:
    yield "ParameterName", ascii_text(entry.name)
    yield "ObjectType", _hex(ObjectCode.VAR.value, 1)
    yield "DataType", _hex(entry.type.number, 4)
    yield "AccessType", entry.access
    yield "PDOMapping", int(entry.mappable)
    # Floats get no default and no limits: python-canopen reads "20" as a decimal number, Lely as the bits of
    # a float.
    if entry.type is DataType.F32:
        return
    default = default_text(entry)
    if default:
        yield "DefaultValue", default
    if entry.low is not None:
        yield "LowLimit", format_number(entry.low)
    if entry.high is not None:
        yield "HighLimit", format_number(entry.high)


def default_text(entry: ObjectEntry) -> str:
    """Return the value of an entry when the node starts; empty if the instrument supplies the value."""
    if entry.field is not None and entry.field.constant is not None:
        return format_number(entry.field.constant)
    if entry.name == "map_hash":
        return format_number(MAP_HASH)
    if entry.address == REVISION:
        return _hex(revision_number(MAP_HASH), 8)
    if entry.default is None:
        return ""
    digits = _hex(entry.default, 2 * entry.type.size)
    return f"$NODEID+{digits}" if entry.adds_node_id else digits


def _hex(value: int, digits: int) -> str:
    return f"0x{value:0{digits}X}"
