"""Tests of commands whose output is a pipe without a reader, as after `| head -1`."""

import os
import subprocess
import sys

import pytest

from pneuforce.instrument.cli.terminal.exit_codes import ExitCode


def run_without_reader(*words):
    """Run a command whose first write to stdout fails. Return its exit code and stderr."""
    unread, written = os.pipe()
    os.close(unread)
    command = [sys.executable, "-m", "pneuforce", *map(str, words)]
    with os.fdopen(written, "w") as stdout:
        done = subprocess.run(
            command, stdout=stdout, stderr=subprocess.PIPE, text=True, timeout=60, check=False
        )
    return done.returncode, done.stderr


@pytest.mark.parametrize(
    "words",
    [
        ("map",),
        ("-h",),
        ("watch", "-h"),
        ("config", "--example"),
        ("files",),
        ("sim", "run", "--list"),
        ("estimate", "--dpi", "8", "--dpf", "9"),
    ],
)
def test_a_closed_output_ends_a_command_with_the_code_of_an_io_error_and_without_a_message(words):
    assert run_without_reader(*words) == (ExitCode.IO_ERROR, "")
