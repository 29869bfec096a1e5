"""Tests of the import of the command line, and of its characters."""

import os
import pty
import subprocess
import sys

import pytest

HEAVY = {"can", "numpy", "pydantic", "pymodbus", "scipy"}


def test_no_heavy_library_is_imported_before_a_command_runs():
    """Each start of a command would take this time, also of commands that do not need the library."""
    program = f"import sys, pneuforce.instrument.cli.app; print({HEAVY} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


ASCII_ONLY = os.environ | {"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}


def command(words):
    return [sys.executable, "-m", "pneuforce", *words.split()]


@pytest.mark.parametrize(
    "words", ["estimate --dpi 8 --dpf 9.2", "estimate --help", "sim fault --list", "config --example"]
)
def test_a_pipe_gets_all_characters_in_each_locale(words):
    done = subprocess.run(command(words), capture_output=True, check=True, env=ASCII_ONLY)
    assert not done.stdout.decode("utf-8").isascii()


@pytest.mark.parametrize("method", ["energetic", "membrane"])
def test_a_terminal_gets_a_question_mark_for_a_character_that_it_cannot_show(method):
    screen, terminal_end = pty.openpty()
    with open(screen, "rb", buffering=0) as output:
        words = f"estimate --dpi 8 --dpf 9.2 --method {method}"
        process = subprocess.Popen(command(words), stdout=terminal_end, env=ASCII_ONLY)
        os.close(terminal_end)
        assert process.wait(600) == 0
        shown = output.read(4096)
    assert shown.isascii()
    assert b"?" in shown
