"""The object dictionary as an electronic data sheet (CiA 306), for CANopen managers and their tools."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from registers.can.frames import FRAMES
from registers.canopen.communication import PRODUCT_CODE, REVISION, VENDOR_ID
from registers.canopen.dictionary import OBJECTS
from registers.canopen.entry import Entry, Kind, Object, Type
from registers.map import MAP_VERSION
from registers.views.facts import ascii_text, number

FILE_NAME = "pneuforce.eds"
PRODUCT_NAME = "pneumatic force sensor"
ORDER_CODE = "PF-1"
_DATE, _TIME = "11-21-2026", "12:00PM"  # of the form, not of a run: the same map gives the same file

_BIT_RATES_KBIT = {10: 0, 20: 0, 50: 0, 125: 1, 250: 1, 500: 1, 800: 0, 1000: 1}
_DUMMIES = range(1, 8)
_MANDATORY = (0x1000, 0x1001, 0x1018)
_MANUFACTURER = range(0x2000, 0x6000)

Keys = Iterable[tuple[str, object]]


def render() -> str:
    """The data sheet; identifiers are given relative to the node id."""
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
            ("RevisionNumber", _hex(REVISION, 8)),
            ("OrderCode", ORDER_CODE),
            *((f"BaudRate_{rate}", can) for rate, can in _BIT_RATES_KBIT.items()),
            ("SimpleBootUpMaster", 0),
            ("SimpleBootUpSlave", 1),
            ("Granularity", 0),
            ("DynamicChannelsSupported", 0),
            ("CompactPDO", 0),
            ("GroupMessaging", 0),
            ("NrOfRXPDO", sum(frame.received for frame in FRAMES)),
            ("NrOfTXPDO", sum(made.index in range(0x1800, 0x1A00) for made in OBJECTS)),
            ("LSS_Supported", 0),
        ),
    )
    yield "DummyUsage", ((f"Dummy{dummy:04X}", 0) for dummy in _DUMMIES)
    yield "Comments", (("Lines", 1), ("Line1", "Object 2000h + n is Modbus register n; see docs/canopen.md."))


def _objects() -> Iterator[tuple[str, Keys]]:
    mandatory = [made for made in OBJECTS if made.index in _MANDATORY]
    manufacturer = [made for made in OBJECTS if made.index in _MANUFACTURER]
    optional = [made for made in OBJECTS if made not in mandatory and made not in manufacturer]
    for name, listed in (("Mandatory", mandatory), ("Optional", optional), ("Manufacturer", manufacturer)):
        numbered = ((str(n), _hex(made.index, 4)) for n, made in enumerate(listed, 1))
        yield f"{name}Objects", (("SupportedObjects", len(listed)), *numbered)
        for made in listed:
            yield from _object(made)


def _object(made: Object) -> Iterator[tuple[str, Keys]]:
    if made.kind is Kind.VAR:
        yield f"{made.index:04X}", _entry(made.entries[0])
        return
    yield (
        f"{made.index:04X}",
        (
            ("ParameterName", ascii_text(made.name)),
            ("ObjectType", _hex(made.kind.value, 1)),
            ("SubNumber", _hex(len(made.entries), 1)),
        ),
    )
    for entry in made.entries:
        yield f"{made.index:04X}sub{entry.sub:X}", _entry(entry)


def _entry(entry: Entry) -> Iterator[tuple[str, object]]:
    yield "ParameterName", ascii_text(entry.name)
    yield "ObjectType", _hex(Kind.VAR.value, 1)
    yield "DataType", _hex(entry.type.number, 4)
    yield "AccessType", entry.access
    yield "PDOMapping", int(entry.mappable)
    if entry.type is Type.F32:
        return  # "20" is decimal to python-canopen, and the bits of a float to Lely: none is given
    default = default_text(entry)
    if default:
        yield "DefaultValue", default
    if entry.low is not None:
        yield "LowLimit", number(entry.low)
    if entry.high is not None:
        yield "HighLimit", number(entry.high)


def default_text(entry: Entry) -> str:
    """The value that an entry has when the node starts; empty where it follows the instrument."""
    if entry.field is not None and entry.field.constant is not None:
        return number(entry.field.constant)
    if entry.default is None:
        return ""
    digits = _hex(entry.default, 2 * entry.type.size)
    return f"$NODEID+{digits}" if entry.plus_node_id else digits


def _hex(value: int, digits: int) -> str:
    return f"0x{value:0{digits}X}"
