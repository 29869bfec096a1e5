"""Headers of the firmware, compiled for this machine and called by ctypes."""

import ctypes
import fcntl
import os
import subprocess
import tempfile
from functools import cache
from pathlib import Path

from pneuforce.protocol.firmware_images import IMAGES
from pneuforce.protocol.frames import FRAME_BYTES, BoardKind
from pneuforce.sim.board.board import FIRMWARE_REVISION
from pneuforce.sim.board.states import UNEXPECTED_RESETS, ResetCause

ROOT = Path(__file__).parents[2]
IMAGE_CRC = IMAGES[FIRMWARE_REVISION]  #: CRC that a real board computes from its flash
STRICT = ("-std=c11", "-O1", "-Wall", "-Wextra", "-Werror")
#: Folder for coverage data of gcov; see tests/firmware/coverage.py.
COVERAGE_FOLDER = os.environ.get("PNEUFORCE_GCOV", "")


@cache
def library():
    """Compile and load the library once per test run. Its folder is deleted after loading."""
    if COVERAGE_FOLDER:
        loaded = load_for_coverage(Path(COVERAGE_FOLDER))
    else:
        with tempfile.TemporaryDirectory() as folder:
            loaded = load_from(folder)
    loaded.board_new.restype = ctypes.c_void_p
    loaded.board_new.argtypes = (ctypes.c_uint8, ctypes.c_uint32, ctypes.c_uint32, ctypes.c_bool)
    loaded.board_is_ok.restype = ctypes.c_bool
    return loaded


def load_for_coverage(folder):
    """Load the library with counters. The first process compiles; gcov adds the counters of all processes."""
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "firmware.so").exists():
            return load_from(folder, "--coverage", "-O0")
    return ctypes.CDLL(str(folder / "firmware.so"))


def load_from(folder, *options):
    """Compile the library in a folder and load it."""
    built = Path(folder) / "firmware.so"
    sources = ("-I", ROOT / "firmware/pneuforce", ROOT / "tests/firmware/shared.c")
    command = ("gcc", *STRICT, *options, "-shared", "-fPIC", *sources, "-lm", "-o", built)
    subprocess.run(command, check=True, cwd=folder)
    return ctypes.CDLL(str(built))


class CBoard:
    """Board of the C firmware with the interface of `pneuforce.sim.board.SimulatedBoard`."""

    def __init__(self, serial=1, reset_cause=ResetCause.POWER_ON):
        self._c = library()
        self._board = ctypes.c_void_p(
            self._c.board_new(BoardKind.SIMULATED, serial, IMAGE_CRC, reset_cause in UNEXPECTED_RESETS),
        )

    @property
    def valves(self):
        return self._c.board_valves(self._board)

    @property
    def ok(self):
        """Return True if the output contact "instrument OK" is closed."""
        return self._c.board_is_ok(self._board)

    def step(self, board_time_us, adc_sum, supply_mv, received):
        out = ctypes.c_void_p()
        time_us = ctypes.c_uint32(board_time_us & 0xFFFF_FFFF)
        count = self._c.board_process(
            self._board, time_us, adc_sum, supply_mv, received, len(received), ctypes.byref(out)
        )
        return ctypes.string_at(out, count)


def decode_in_c(stream):
    """Return the frames of a stream as bytes, and the numbers of rejected frames and skipped bytes."""
    frames = ctypes.create_string_buffer(len(stream) + FRAME_BYTES)
    rejected, skipped = ctypes.c_uint32(), ctypes.c_uint32()
    count = library().decode_stream(
        stream, len(stream), frames, ctypes.byref(rejected), ctypes.byref(skipped)
    )
    found = [frames.raw[n * FRAME_BYTES : (n + 1) * FRAME_BYTES] for n in range(count)]
    return found, rejected.value, skipped.value
