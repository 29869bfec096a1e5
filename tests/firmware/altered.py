"""The firmware with a piece of its sketch changed, on the emulated chip."""

import subprocess
from pathlib import Path

from sim.avr.board import AvrBoard
from sim.avr.emulator import Emulator
from sim.avr.toolchain import SKETCH

ROOT = Path(__file__).parents[2]


def run(*command):
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def altered(tmp_path, **changes):
    """A board with another sketch: each text in the place of the one before it."""
    for header in SKETCH.parent.glob("*.h"):
        (tmp_path / header.name).write_bytes(header.read_bytes())
    source = SKETCH.read_text(encoding="utf-8")
    for text, other in changes.values():
        assert source.count(text) == 1, text
        source = source.replace(text, other)
    sketch, program = tmp_path / SKETCH.name, tmp_path / "altered.elf"
    sketch.write_text(source)
    run("avr-gcc", "@firmware/flags", "-x", "c", sketch, "-o", program)
    board = AvrBoard()
    board.chip = Emulator(program)
    return board


def waiting(tmp_path, condition, **changes):
    """A board whose main loop waits within a pass, while this holds."""
    return altered(tmp_path, wait=("    show();\n", f"    show();\n    while ({condition});\n"), **changes)
