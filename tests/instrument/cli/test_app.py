"""Tests of the import of the command line, and of its characters."""

import os
import shlex
import shutil
import subprocess
import sys

import pytest

HEAVY = {"can", "numpy", "pydantic", "pymodbus", "scipy"}


def test_no_heavy_library_is_imported_before_a_command_runs():
    """Each start of a command would take this time, also of commands that do not need the library."""
    program = f"import sys, pneuforce.instrument.cli.app; print({HEAVY} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


def printed(*words, at_terminal=False):
    """Return what a command prints if the characters of the locale are only ASCII."""
    command = [sys.executable, "-m", "pneuforce", *words]
    if at_terminal:
        command = ["script", "--quiet", "--return", "--command", shlex.join(command), "/dev/null"]
    variables = os.environ | {"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    done = subprocess.run(command, capture_output=True, check=False, env=variables)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(
    "words", ["estimate --dpi 8 --dpf 9.2", "estimate --help", "sim fault --list", "config --example"]
)
def test_a_pipe_gets_all_characters_in_each_locale(words):
    assert not printed(*words.split()).decode("utf-8").isascii()


@pytest.mark.skipif(not shutil.which("script"), reason="the program script is not installed")
@pytest.mark.parametrize("words", ["estimate --dpi 8 --dpf 9.2", "sim fault --list"])
def test_a_terminal_gets_a_question_mark_for_a_character_that_it_cannot_show(words):
    output = printed(*words.split(), at_terminal=True)
    assert output.isascii()
    assert b"?" in output
