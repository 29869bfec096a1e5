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
    ("words", "code"),
    [
        (("vent", "--port", "1"), ExitCode.UNAVAILABLE),
        (("frob",), ExitCode.USAGE),
        (("estimate", "--dpi", "8"), ExitCode.USAGE),
        (("config", "--check", "/none.toml"), ExitCode.CONFIGURATION),
    ],
)
def test_the_exit_code_is_the_same_if_the_message_cannot_be_written(words, code):
    with open("/dev/full", "w", encoding="ascii") as full:
        command = [sys.executable, "-m", "pneuforce", *words]
        done = subprocess.run(command, stdout=full, stderr=full, timeout=60, check=False)
    assert done.returncode == code


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
