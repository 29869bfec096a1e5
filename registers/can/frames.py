"""FRAMES: what the node says and hears on CAN, declared from fields of the register map.

Classic CAN, 11-bit identifiers (base + node id), little-endian; the frames of a CANopen node (CiA 301).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from registers.can.wire import CanFrame
from registers.codes import FAULTS, REFUSALS
from registers.field import Field, Values, Wire
from registers.map import BY_NAME

I16, U16, U8 = Wire.I16, Wire.U16, Wire.U8

DEFAULT_NODE_ID = 5

COMMAND_MODES = Values({0: "vent", 1: "hold", 2: "clear_faults", 3: "zero_pressure"})
REFUSED = 16  #: plus the code of the refusal
RESULTS = Values(
    {0: "accepted", 1: "length", 2: "span", 4: "renewed", 5: "sequence"}
    | {REFUSED + code: f"refused_{name}" for code, name in REFUSALS.names.items() if code}
)
NODE_STATES = Values({0: "boot_up", 4: "stopped", 5: "operational", 127: "pre_operational"})

NO_ERROR = 0x0000
MASTER_LOST = 0x8130  #: the CANopen master's heartbeat, which was watched, stays away
RIG_ERROR = 0xFF00  #: plus the code of the first fault
ERRORS = Values(
    {NO_ERROR: "no_error", MASTER_LOST: "master_lost"}
    | {RIG_ERROR + code: name for code, name in FAULTS.names.items() if code}
)
GENERIC_ERROR = 0x81  #: error register: generic and manufacturer-specific


@dataclass(frozen=True, kw_only=True)
class Frame:
    """A frame: its identifier, and its fields from the first byte on, without gaps.

    A field with a `quantity` is rendered from a snapshot; one without is the frame's own.
    """

    name: str
    base_id: int
    fields: tuple[Field, ...]
    doc: str
    most_per_s: float  #: how often it may come; the load check counts with it
    period_s: float = 0.0  #: time between two of them where nothing changes; 0: only at events
    received: bool = False  #: heard by the node; the others are sent by it

    @cached_property
    def _layout(self) -> struct.Struct:
        return struct.Struct("<" + "".join(field.wire.code for field in self.fields))

    @property
    def length(self) -> int:
        """Number of data bytes."""
        return self._layout.size

    @property
    def placed(self) -> Iterator[tuple[int, Field]]:
        """Each field with the byte that it begins at."""
        at = 0
        for field in self.fields:
            yield at, field
            at += field.wire.size

    def codes(self, data: bytes) -> dict[str, int]:
        """Wire code of each field. Raises ValueError where `data` has another length."""
        if len(data) != self.length:
            raise ValueError(f"a {self.name} frame has {self.length} bytes, not {len(data)}")
        return dict(zip((field.name for field in self.fields), self._layout.unpack(data), strict=True))


def encode(frame: Frame, snapshot: Any, **own: Any) -> bytes:
    """Data bytes of `frame`, its fields from `snapshot` except those given by name in `own`."""
    return frame._layout.pack(
        *(
            field.encode(own[field.name] if field.name in own else getattr(snapshot, field.quantity))
            for field in frame.fields
        )
    )


def decode(frame: Frame, data: bytes) -> dict[str, float | str | frozenset[str]]:
    """Value of each field by its name: in the unit of its quantity, NaN where not available.

    Raises ValueError where `data` has another length.
    """
    codes = frame.codes(data)
    return {field.name: field.decode(codes[field.name]) for field in frame.fields}


def _own(name: str, doc: str, values: Values | None = None, wire: Wire = U8) -> Field:
    return Field(name=name, wire=wire, doc=doc, values=values)


FORCE = Frame(
    name="Force",
    base_id=0x180,
    doc="TPDO1: every new sample, decimated to the configured rate (default 100 Hz), and at once the one "
    "that raises the force alarm; when samples stop, at once and then at 10 Hz with the force not available.",
    period_s=0.01,
    most_per_s=500,
    fields=(
        BY_NAME["force_mn"].on_wire(I16, "mN", "force"),
        BY_NAME["pressure_pa"].on_wire(I16, "Pa", "pressure"),
        BY_NAME["force_uncertainty_mn"].on_wire(U16, "mN", "force_uncertainty"),
        BY_NAME["condensed_status"].on_wire(U8),
        _own("counter", "One more with each Force frame; wraps."),
    ),
)
STATE = Frame(
    name="State",
    base_id=0x280,
    doc="TPDO2: at 10 Hz, at a new setpoint and at a finished contact.",
    period_s=0.1,
    most_per_s=20,
    fields=(
        BY_NAME["setpoint_pa"].on_wire(I16, "Pa", "setpoint"),
        BY_NAME["initial_pressure"].on_wire(I16, "Pa"),
        BY_NAME["radius_um"].on_wire(U16, "µm", "radius"),
        BY_NAME["peak_force_mn"].on_wire(I16, "mN", "peak_force"),
    ),
)
STATUS_FRAME = Frame(
    name="Status",
    base_id=0x380,
    doc="TPDO3: at 10 Hz and at a change of status, state or refusal, at most every 10 ms.",
    period_s=0.1,
    most_per_s=100,
    fields=(
        BY_NAME["status"],
        BY_NAME["state"].on_wire(U8),
        BY_NAME["refusal"].on_wire(U8),
        BY_NAME["contact_counter"].on_wire(U8),
        BY_NAME["sample_counter"].on_wire(U8),
    ),
)
ANSWER = Frame(
    name="Answer",
    base_id=0x480,
    doc="TPDO4: after each Command.",
    most_per_s=20,
    fields=(
        _own("sequence", "Sequence of the Command; 0 where it was too short to hold one."),
        _own("result", "What became of the Command.", RESULTS),
        BY_NAME["setpoint_pa"].on_wire(I16, "Pa", "setpoint"),
    ),
)
COMMAND = Frame(
    name="Command",
    base_id=0x200,
    doc="RPDO1, heard: what the rig should do. Mode vent is always accepted; in the others every field must "
    "be within its span.",
    received=True,
    most_per_s=20,
    fields=(
        replace(
            BY_NAME["setpoint_requested"].on_wire(U16, "Pa", "setpoint"),
            also=(0,),
            always=True,
            doc="Inflation pressure requested; 0 where the mode is not hold.",
        ),
        _own("mode", "vent, hold (inflate to the setpoint, then lock), or an order.", COMMAND_MODES),
        _own("sequence", "New for each new Command; a repeated Command only renews its lease."),
        BY_NAME["lease"],
        Field(name="reserved", wire=U16, low=0, high=0, doc="Reserved: 0."),
    ),
)
EMERGENCY = Frame(
    name="Emergency",
    base_id=0x080,
    doc="At each fault's coming and going (CiA 301).",
    most_per_s=10,
    fields=(
        Field(
            name="error_code",
            wire=U16,
            legend=ERRORS,
            doc="FF00h + code of the fault that came, 8130h: CANopen master lost; 0000h: something went.",
        ),
        _own(
            "error_register",
            "CiA 301 object 1001h: bits 0 and 7 while any fault is active, 0 and 4 while the master is lost.",
        ),
        BY_NAME["active_faults"].on_wire(U8),
        BY_NAME["status"],
    ),
)
HEARTBEAT = Frame(
    name="Heartbeat",
    base_id=0x700,
    doc="At 1 Hz; boot_up once at the start (CiA 301).",
    period_s=1.0,
    most_per_s=1,
    fields=(_own("node_state", "State of the node.", NODE_STATES),),
)

FRAMES = (FORCE, STATE, STATUS_FRAME, ANSWER, COMMAND, EMERGENCY, HEARTBEAT)


SDO_ANSWER = 0x580  #: plus the node id; in raw mode nobody sends it, in CANopen mode the node


def sent_ids(node_id: int) -> frozenset[int]:
    """Identifiers that nobody but the node `node_id` may send, whatever its mode."""
    return frozenset((SDO_ANSWER + node_id, *(f.base_id + node_id for f in FRAMES if not f.received)))


def frame_of(can_id: int, node_id: int) -> Frame | None:
    """The frame that has this identifier at the node `node_id`."""
    return next((frame for frame in FRAMES if frame.base_id + node_id == can_id), None)


def read(can_frame: CanFrame, node_id: int) -> tuple[Frame, dict[str, Any]] | None:
    """Which frame of the node `node_id` this is, and its values; None where it is none, or malformed."""
    frame = frame_of(can_frame.id, node_id)
    if frame is None or can_frame.kind or len(can_frame.data) != frame.length:
        return None
    return frame, decode(frame, can_frame.data)
