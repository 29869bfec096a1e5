"""Compilation of emulator and firmware for the emulated board, cached on disk by the hash of the sources."""

from __future__ import annotations

import hashlib
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from pneuforce.support.cache_dir import cache_directory, cached_file

HARNESS, WIRING = (Path(__file__).with_name(name) for name in ("harness.c", "wiring.h"))
HEADERS = Path("/usr/include/simavr")
GCC_COMMAND = ("gcc", "-std=gnu11", "-O2", "-fPIC", "-shared")
FIRMWARE = Path(__file__).parents[2] / "firmware"
OTHER_VERSION = Path(__file__).with_name("other_version.c")  #: C file, compiled with -DOTHER_VERSION=…
SKETCH, HEX, FLAGS = (FIRMWARE / name for name in ("pneuforce/pneuforce.ino", "pneuforce.hex", "flags"))


class ToolchainError(OSError):
    """Missing compiler or library of the emulated board, or source that the compiler rejects."""


def harness() -> Path:
    """Return the path of the compiled emulator library. Raises ToolchainError if it cannot be compiled."""
    _require(shutil.which("gcc"), "gcc: apt-get install gcc")
    _require(HEADERS.is_dir(), "simavr: apt-get install libsimavr-dev")
    sources = [HARNESS, WIRING, HEADERS / "sim_avr.h"]
    return _compiled("harness", ".so", sources, [*GCC_COMMAND, str(HARNESS), "-lsimavr"])


def program(main: Path = SKETCH, *flags: str) -> Path:
    """Return the path of a compiled program for the chip. Raises ToolchainError if it cannot be compiled.

    The program is compiled from the C file `main`, the headers in its folder, and the sketch with its
    headers. If avr-gcc is missing, the supplied binary replaces the compiled sketch. Real boards are
    flashed with the same binary.
    """
    if main == SKETCH and not shutil.which("avr-gcc"):
        return HEX
    _require(shutil.which("avr-gcc"), "avr-gcc: apt-get install gcc-avr avr-libc")
    headers = {*main.parent.glob("*.h"), *SKETCH.parent.glob("*.h")}
    sources = [FLAGS, main, SKETCH, *sorted(headers)]
    return _compiled(main.stem, ".elf", sources, ["avr-gcc", f"@{FLAGS}", *flags, "-x", "c", str(main)])


def _require(installed: object, package: str) -> None:
    if not installed:
        raise ToolchainError(f"the emulated board needs {package}")


def _compiled(name: str, suffix: str, sources: Sequence[Path], command: Sequence[str]) -> Path:
    key = hashlib.sha256(repr(command).encode())
    for source in sources:
        key.update(source.read_bytes())
    path = cache_directory() / f"{name}-{key.hexdigest()[:16]}{suffix}"
    if not path.exists():
        _compile(path, command)
    return path


def _compile(path: Path, command: Sequence[str]) -> None:
    with cached_file(path) as part:
        done = subprocess.run([*command, "-o", str(part)], capture_output=True, text=True, check=False)
        if done.returncode:
            raise ToolchainError(f"{command[0]} rejects the source: {done.stderr.strip()[:200]}")
