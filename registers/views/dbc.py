"""CAN frames as a DBC file, for the tools of robot controllers.

Values are in N, kPa, mm and s. Each bit of a bit field is a signal of one bit. The text is ASCII, because DBC
readers handle other characters differently. The attribute MapHash is the value that an instrument of this map
sends in its Identity frame.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from pneuforce.registers.can.frames import DEFAULT_NODE_ID, FRAMES, FrameDefinition
from pneuforce.registers.document_text import ascii_text, format_number, value_range
from pneuforce.registers.field import Field, quantity_unit
from pneuforce.registers.map_hash import MAP_HASH

INSTRUMENT = "PneuForce"
MASTER = "Controller"

_HEAD = f"""\
VERSION "1"

NS_ :
\tCM_
\tBA_DEF_
\tBA_
\tVAL_
\tBA_DEF_DEF_

BS_:

BU_: {INSTRUMENT} {MASTER}
"""
#: Tools show the start value of a signal before the first frame. The start value is the not-available code of
#: the signal. If the signal has no such code, the start value is 0.
_ATTRIBUTES = f"""\
BA_DEF_ "BusType" STRING ;
BA_DEF_ "MapHash" STRING ;
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 65535;
BA_DEF_ SG_ "GenSigStartValue" INT -32768 65535;
BA_DEF_DEF_ "BusType" "CAN";
BA_DEF_DEF_ "MapHash" "";
BA_DEF_DEF_ "GenMsgCycleTime" 0;
BA_DEF_DEF_ "GenSigStartValue" 0;
BA_ "BusType" "CAN";
BA_ "MapHash" "{MAP_HASH:08x}";
"""
_COMMENTS = f"""\
CM_ "Use the force only while force_valid is 1 and the counter changes. Otherwise back off, do not push.";
CM_ BU_ {INSTRUMENT} "The pneumatic force sensor.";
CM_ BU_ {MASTER} "The robot controller, or another master.";
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Signal:
    name: str
    start: int  #: first bit in the frame
    bits: int
    signed: bool = False
    scale: float = 1.0  #: wire counts per unit
    low: float = 0.0
    high: float = 1.0
    unit: str = ""
    doc: str
    values: Mapping[int, str] = field(default_factory=dict)
    not_available: int | None = None  #: not-available code

    def line(self, receiver: str) -> str:
        """Return the SG_ line. "@1" means little-endian."""
        low, high = format_number(self.low), format_number(self.high)
        sign = "-" if self.signed else "+"
        layout = f"{self.start}|{self.bits}@1{sign} ({format_number(1 / self.scale)},0)"
        return f' SG_ {self.name} : {layout} [{low}|{high}] "{self.unit}" {receiver}'


def render(node_id: int = DEFAULT_NODE_ID) -> str:
    """Return the DBC file for the node `node_id`."""
    parts = [
        _HEAD,
        *(_message(frame, node_id) for frame in FRAMES),
        _COMMENTS + "".join(_comments(node_id)),
        _ATTRIBUTES + "".join(_cycle_times(node_id)) + "".join(_start_values(node_id)),
        "".join(_value_tables(node_id)),
    ]
    return "\n".join(parts)


def _message(frame: FrameDefinition, node_id: int) -> str:
    sender, receiver = (MASTER, INSTRUMENT) if frame.received else (INSTRUMENT, MASTER)
    head = f"BO_ {frame.base_id + node_id} {frame.name}: {frame.length} {sender}\n"
    return head + "".join(signal.line(receiver) + "\n" for signal in _signals(frame))


def _signals(frame: FrameDefinition) -> Iterator[_Signal]:
    for offset, frame_field in frame.field_offsets:
        if frame_field.bits:
            for bit in frame_field.bits.bits:
                yield _Signal(name=bit.name, start=8 * offset + bit.number, bits=1, doc=bit.doc)
        else:
            yield _number_signal(frame_field, 8 * offset, has_not_available=not frame.received)


def _number_signal(frame_field: Field, start: int, has_not_available: bool) -> _Signal:
    low, high = value_range(frame_field) or _code_range(frame_field)
    scale = frame_field.scale
    values = dict(frame_field.code_names)
    code = frame_field.not_available if has_not_available else None
    if code is not None:
        values[int(code)] = "not_available"
    return _Signal(
        name=frame_field.name,
        start=start,
        bits=8 * frame_field.wire.size,
        signed=(frame_field.wire.min_code or 0) < 0,
        scale=scale,
        low=low / scale,
        high=high / scale,
        unit=quantity_unit(frame_field.unit),
        doc=frame_field.doc,
        values=values,
        not_available=None if code is None else int(code),
    )


def _code_range(frame_field: Field) -> tuple[float, float]:
    assert frame_field.values is not None
    return min(frame_field.values.names), max(frame_field.values.names)


def _comments(node_id: int) -> Iterator[str]:
    for frame in FRAMES:
        can_id = frame.base_id + node_id
        yield f'CM_ BO_ {can_id} "{ascii_text(frame.doc)}";\n'
        for signal in _signals(frame):
            yield f'CM_ SG_ {can_id} {signal.name} "{ascii_text(signal.doc)}";\n'


def _cycle_times(node_id: int) -> Iterator[str]:
    for frame in FRAMES:
        if frame.period_s:
            yield f'BA_ "GenMsgCycleTime" BO_ {frame.base_id + node_id} {round(frame.period_s * 1e3)};\n'


def _start_values(node_id: int) -> Iterator[str]:
    for frame in FRAMES:
        for signal in _signals(frame):
            if signal.not_available is not None:
                signal_id = f"{frame.base_id + node_id} {signal.name}"
                yield f'BA_ "GenSigStartValue" SG_ {signal_id} {signal.not_available};\n'


def _value_tables(node_id: int) -> Iterator[str]:
    for frame in FRAMES:
        for signal in _signals(frame):
            if signal.values:
                listed = " ".join(f'{code} "{name}"' for code, name in signal.values.items())
                yield f"VAL_ {frame.base_id + node_id} {signal.name} {listed} ;\n"
