"""The CAN frames as a DBC, for the tools of robot controllers.

Values are in N, kPa, mm and s; each condition of a bit field is a signal of one bit. The text is ASCII,
because DBC readers disagree about every other character.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from registers.can.frames import DEFAULT_NODE_ID, FRAMES, Frame
from registers.field import Field, plain_unit
from registers.views.facts import ascii_text, number, span

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
#: The start value is what a tool shows before the first frame: "no value", where that has a code.
_ATTRIBUTES = """\
BA_DEF_ "BusType" STRING ;
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 65535;
BA_DEF_ SG_ "GenSigStartValue" INT -32768 65535;
BA_DEF_DEF_ "BusType" "CAN";
BA_DEF_DEF_ "GenMsgCycleTime" 0;
BA_DEF_DEF_ "GenSigStartValue" 0;
BA_ "BusType" "CAN";
"""
_COMMENTS = f"""\
CM_ "Use a force only while force_valid is 1 and the counter changes; without one back off, do not push.";
CM_ BU_ {INSTRUMENT} "The pneumatic force sensor.";
CM_ BU_ {MASTER} "The robot controller, or whoever else commands.";
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
    not_available: int | None = None  #: the code that says "no value"

    def line(self, receiver: str) -> str:
        """The SG_ line; "@1" is little-endian."""
        low, high = number(self.low), number(self.high)
        sign = "-" if self.signed else "+"
        place = f"{self.start}|{self.bits}@1{sign} ({number(1 / self.scale)},0)"
        return f' SG_ {self.name} : {place} [{low}|{high}] "{self.unit}" {receiver}'


def render(node_id: int = DEFAULT_NODE_ID) -> str:
    """The DBC of the node `node_id`."""
    parts = [
        _HEAD,
        *(_message(frame, node_id) for frame in FRAMES),
        _COMMENTS + "".join(_comments(node_id)),
        _ATTRIBUTES + "".join(_cycle_times(node_id)) + "".join(_start_values(node_id)),
        "".join(_value_tables(node_id)),
    ]
    return "\n".join(parts)


def _message(frame: Frame, node_id: int) -> str:
    sender, receiver = (MASTER, INSTRUMENT) if frame.received else (INSTRUMENT, MASTER)
    head = f"BO_ {frame.base_id + node_id} {frame.name}: {frame.length} {sender}\n"
    return head + "".join(signal.line(receiver) + "\n" for signal in _signals(frame))


def _signals(frame: Frame) -> Iterator[_Signal]:
    for at, declared in frame.placed:
        if declared.bits:
            for bit in declared.bits.bits:
                yield _Signal(name=bit.name, start=8 * at + bit.number, bits=1, doc=bit.doc)
        else:
            yield _number(declared, 8 * at, may_be_absent=not frame.received)


def _number(declared: Field, start: int, may_be_absent: bool) -> _Signal:
    low, high = span(declared) or _span_of_values(declared)
    scale = declared.scale
    values = dict(declared.code_names)
    absent = declared.not_available if may_be_absent else None
    if absent is not None:
        values[int(absent)] = "not_available"
    return _Signal(
        name=declared.name,
        start=start,
        bits=8 * declared.wire.size,
        signed=(declared.wire.lowest or 0) < 0,
        scale=scale,
        low=low / scale,
        high=high / scale,
        unit=plain_unit(declared.unit),
        doc=declared.doc,
        values=values,
        not_available=None if absent is None else int(absent),
    )


def _span_of_values(declared: Field) -> tuple[float, float]:
    assert declared.values is not None
    return min(declared.values.names), max(declared.values.names)


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
                place = f"{frame.base_id + node_id} {signal.name}"
                yield f'BA_ "GenSigStartValue" SG_ {place} {signal.not_available};\n'


def _value_tables(node_id: int) -> Iterator[str]:
    for frame in FRAMES:
        for signal in _signals(frame):
            if signal.values:
                listed = " ".join(f'{code} "{name}"' for code, name in signal.values.items())
                yield f"VAL_ {frame.base_id + node_id} {signal.name} {listed} ;\n"
