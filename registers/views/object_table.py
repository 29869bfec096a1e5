"""The object dictionary as a table, for people: docs/canopen-objects.md."""

from __future__ import annotations

from collections.abc import Iterator

from registers.canopen.abort import Why
from registers.canopen.dictionary import OBJECTS, REGISTERS_AT
from registers.canopen.entry import Entry, Object, Type
from registers.views.eds import default_text
from registers.views.facts import number

_HEAD = """\
# The object dictionary

Made by `pneuforce map --format objects`; for tools, the same as [EDS](pneuforce.eds).
How it is used: [canopen.md](canopen.md). N is the node id; what has no default follows the instrument.

"""
_PARTS = (
    ("Communication", range(0x1000, 0x2000)),
    ("Registers: 2000h + the address of [registers.md](registers.md)", range(REGISTERS_AT, 0x2800)),
    ("Fields of the process data", range(0x2800, 0x2F00)),
    ("Test pattern", range(0x2F00, 0x3000)),
    ("Measuring device (CiA 404)", range(0x6000, 0xA000)),
)
_COLUMNS = "| index | sub | name | type | access | default | span | meaning |\n" + 8 * "| --- " + "|\n"
_TYPES = {
    Type.I16: "int16",
    Type.U8: "uint8",
    Type.U16: "uint16",
    Type.U32: "uint32",
    Type.F32: "float32",
    Type.TEXT: "text",
}


def render() -> str:
    """The page."""
    return "\n".join(
        (_HEAD.rstrip("\n") + "\n", *(_part(name, indices) for name, indices in _PARTS), _aborts())
    )


def _part(name: str, indices: range) -> str:
    rows = (_row(made, entry) for made in OBJECTS if made.index in indices for entry in _shown(made))
    return f"## {name}\n\n{_COLUMNS}" + "".join(rows)


def _shown(made: Object) -> Iterator[Entry]:
    """Its entries, without the number of entries of those that have several."""
    return (entry for entry in made.entries if len(made.entries) == 1 or entry.sub or entry.writable)


def _row(made: Object, entry: Entry) -> str:
    name = made.name if len(made.entries) == 1 else f"{made.name}: {entry.name}"
    default = default_text(entry).replace("$NODEID", "N")
    cells = (f"{entry.index:04X}h", str(entry.sub), name, _TYPES[entry.type], entry.access, default)
    return f"| {' | '.join((*cells, _span(entry), entry.doc))} |\n"


def _span(entry: Entry) -> str:
    if entry.low is None and entry.high is None:
        return ""
    ends = [number(end) for end in (entry.low or 0, entry.high or 0)]
    return ends[0] if ends[0] == ends[1] else " … ".join(ends)


def _aborts() -> str:
    rows = "".join(f"| {why.code:08X}h | {why.sentence} |\n" for why in Why)
    return f"## Abort codes\n\n| code | says |\n| --- | --- |\n{rows}"
