"""Definitions of the CAN frames of the node, made from fields of the register map.

Classic CAN, 11-bit identifiers (base identifier + node id), little-endian. The frames are those of a CANopen
node (CiA 301).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from pneuforce.registers.can.wire import CanFrame
from pneuforce.registers.codes import FAULTS, REJECT_REASONS
from pneuforce.registers.field import Enumeration, Field, WireType
from pneuforce.registers.map import BY_NAME

I16, U16, U8 = WireType.I16, WireType.U16, WireType.U8

DEFAULT_NODE_ID = 5

COMMAND_MODES = Enumeration({0: "vent", 1: "hold", 2: "clear_faults", 3: "zero_pressure", 4: "lease"})
REJECTED = 16  #: result of a rejected Command: 16 plus the code of the reject reason
RESULTS = Enumeration(
    {0: "accepted", 1: "invalid_length", 2: "out_of_range", 4: "renewed", 5: "sequence_reused"}
    | {REJECTED + code: f"rejected_{name}" for code, name in REJECT_REASONS.names.items() if code}
)
NODE_STATES = Enumeration({0: "boot_up", 4: "stopped", 5: "operational", 127: "pre_operational"})

NO_ERROR = 0x0000
MASTER_LOST = 0x8130  #: the heartbeat of the CANopen master is missing
STORED_PARAMETERS = 0x6300  #: the stored parameters cannot be used (CANopen only)
PDO_TOO_SHORT, PDO_TOO_LONG = 0x8210, 0x8220  #: a Command has a wrong length (CANopen only)
RIG_ERROR = 0xFF00  #: error code of a fault: FF00h plus the code of the fault
ERRORS = Enumeration(
    {
        NO_ERROR: "no_error",
        STORED_PARAMETERS: "stored_parameters",
        MASTER_LOST: "master_lost",
        PDO_TOO_SHORT: "pdo_too_short",
        PDO_TOO_LONG: "pdo_too_long",
    }
    | {RIG_ERROR + code: name for code, name in FAULTS.names.items() if code}
)
GENERIC_ERROR = 0x81  #: bits of the error register: generic error, manufacturer-specific error


@dataclass(frozen=True, kw_only=True)
class FrameDefinition:
    """Identifier and fields of a frame. The fields begin at byte 0 and have no gaps.

    A field with a `quantity` is encoded from a snapshot. The node supplies the value of any other field.
    """

    name: str
    base_id: int
    fields: tuple[Field, ...]
    doc: str
    max_rate_hz: float  #: highest rate, from which the bus load is calculated
    period_s: float = 0.0  #: time between two frames if nothing changes; 0: sent only at events
    received: bool = False  #: True: received by the node; False: sent by the node

    @cached_property
    def _layout(self) -> struct.Struct:
        return struct.Struct("<" + "".join(field.wire.code for field in self.fields))

    @property
    def length(self) -> int:
        """Return the number of data bytes."""
        return self._layout.size

    @property
    def field_offsets(self) -> Iterator[tuple[int, Field]]:
        """Yield each field with the number of its first byte."""
        offset = 0
        for field in self.fields:
            yield offset, field
            offset += field.wire.size

    def codes(self, data: bytes) -> dict[str, int]:
        """Return the wire codes of all fields, by field name.

        Raises ValueError if `data` has the wrong length.
        """
        if len(data) != self.length:
            raise ValueError(f"a {self.name} frame has {self.length} bytes, not {len(data)}")
        return dict(zip((field.name for field in self.fields), self._layout.unpack(data), strict=True))


def encode(frame: FrameDefinition, snapshot: Any, **node_values: Any) -> bytes:
    """Return the data bytes of `frame`.

    `node_values` contains values by field name. All other values come from `snapshot`.
    """
    return frame._layout.pack(
        *(
            field.encode(
                node_values[field.name] if field.name in node_values else getattr(snapshot, field.quantity)
            )
            for field in frame.fields
        )
    )


def decode(frame: FrameDefinition, data: bytes) -> dict[str, float | str | frozenset[str]]:
    """Return the values of all fields, by field name. Each value is in the unit of its quantity.

    A value that is not available is NaN. Raises ValueError if `data` has the wrong length.
    """
    codes = frame.codes(data)
    return {field.name: field.decode(codes[field.name]) for field in frame.fields}


def _node_field(name: str, doc: str, values: Enumeration | None = None, wire: WireType = U8) -> Field:
    return Field(name=name, wire=wire, doc=doc, values=values)


FORCE = FrameDefinition(
    name="Force",
    base_id=0x180,
    doc="TPDO1: sent at the configured rate (100 Hz by default), and at once when the force alarm begins. If "
    "the samples stop, it follows 100 ms after the last sample and then at 10 Hz, without a valid force.",
    period_s=0.01,
    max_rate_hz=500,
    fields=(
        BY_NAME["force_mn"].with_wire_type(I16, "mN", "force"),
        BY_NAME["pressure_pa"].with_wire_type(I16, "Pa", "pressure"),
        BY_NAME["force_uncertainty_mn"].with_wire_type(U16, "mN", "force_uncertainty"),
        BY_NAME["condensed_status"].with_wire_type(U8),
        _node_field("counter", "Increases by 1 with each Force frame. Wraps to 0."),
    ),
)
STATE = FrameDefinition(
    name="State",
    base_id=0x280,
    doc="TPDO2: sent at 10 Hz, and also when the setpoint changes and when a peak is complete.",
    period_s=0.1,
    max_rate_hz=20,
    fields=(
        BY_NAME["setpoint_pa"].with_wire_type(I16, "Pa", "setpoint"),
        BY_NAME["baseline_pressure"].with_wire_type(I16, "Pa"),
        BY_NAME["radius_um"].with_wire_type(U16, "µm", "radius"),
        BY_NAME["peak_force_mn"].with_wire_type(I16, "mN", "peak_force"),
    ),
)
STATUS_FRAME = FrameDefinition(
    name="Status",
    base_id=0x380,
    doc="TPDO3: sent at 10 Hz, and also when the status, the state or the reject reason changes, but at most "
    "every 10 ms.",
    period_s=0.1,
    max_rate_hz=100,
    fields=(
        BY_NAME["status"],
        BY_NAME["state"].with_wire_type(U8),
        BY_NAME["reject_reason"].with_wire_type(U8),
        BY_NAME["contact_counter"].with_wire_type(U8),
        BY_NAME["sample_counter"].with_wire_type(U8),
    ),
)
ANSWER = FrameDefinition(
    name="Answer",
    base_id=0x480,
    doc="TPDO4: sent after each Command.",
    max_rate_hz=20,
    fields=(
        _node_field("sequence", "Sequence number of the Command; 0 if the Command has fewer than 4 bytes."),
        _node_field("result", "Result of the Command.", RESULTS),
        BY_NAME["setpoint_pa"].with_wire_type(I16, "Pa", "setpoint"),
    ),
)
COMMAND = FrameDefinition(
    name="Command",
    base_id=0x200,
    doc="RPDO1: received by the instrument. Mode vent is always accepted. In any other mode, each field must "
    "be within its range.",
    received=True,
    max_rate_hz=20,
    fields=(
        replace(
            BY_NAME["setpoint_requested"].with_wire_type(U16, "Pa", "setpoint"),
            also_allowed=(0,),
            always_available=True,
            doc="Requested setpoint; 0 if the mode is not hold.",
        ),
        _node_field(
            "mode",
            "Mode: vent, hold (inflate, then close both valves), a command, or lease (write only the lease "
            "time).",
            COMMAND_MODES,
        ),
        _node_field(
            "sequence",
            "Different sequence number in each new Command. A repeated Command only renews its lease.",
        ),
        BY_NAME["lease"],
        BY_NAME["proof_test"],
    ),
)
EMERGENCY = FrameDefinition(
    name="Emergency",
    base_id=0x080,
    doc="Sent when a fault occurs and when a fault has gone (CiA 301).",
    max_rate_hz=10,
    fields=(
        Field(
            name="error_code",
            wire=U16,
            legend=ERRORS,
            doc="FF00h + code of the new fault; 0000h: an error is gone. CANopen only: 8130h: master lost; "
            "8210h, 8220h: a Command is too short or too long; 6300h: stored parameters are not used.",
        ),
        _node_field(
            "error_register",
            "Object 1001h (CiA 301): bits 0 and 7 during any fault, bits 0 and 4 during error 8xxxh.",
        ),
        BY_NAME["active_fault_count"].with_wire_type(U8),
        BY_NAME["status"],
    ),
)
HEARTBEAT = FrameDefinition(
    name="Heartbeat",
    base_id=0x700,
    doc="Sent at 1 Hz. At the start, the state boot_up is sent once (CiA 301).",
    period_s=1.0,
    max_rate_hz=1,
    fields=(_node_field("node_state", "State of the node.", NODE_STATES),),
)
IDENTITY = FrameDefinition(
    name="Identity",
    base_id=0x500,
    doc="Sent at 1 Hz in raw mode, not in CANopen mode: which map the frames follow, and which instrument "
    "sends them.",
    period_s=1.0,
    max_rate_hz=1,
    fields=(BY_NAME["map_hash"], BY_NAME["serial_number"]),
)

FRAMES = (FORCE, STATE, STATUS_FRAME, ANSWER, COMMAND, IDENTITY, EMERGENCY, HEARTBEAT)

SDO_RESPONSE = 0x580  #: base identifier; sent only in CANopen mode, but reserved in raw mode, too


def transmit_ids(node_id: int) -> frozenset[int]:
    """Return the identifiers that only the node `node_id` may send, in both modes."""
    return frozenset((SDO_RESPONSE + node_id, *(f.base_id + node_id for f in FRAMES if not f.received)))


def find_frame(can_id: int, node_id: int) -> FrameDefinition | None:
    """Return the definition of the frame that the node `node_id` uses with this identifier, or None."""
    return next((frame for frame in FRAMES if frame.base_id + node_id == can_id), None)


def decode_frame(can_frame: CanFrame, node_id: int) -> tuple[FrameDefinition, dict[str, Any]] | None:
    """Return the definition and the values of a frame of the node `node_id`.

    Returns None if the frame belongs to another node or is malformed.
    """
    frame = find_frame(can_frame.id, node_id)
    if frame is None or can_frame.kind or len(can_frame.data) != frame.length:
        return None
    return frame, decode(frame, can_frame.data)
