"""The communication objects (CiA 301, 1000h to 1FFFh): identity, heartbeat, errors, SDO and PDO parameters.

PDO mapping and identifiers are fixed: a PDO can be switched off and its transmission chosen, no more.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from registers.can.frames import ANSWER, COMMAND, EMERGENCY, FORCE, STATE, STATUS_FRAME, Frame
from registers.canopen.entry import Entry, Kind, Object, Type
from registers.map import BY_NAME, MAP_VERSION

DEVICE_TYPE = 0x0002_0194  #: measuring device (CiA 404) with analogue inputs
VENDOR_ID = 0  #: none was assigned by CiA
PRODUCT_CODE = 0x5046_0001
REVISION = MAP_VERSION << 16
ERRORS_KEPT = 8
OFF = 0x8000_0000  #: bit 31 of a COB-ID: this PDO does not exist
NO_REMOTE = 0x4000_0000  #: bit 30 of a TPDO's: it cannot be asked for by a remote frame
BY_EVENT = (254, 255)
SYNCHRONOUS = range(241)  #: transmission types: 0 at the SYNC after an event, n at each n-th SYNC

#: Record of the fields of each frame, which the mapping names: TPDO 1 to 4, RPDO 1.
RECORDS = {
    FORCE.name: 0x2800,
    STATE.name: 0x2801,
    STATUS_FRAME.name: 0x2802,
    ANSWER.name: 0x2803,
    COMMAND.name: 0x2810,
}
#: Each TPDO with its inhibit time [100 µs] and event timer [ms], as in raw mode.
TPDOS: tuple[tuple[Frame, int, int], ...] = (
    (FORCE, 0, 0),
    (STATE, 0, 100),
    (STATUS_FRAME, 100, 100),
    (ANSWER, 0, 0),
)
ERROR_FIELD, MASTER, PRODUCER, ON_ERROR = (0x1003, 0), (0x1016, 1), (0x1017, 0), (0x1029, 1)
EMERGENCY_INHIBIT = (0x1015, 0)
RPDO_COB_ID = (0x1400, 1)


def tpdo_at(number: int) -> int:
    """Index of the communication parameters of a TPDO, the first being 0."""
    return 0x1800 + number


def var(index: int, name: str, of: Type, access: str = "ro", **more: Any) -> Object:
    """An object of one value."""
    entry = Entry(index=index, name=name, type=of, access=access, **more)
    return Object(index=index, name=name, kind=Kind.VAR, entries=(entry,))


def compound(index: int, name: str, entries: tuple[Entry, ...], kind: Kind = Kind.RECORD) -> Object:
    """An object of several values, with their highest sub-index at sub-index 0."""
    doc = "Highest sub-index."
    highest = Entry(
        index=index, name="Highest sub-index", type=Type.U8, access="const", default=entries[-1].sub, doc=doc
    )
    return Object(index=index, name=name, kind=kind, entries=(highest, *entries))


def _switched(cob_id: int) -> Callable[[int, int], bool]:
    """Whether a COB-ID is the one that is there, switched on or off."""
    return lambda code, node_id: code & ~OFF == cob_id + node_id


def _one_master(code: int, node_id: int) -> bool:
    return code >> 24 == 0 and code >> 16 <= 127 and (code >> 16 != node_id or code & 0xFFFF == 0)


def _cob_id(index: int, cob_id: int, sub: int = 1) -> Entry:
    return Entry(
        index=index, sub=sub, name="COB-ID", type=Type.U32, access="rw", default=cob_id, plus_node_id=True,
        allowed=_switched(cob_id), doc="Bit 31 switches the PDO off; the identifier is fixed.",
    )  # fmt: skip


def _tpdo(number: int, frame: Frame, inhibit: int, timer: int) -> Object:
    at = tpdo_at(number)
    entries = (
        _cob_id(at, frame.base_id | NO_REMOTE),
        Entry(index=at, sub=2, name="Transmission type", type=Type.U8, access="rw", default=255,
              allowed=lambda code, _: code in SYNCHRONOUS or code in BY_EVENT,
              doc="0: at the SYNC after an event; n: at each n-th SYNC, to 240; 254, 255: at events."),
        Entry(index=at, sub=3, name="Inhibit time", type=Type.U16, access="rw", default=inhibit,
              doc="Least time between two, types 254 and 255; settable while the PDO is off [100 µs]."),
        Entry(index=at, sub=5, name="Event timer", type=Type.U16, access="rw", default=timer,
              doc="Also after this time without an event, types 254 and 255; 0: no [ms]."),
    )  # fmt: skip
    return compound(at, f"TPDO{number + 1} communication parameter ({frame.name})", entries)


def _mapping(index: int, name: str, frame: Frame) -> Object:
    """Which bytes the fields of a frame are: index, sub-index and bits of each."""
    record = RECORDS[frame.name]
    entries = tuple(
        Entry(index=index, sub=sub, name=field.name, type=Type.U32, access="const",
              default=record << 16 | sub << 8 | 8 * field.wire.size)
        for sub, field in enumerate(frame.fields, 1)
    )  # fmt: skip
    return compound(index, f"{name} mapping parameter ({frame.name})", entries)


_RPDO = (
    _cob_id(RPDO_COB_ID[0], COMMAND.base_id),
    Entry(index=0x1400, sub=2, name="Transmission type", type=Type.U8, access="rw", default=255,
          allowed=lambda code, _: code in BY_EVENT, doc="A Command is taken at once: 254 or 255."),
)  # fmt: skip

_ERRORS = (
    Entry(index=0x1003, name="Number of errors", type=Type.U8, access="rw",
          allowed=lambda code, _: code == 0,
          doc="Writing 0 clears the list."),
    *(Entry(index=0x1003, sub=sub, name=f"Standard error field {sub}", type=Type.U32,
            doc="Emergency error code, the newest first.") for sub in range(1, ERRORS_KEPT + 1)),
)  # fmt: skip

_IDENTITY = (
    Entry(index=0x1018, sub=1, name="Vendor-ID", type=Type.U32, access="const", default=VENDOR_ID),
    Entry(index=0x1018, sub=2, name="Product code", type=Type.U32, access="const", default=PRODUCT_CODE),
    Entry(index=0x1018, sub=3, name="Revision number", type=Type.U32, access="const", default=REVISION,
          doc="High word: version of the register map."),
    Entry(index=0x1018, sub=4, name="Serial number", type=Type.U32, field=BY_NAME["serial_number"]),
)  # fmt: skip

_SDO_SERVER = (
    Entry(
        index=0x1200, sub=1, name="COB-ID client to server", type=Type.U32, default=0x600, plus_node_id=True
    ),
    Entry(
        index=0x1200, sub=2, name="COB-ID server to client", type=Type.U32, default=0x580, plus_node_id=True
    ),
)

COMMUNICATION: tuple[Object, ...] = (
    var(0x1000, "Device type", Type.U32, "const", default=DEVICE_TYPE,
        doc="CiA 404, analogue input."),
    var(0x1001, "Error register", Type.U8,
        doc="Bit 0 any error, bit 4 the master's heartbeat is lost, bit 7 a fault of the rig."),
    Object(index=0x1003, name="Pre-defined error field", kind=Kind.ARRAY, entries=_ERRORS),
    var(0x1005, "COB-ID SYNC", Type.U32, default=0x80),
    var(0x1008, "Manufacturer device name", Type.TEXT, "const"),
    var(0x1009, "Manufacturer hardware version", Type.TEXT, "const"),
    var(0x100A, "Manufacturer software version", Type.TEXT, "const"),
    var(0x1014, "COB-ID EMCY", Type.U32, default=EMERGENCY.base_id, plus_node_id=True),
    var(0x1015, "Inhibit time EMCY", Type.U16, "rw", default=0, doc="[100 µs]"),
    compound(0x1016, "Consumer heartbeat time", (
        Entry(index=0x1016, sub=1, name="Master", type=Type.U32, access="rw", default=0, allowed=_one_master,
              doc="Node id (bits 16 to 23) and time [ms] of the master that is watched; 0: none. "
              "Kept through a reset."),
    ), Kind.ARRAY),
    var(0x1017, "Producer heartbeat time", Type.U16, "rw", default=1000, doc="[ms]; 0: none."),
    compound(0x1018, "Identity object", _IDENTITY),
    compound(0x1029, "Error behaviour", (
        Entry(index=0x1029, sub=1, name="Communication error", type=Type.U8, access="rw", default=0, high=2,
              doc="When the master is lost: 0 to pre-operational, 1 no change, 2 to stopped."),
    ), Kind.ARRAY),
    compound(0x1200, "SDO server parameter", _SDO_SERVER),
    compound(RPDO_COB_ID[0], f"RPDO1 communication parameter ({COMMAND.name})", _RPDO),
    _mapping(0x1600, "RPDO1", COMMAND),
    *(_tpdo(number, *tpdo) for number, tpdo in enumerate(TPDOS)),
    *(_mapping(0x1A00 + number, f"TPDO{number + 1}", tpdo[0]) for number, tpdo in enumerate(TPDOS)),
)  # fmt: skip
