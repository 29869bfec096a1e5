"""Tests of arguments that are no valid number: the message names the value, the limits and the unit."""

import pytest

from pneuforce.instrument.cli.terminal.exit_codes import ExitCode
from tests.command_runner import pneuforce


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("set -3", "setpoint_kpa = -3 is invalid: it must be 2 to 12 kPa"),
        ("limit 50", "force_limit_n = 50 is invalid: it must be 0.1 to 20 N"),
        ("press abc", "force_n = abc is invalid: it must be 0 to 20 N"),
        ("press -1", "force_n = -1 is invalid: it must be 0 to 20 N"),
        ("export a.recording b.csv --from-s x", "--from-s = x is invalid: it must be at least 0 s"),
        ("estimate --dpi x --dpf 9", "--dpi = x is invalid: it must be a number"),
    ],
)
def test_an_invalid_number_is_named_with_its_limits(words, message):
    done = pneuforce(*words.split())
    assert done.returncode == ExitCode.USAGE
    assert done.stderr.startswith(f"pneuforce: {message}")
