"""Firmware with a modified sketch on the emulated chip."""

import subprocess
from pathlib import Path

from pneuforce.sim.avr.board import AvrBoard
from pneuforce.sim.avr.emulator import Emulator
from pneuforce.sim.avr.toolchain import SKETCH

ROOT = Path(__file__).parents[2]


def run(*command):
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def altered(tmp_path, **changes):
    """Return a board with a modified sketch. Each change is a pair (old text, new text)."""
    for header in SKETCH.parent.glob("*.h"):
        (tmp_path / header.name).write_bytes(header.read_bytes())
    source = SKETCH.read_text(encoding="utf-8")
    for old, new in changes.values():
        assert source.count(old) == 1, old
        source = source.replace(old, new)
    sketch, program = tmp_path / SKETCH.name, tmp_path / "altered.elf"
    sketch.write_text(source)
    run("avr-gcc", "@firmware/flags", "-x", "c", sketch, "-o", program)
    board = AvrBoard()
    board.chip, board._binary = Emulator(program), program
    return board


def waiting(tmp_path, condition, **changes):
    """Return a board whose main loop waits while the C condition is true."""
    return altered(
        tmp_path,
        wait=("    set_indicators();\n", f"    set_indicators();\n    while ({condition});\n"),
        **changes,
    )
