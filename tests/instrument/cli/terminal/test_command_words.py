"""Tests of the advice in the words of the command line: it names commands, not registers or modes."""

import re

import pytest

from pneuforce.client.rejection import rejected
from pneuforce.instrument.cli.terminal.command_words import _COMMAND_WORDS, in_command_words
from pneuforce.instrument.cli.terminal.failure import failure_text
from pneuforce.registers.advice import (
    FAULT_ADVICE,
    MAINTENANCE_ADVICE,
    REJECT_REASON_ADVICE,
    STATE_DESCRIPTIONS,
    STATUS_ADVICE,
)
from tests.command_runner import pneuforce

TEXTS = [
    *(
        text
        for table in (FAULT_ADVICE, STATUS_ADVICE, MAINTENANCE_ADVICE)
        for advice in table.values()
        for text in advice
    ),
    *REJECT_REASON_ADVICE.values(),
    *STATE_DESCRIPTIONS.values(),
]
#: Advice for the program of a master, which has no command.
FOR_PROGRAMS = ("register 518", "546 := 0")


def test_the_words_of_buses_are_replaced_and_each_replacement_is_used():
    for text in map(in_command_words, TEXTS):
        if not any(words in text for words in FOR_PROGRAMS):
            assert not re.search(r"\(mode \d|ommand \d|register \d|bit \d+ \(out|[Tt]hen clear", text), text
    assert [words for words in _COMMAND_WORDS if not any(words in text for text in TEXTS)] == []


def test_the_advice_names_only_commands_that_exist():
    named = set(re.findall(r"pneuforce ([a-z-]+)", " ".join(map(in_command_words, TEXTS))))
    assert {"clear", "hold", "new-balloon", "vent", "zero"} <= named
    shown = pneuforce("-h").stdout
    assert [command for command in named if not re.search(rf"\b{command}\b", shown)] == []


@pytest.mark.parametrize("command", ["zero_pressure", "new_balloon", "the Command zero_pressure"])
def test_the_remedy_of_a_rejected_command_does_not_inflate(command):
    text = failure_text(rejected(command, "state"))
    assert "Vent" in text
    assert "hold" not in text
    assert "pneuforce hold" in failure_text(rejected("mode = hold", "state"))
