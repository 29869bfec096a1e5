"""Test of the import of the command line."""

import subprocess
import sys

HEAVY = {"can", "numpy", "pydantic", "pymodbus", "scipy"}


def test_no_heavy_library_is_imported_before_a_command_runs():
    """Each start of a command would take this time, also of commands that do not need the library."""
    program = f"import sys, pneuforce.instrument.cli.app; print({HEAVY} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"
