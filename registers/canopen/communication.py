"""Communication profile area (CiA 301, 1000h to 1FFFh): identity, heartbeat, errors, SDO and PDO parameters.

PDO mapping and COB-IDs are fixed, but each PDO can be disabled. A client can change the transmission type of
each PDO, and the inhibit time and the event timer of each TPDO.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from pneuforce.registers.can.frames import (
    ANSWER,
    COMMAND,
    EMERGENCY,
    FORCE,
    STATE,
    STATUS_FRAME,
    FrameDefinition,
)
from pneuforce.registers.canopen.entry import (
    DataType,
    DictionaryObject,
    EntryAddress,
    ObjectCode,
    ObjectEntry,
)
from pneuforce.registers.field import Field
from pneuforce.registers.map import BY_NAME, MAP_VERSION

#: Measuring device (CiA 404) with analogue inputs (bit 17) and a manufacturer-specific PDO mapping (bit 23).
DEVICE_TYPE = 0x0082_0194
VENDOR_ID = 0  #: CiA has not assigned a vendor id
PRODUCT_CODE = 0x5046_0001
REVISION = (0x1018, 3)
ERROR_HISTORY_LENGTH = 8
PDO_DISABLED = 0x8000_0000  #: bit 31 of a PDO's COB-ID
NO_RTR = 0x4000_0000  #: bit 30 of a TPDO's COB-ID: remote frames are not allowed
EVENT_DRIVEN = (254, 255)  #: transmission types that send at events
SYNCHRONOUS = range(241)  #: transmission types: 0 sends at the SYNC after an event, n at each n-th SYNC

#: Frame → index of the record with the frame's fields.
RECORDS = {
    FORCE.name: 0x2800,
    STATE.name: 0x2801,
    STATUS_FRAME.name: 0x2802,
    ANSWER.name: 0x2803,
    COMMAND.name: 0x2810,
}
#: Fields that a PDO maps from an object of the device profile, not from the record of the frame.
PROFILE_FIELDS: Mapping[tuple[str, str], EntryAddress] = {
    (FORCE.name, "force"): (0x7130, 1),
    (FORCE.name, "pressure"): (0x7130, 2),
}
#: Each TPDO with its default inhibit time [100 µs] and event timer [ms]. The defaults give the timing of
#: raw mode.
TPDOS: tuple[tuple[FrameDefinition, int, int], ...] = (
    (FORCE, 0, 0),
    (STATE, 0, 100),
    (STATUS_FRAME, 100, 100),
    (ANSWER, 0, 0),
)
ERROR_FIELD = (0x1003, 0)
EMERGENCY_INHIBIT = (0x1015, 0)
CONSUMER_HEARTBEAT, PRODUCER_HEARTBEAT = (0x1016, 1), (0x1017, 0)
STORE, RESTORE = (0x1010, 0x1011)  #: indexes of "store parameters" and "restore default parameters"
SAVE_SIGNATURE, LOAD_SIGNATURE = 0x6576_6173, 0x6461_6F6C  #: "save" and "load" in ASCII, little-endian
ERROR_BEHAVIOUR = (0x1029, 1)
RPDO_COB_ID = (0x1400, 1)
#: Indexes of the mapping parameters of the PDOs. The mappings are fixed.
PDO_MAPPINGS = frozenset((0x1600, *(0x1A00 + number for number in range(len(TPDOS)))))


def revision_number(map_hash: int) -> int:
    """Return the revision number of a node whose map has this hash."""
    return MAP_VERSION << 16 | map_hash & 0xFFFF


def tpdo_index(number: int) -> int:
    """Return the index of a TPDO's communication parameters. The first TPDO has the number 0."""
    return 0x1800 + number


def single_value(
    index: int, name: str, data_type: DataType, access: str = "ro", **more: Any
) -> DictionaryObject:
    """Return an object with one value (VAR)."""
    entry = ObjectEntry(index=index, name=name, type=data_type, access=access, **more)
    return DictionaryObject(index=index, name=name, object_code=ObjectCode.VAR, entries=(entry,))


def compound(
    index: int, name: str, entries: tuple[ObjectEntry, ...], object_code: ObjectCode = ObjectCode.RECORD
) -> DictionaryObject:
    """Return an object with several values. Sub-index 0 contains the highest sub-index."""
    highest = ObjectEntry(
        index=index,
        name="Highest sub-index",
        type=DataType.U8,
        access="const",
        default=entries[-1].subindex,
        doc="Highest sub-index.",
    )
    return DictionaryObject(index=index, name=name, object_code=object_code, entries=(highest, *entries))


def _only_disabled_changes(cob_id: int) -> Callable[[int, int], bool]:
    """Return a function that returns True for the given COB-ID, with the PDO enabled or disabled."""
    return lambda code, node_id: code & ~PDO_DISABLED == cob_id + node_id


def _is_other_node(code: int, node_id: int) -> bool:
    """Return True if a consumer heartbeat time is valid and does not refer to this node itself."""
    return code >> 24 == 0 and code >> 16 <= 127 and (code >> 16 != node_id or code & 0xFFFF == 0)


def _cob_id(index: int, cob_id: int, subindex: int = 1) -> ObjectEntry:
    return ObjectEntry(
        index=index, subindex=subindex, name="COB-ID", type=DataType.U32, access="rw", default=cob_id,
        adds_node_id=True, allowed=_only_disabled_changes(cob_id),
        doc="Bit 31 disables the PDO; all other bits are fixed.",
    )  # fmt: skip


def _tpdo(number: int, frame: FrameDefinition, inhibit: int, timer: int) -> DictionaryObject:
    index = tpdo_index(number)
    entries = (
        _cob_id(index, frame.base_id | NO_RTR),
        ObjectEntry(index=index, subindex=2, name="Transmission type", type=DataType.U8, access="rw",
                    default=255, allowed=lambda code, _: code in SYNCHRONOUS or code in EVENT_DRIVEN,
                    doc="0: at the next SYNC after an event; n = 1 to 240: at each n-th SYNC; "
                    "254, 255: at events."),
        ObjectEntry(index=index, subindex=3, name="Inhibit time", type=DataType.U16, access="rw",
                    default=inhibit, doc="Shortest time between two PDOs, for types 254 and 255; writable "
                    "only while the PDO is disabled [100 µs]."),
        ObjectEntry(index=index, subindex=5, name="Event timer", type=DataType.U16, access="rw",
                    default=timer, doc="Longest time between two PDOs, for types 254 and 255; 0: "
                    "disabled [ms]."),
    )  # fmt: skip
    return compound(index, f"TPDO{number + 1} communication parameter ({frame.name})", entries)


def mapped_fields(frame: FrameDefinition) -> Iterator[tuple[Field, EntryAddress]]:
    """Yield each field of a frame with the address of the entry that the PDO maps."""
    for subindex, field in enumerate(frame.fields, 1):
        yield field, PROFILE_FIELDS.get((frame.name, field.name), (RECORDS[frame.name], subindex))


def _mapping(index: int, name: str, frame: FrameDefinition) -> DictionaryObject:
    """Return the mapping parameter of a PDO: index, sub-index and length [bits] of each field."""
    entries = tuple(
        ObjectEntry(index=index, subindex=subindex, name=field.name, type=DataType.U32, access="const",
                    default=mapped[0] << 16 | mapped[1] << 8 | 8 * field.wire.size)
        for subindex, (field, mapped) in enumerate(mapped_fields(frame), 1)
    )  # fmt: skip
    return compound(index, f"{name} mapping parameter ({frame.name})", entries)


_RPDO = (
    _cob_id(RPDO_COB_ID[0], COMMAND.base_id),
    ObjectEntry(index=0x1400, subindex=2, name="Transmission type", type=DataType.U8, access="rw",
                default=255, allowed=lambda code, _: code in EVENT_DRIVEN,
                doc="254 or 255: each Command is executed at once."),
)  # fmt: skip

_ERRORS = (
    ObjectEntry(index=0x1003, name="Number of errors", type=DataType.U8, access="rw", default=0,
                allowed=lambda code, _: code == 0,
                doc="Number of errors in the list. Writing 0 clears the list."),
    *(ObjectEntry(index=0x1003, subindex=subindex, name=f"Standard error field {subindex}",
                  type=DataType.U32, doc="Emergency error code; field 1 has the newest code.")
      for subindex in range(1, ERROR_HISTORY_LENGTH + 1)),
)  # fmt: skip

_IDENTITY = (
    ObjectEntry(index=0x1018, subindex=1, name="Vendor-ID", type=DataType.U32, access="const",
                default=VENDOR_ID),
    ObjectEntry(index=0x1018, subindex=2, name="Product code", type=DataType.U32, access="const",
                default=PRODUCT_CODE),
    ObjectEntry(index=0x1018, subindex=3, name="Revision number", type=DataType.U32, access="const",
                doc="High word: version of the register map. Low word: low word of the map hash."),
    ObjectEntry(index=0x1018, subindex=4, name="Serial number", type=DataType.U32,
                field=BY_NAME["serial_number"]),
)  # fmt: skip

_SDO_SERVER = (
    ObjectEntry(index=0x1200, subindex=1, name="COB-ID client to server", type=DataType.U32, default=0x600,
                adds_node_id=True),
    ObjectEntry(index=0x1200, subindex=2, name="COB-ID server to client", type=DataType.U32, default=0x580,
                adds_node_id=True),
)  # fmt: skip


def _storage(index: int, name: str, verb: str, signature: int) -> DictionaryObject:
    """Return the object 1010h or 1011h. Both sub-indexes have the same effect, as no other is stored."""
    doc = f"Write {signature:08X}h to {verb}. Reads 1, or 0 if no parameter file is configured."
    entries = tuple(
        ObjectEntry(index=index, subindex=subindex, name=f"{verb.capitalize()} {which} parameters",
                    type=DataType.U32, access="rw", doc=doc)
        for subindex, which in ((1, "all"), (2, "communication"))
    )  # fmt: skip
    return compound(index, name, entries, ObjectCode.ARRAY)


COMMUNICATION: tuple[DictionaryObject, ...] = (
    single_value(0x1000, "Device type", DataType.U32, "const", default=DEVICE_TYPE,
                 doc="Measuring device (CiA 404): analogue inputs, manufacturer-specific PDO mapping."),
    single_value(0x1001, "Error register", DataType.U8,
                 doc="Bit 0: any error; bit 4: heartbeat of the master lost; bit 7: fault of the rig."),
    DictionaryObject(index=0x1003, name="Pre-defined error field", object_code=ObjectCode.ARRAY,
                     entries=_ERRORS),
    single_value(0x1005, "COB-ID SYNC", DataType.U32, default=0x80),
    single_value(0x1008, "Manufacturer device name", DataType.TEXT, "const"),
    single_value(0x1009, "Manufacturer hardware version", DataType.TEXT, "const"),
    single_value(0x100A, "Manufacturer software version", DataType.TEXT, "const"),
    _storage(STORE, "Store parameters", "save", SAVE_SIGNATURE),
    _storage(RESTORE, "Restore default parameters", "restore", LOAD_SIGNATURE),
    single_value(0x1014, "COB-ID EMCY", DataType.U32, default=EMERGENCY.base_id, adds_node_id=True),
    single_value(0x1015, "Inhibit time EMCY", DataType.U16, "rw", default=0, doc="[100 µs]"),
    compound(0x1016, "Consumer heartbeat time", (
        ObjectEntry(index=0x1016, subindex=1, name="Master", type=DataType.U32, access="rw", default=0,
                    allowed=_is_other_node,
                    doc="Node id (bits 16 to 23) and heartbeat time [ms] of the monitored master; "
                    "0: disabled. A reset of the node does not end a monitoring that has started."),
    ), ObjectCode.ARRAY),
    single_value(0x1017, "Producer heartbeat time", DataType.U16, "rw", default=1000,
                 doc="[ms]; 0: disabled."),
    compound(0x1018, "Identity object", _IDENTITY),
    compound(0x1029, "Error behaviour", (
        ObjectEntry(index=0x1029, subindex=1, name="Communication error", type=DataType.U8, access="rw",
                    default=0, high=2,
                    doc="State after a loss of the master: 0 pre-operational, 1 unchanged, 2 stopped."),
    ), ObjectCode.ARRAY),
    compound(0x1200, "SDO server parameter", _SDO_SERVER),
    compound(RPDO_COB_ID[0], f"RPDO1 communication parameter ({COMMAND.name})", _RPDO),
    _mapping(0x1600, "RPDO1", COMMAND),
    *(_tpdo(number, *tpdo) for number, tpdo in enumerate(TPDOS)),
    *(_mapping(0x1A00 + number, f"TPDO{number + 1}", tpdo[0]) for number, tpdo in enumerate(TPDOS)),
)  # fmt: skip
