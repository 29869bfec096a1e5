"""Advice in the words of the command line: the name of a command replaces a register or a mode.

`registers/advice.py` contains the advice for all buses. A person at a terminal types commands instead.
"""

from __future__ import annotations

from collections.abc import Mapping

from pneuforce.client.details import LatchedFault

#: Words of the advice that name registers or modes, and the words for the command line.
_COMMAND_WORDS: Mapping[str, str] = {
    "clear, vent (mode 0), then hold (mode 1)": "then pneuforce clear, then pneuforce hold",
    "vent (mode 0), write a setpoint, then hold (mode 1)": "pneuforce vent, then pneuforce hold",
    "Then clear": "Then pneuforce clear",
    "Clear when": "Use pneuforce clear when",
    "send command 5 (pneuforce new-balloon) with its number": "use pneuforce new-balloon and its number",
    "Command 1 also takes the zero": "pneuforce zero also takes the zero",
    " (register 778)": " (pneuforce status)",
    " (register 556)": "",
    " (register 514)": "",
    "A force below the value of register 28 shows": "A force that is this small shows",
    "See bit 5 (out_of_range)": "See out_of_range",
}


def in_command_words(advice: str) -> str:
    """Return a text of `registers/advice.py`, or a message with such a text, with the names of commands."""
    for words, command_words in _COMMAND_WORDS.items():
        advice = advice.replace(words, command_words)
    return advice


def fault_values(fault: LatchedFault) -> dict[str, object]:
    """Return a fault for JSON, with the remedy in the words of the command line."""
    return fault._replace(remedy=in_command_words(fault.remedy))._asdict()
