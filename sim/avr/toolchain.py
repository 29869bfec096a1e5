"""What is compiled for the emulated board, kept on disk by the hash of its source."""

from __future__ import annotations

import hashlib
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from sim.kept import directory, whole

HARNESS, WIRING = (Path(__file__).with_name(name) for name in ("harness.c", "wiring.h"))
HEADERS = Path("/usr/include/simavr")
FOR_HOST = ("gcc", "-std=gnu11", "-O2", "-fPIC", "-shared")
FIRMWARE = Path(__file__).parents[2] / "firmware"
OTHER_VERSION = Path(__file__).with_name("other_version.c")  #: wants -DOTHER_VERSION=…
SKETCH, HEX, FLAGS = (FIRMWARE / name for name in ("pneuforce/pneuforce.ino", "pneuforce.hex", "flags"))


class ToolMissing(OSError):
    """A compiler or library of the emulated board is not installed, or does not take the source."""


def harness() -> Path:
    """The library around the emulator. Raises ToolMissing."""
    _need(shutil.which("gcc"), "gcc: apt-get install gcc")
    _need(HEADERS.is_dir(), "simavr: apt-get install libsimavr-dev")
    sources = [HARNESS, WIRING, HEADERS / "sim_avr.h"]
    return _compiled("harness", ".so", sources, [*FOR_HOST, str(HARNESS), "-lsimavr"])


def program(main: Path = SKETCH, *flags: str) -> Path:
    """The board's program, from this C file and the headers beside it and the sketch. Raises ToolMissing.

    Without avr-gcc the sketch is the one that came with this release, as it is flashed.
    """
    if main == SKETCH and not shutil.which("avr-gcc"):
        return HEX
    _need(shutil.which("avr-gcc"), "avr-gcc: apt-get install gcc-avr avr-libc")
    headers = {*main.parent.glob("*.h"), *SKETCH.parent.glob("*.h")}
    sources = [FLAGS, main, SKETCH, *sorted(headers)]
    return _compiled(main.stem, ".elf", sources, ["avr-gcc", f"@{FLAGS}", *flags, "-x", "c", str(main)])


def _need(there: object, what: str) -> None:
    if not there:
        raise ToolMissing(f"the emulated board needs {what}")


def _compiled(name: str, suffix: str, sources: Sequence[Path], command: Sequence[str]) -> Path:
    key = hashlib.sha256(repr(command).encode())
    for source in sources:
        key.update(source.read_bytes())
    path = directory() / f"{name}-{key.hexdigest()[:16]}{suffix}"
    if not path.exists():
        _compile(path, command)
    return path


def _compile(path: Path, command: Sequence[str]) -> None:
    with whole(path) as part:
        done = subprocess.run([*command, "-o", str(part)], capture_output=True, text=True, check=False)
        if done.returncode:
            raise ToolMissing(f"{command[0]} refuses the source: {done.stderr.strip()[:200]}")
