"""What each fault, status bit, refusal and state asks of people and programs, as a page."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from registers.advice import FAULT_ADVICE, REFUSAL_WORDS, STATE_WORDS, STATUS_ADVICE
from registers.codes import FAULTS, REFUSALS, STATES, STATUS
from registers.field import Values
from registers.views.markdown import table

_INTRODUCTION = """\
# Faults, and what to do

Made from the words that the instrument itself uses: `pneuforce map --format faults`.

**After a fault** the rig has vented and is *tripped*. Remove the cause, *clear* (register command 2, CAN mode
2, the page's button), then vent (mode 0) and hold (mode 1). Clearing moves no valve. Step by step:
[rules](rules.md#after-a-trip). Whether the balloon is empty, only you can see: where a line below says that
it may be inflated, believe it rather than a pressure of zero.

## Faults

Register 778 has the first fault that is latched; on CAN an Emergency carries FF00h + its code. Codes up to 15
are found by the board, those from 32 on by the host. In files to import: the enumeration *fault* of the
[map](registers.md#enumerations), `PF_FAULT_…` and `PNEUFORCE_FAULT_…` of the [PLC files](plc.md).
"""
_STATUS = """\
## Status bits

Register 20, the Status frame, the discrete inputs 0–31. A bit that latches stays until it is cleared once its
cause is gone; the others follow their cause.
"""
_REFUSALS = """\
## Refusals

Register 27 after an exception 06; in the Answer frame 16 more. A refused request changes nothing; only a vent
in it is carried out all the same.
"""
_STATES = """\
## States

Register 25, and the Status frame.
"""


def render() -> str:
    """The page."""
    return "\n".join(
        (
            _INTRODUCTION,
            table(("code", "fault", "what has happened", "what to do"), _faults()),
            _STATUS,
            table(("bit", "name", "latches", "what it says", "what to do"), _bits()),
            _REFUSALS,
            table(("code", "refusal", "why, and what to do"), _words(REFUSALS, REFUSAL_WORDS)),
            _STATES,
            table(("code", "state", "what is so"), _words(STATES, STATE_WORDS)),
        )
    )


def _faults() -> Iterator[Sequence[str]]:
    for code, name in FAULTS.names.items():
        if code:
            yield str(code), f"`{name}`", *FAULT_ADVICE[code]


def _bits() -> Iterator[Sequence[str]]:
    for bit in STATUS.bits:
        yield str(bit.number), f"`{bit.name}`", "latches" if bit.latches else "", *STATUS_ADVICE[bit.name]


def _words(values: Values, words: Mapping[str, str]) -> Iterable[Sequence[str]]:
    return ((str(code), f"`{name}`", words[name]) for code, name in values.names.items())
