"""Tests of the keys that the JSON result of a command has, in one line."""

import json

import pytest

from tests.command_runner import pneuforce
from tests.instrument.cli.terminal.test_failure import KEYS


@pytest.mark.parametrize(
    ("words", "code"),
    [
        ("estimate --dpi 8 --dpf 9.2", 0),
        ("uncertainty --dpi 8 --dpf 9.2", 0),
        ("estimate --dpi 1 --dpf 9.2", 1),
        ("estimate --dpi 8", 2),
    ],
)
def test_a_result_is_one_line_that_begins_with_the_keys_of_all_results(words, code):
    done = pneuforce(*words.split(), "--json")
    (line,) = done.stdout.splitlines()
    result = json.loads(line)
    assert list(result)[: len(KEYS)] == KEYS
    assert (done.returncode, result["exit_code"], result["ok"]) == (code, code, code == 0)
