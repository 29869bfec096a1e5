"""Page docs/faults.md: faults, status bits, reject reasons and states, with their remedies."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from pneuforce.registers.advice import (
    FAULT_ADVICE,
    REJECT_REASON_ADVICE,
    STATE_DESCRIPTIONS,
    STATUS_ADVICE,
)
from pneuforce.registers.codes import FAULTS, REJECT_REASONS, STATES, STATUS
from pneuforce.registers.field import Enumeration
from pneuforce.registers.views.markdown import table

_INTRODUCTION = """\
# Faults and remedies

Generated from the texts that the instrument itself uses: `pneuforce map --format faults`.

**After a fault** the rig has vented and is *tripped*. Remove the cause. Then *clear* (register command 2,
CAN mode 2, or the button on the web page), vent (mode 0) and hold (mode 1). Clearing moves no valve. The
[rules](rules.md#after-a-trip) describe each step.

No sensor shows whether the balloon is really empty: look at the balloon. If a line below says that the
balloon may be inflated, do not rely on a pressure reading of zero.

## Faults

Register 778 contains the first-out fault. On CAN, an Emergency frame contains FF00h + the code of the fault.
The board detects the faults with codes up to 15. The host process detects the faults with codes from 32.
Names for programs are in the enumeration *fault* of the [map](registers.md#enumerations), and in the
[PLC files](plc.md) (`PF_FAULT_…` and `PNEUFORCE_FAULT_…`).
"""
_STATUS = """\
## Status bits

Register 20, the Status frame, and the discrete inputs 0–31. A bit that *latches* stays set until a command
clears it, even if its cause is gone. Any other bit is set only while its cause is present.
"""
_REJECT_REASONS = """\
## Reject reasons

After an exception 06, register 27 contains one of these codes. The result in the Answer frame is the
code + 16. A rejected request changes nothing, but a vent in a rejected request is still carried out.
"""
_STATES = """\
## States

Register 25 and the Status frame contain the state.
"""


def render() -> str:
    """Return the page."""
    return "\n".join(
        (
            _INTRODUCTION,
            table(("code", "fault", "what has happened", "what to do"), _fault_rows()),
            _STATUS,
            table(("bit", "name", "latches", "meaning", "what to do"), _status_rows()),
            _REJECT_REASONS,
            table(
                ("code", "reject_reason", "cause, and what to do"),
                _enumeration_rows(REJECT_REASONS, REJECT_REASON_ADVICE),
            ),
            _STATES,
            table(("code", "state", "meaning"), _enumeration_rows(STATES, STATE_DESCRIPTIONS)),
        )
    )


def _fault_rows() -> Iterator[Sequence[str]]:
    for code, name in FAULTS.names.items():
        if code:
            yield str(code), f"`{name}`", *FAULT_ADVICE[code]


def _status_rows() -> Iterator[Sequence[str]]:
    for bit in STATUS.bits:
        yield str(bit.number), f"`{bit.name}`", "latches" if bit.latches else "", *STATUS_ADVICE[bit.name]


def _enumeration_rows(values: Enumeration, texts: Mapping[str, str]) -> Iterable[Sequence[str]]:
    return ((str(code), f"`{name}`", texts[name]) for code, name in values.names.items())
