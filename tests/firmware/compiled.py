"""The firmware's headers, compiled for this machine and called by ctypes."""

import ctypes
import subprocess
import tempfile
from functools import cache
from pathlib import Path

from instrument.rig.frames import FRAME_BYTES, BoardKind
from sim.board.states import UNASKED, ResetCause

ROOT = Path(__file__).parents[2]
STRICT = ("-std=c11", "-O1", "-Wall", "-Wextra", "-Werror")


@cache
def library():
    """Built once in a run of the tests; it is gone with the folder that it was loaded from."""
    with tempfile.TemporaryDirectory() as folder:
        built = Path(folder) / "firmware.so"
        sources = ("-I", ROOT / "firmware/pneuforce", ROOT / "tests/firmware/shared.c")
        subprocess.run(["gcc", *STRICT, "-shared", "-fPIC", *sources, "-lm", "-o", built], check=True)
        loaded = ctypes.CDLL(str(built))
    loaded.board_new.restype = ctypes.c_void_p
    loaded.board_is_ok.restype = ctypes.c_bool
    return loaded


class CBoard:
    """The board that the firmware has in C, at the seam of `sim.board.Board`."""

    def __init__(self, serial=1, reset_cause=ResetCause.POWER_ON):
        self._c = library()
        self._board = ctypes.c_void_p(
            self._c.board_new(BoardKind.SIMULATED, serial, reset_cause in UNASKED),
        )

    @property
    def valves(self):
        return self._c.board_valves(self._board)

    @property
    def ok(self):
        """What the contact for others says."""
        return self._c.board_is_ok(self._board)

    def step(self, board_time_us, adc_sum, supply_mv, received):
        out = ctypes.c_void_p()
        time_us = ctypes.c_uint32(board_time_us & 0xFFFF_FFFF)
        count = self._c.board_take(
            self._board, time_us, adc_sum, supply_mv, received, len(received), ctypes.byref(out)
        )
        return ctypes.string_at(out, count)


def decode_in_c(stream):
    """Frames of a stream as bytes, and how many candidates were refused and how many bytes skipped."""
    frames = ctypes.create_string_buffer(len(stream) + FRAME_BYTES)
    refused, skipped = ctypes.c_uint32(), ctypes.c_uint32()
    count = library().decode_stream(stream, len(stream), frames, ctypes.byref(refused), ctypes.byref(skipped))
    found = [frames.raw[n * FRAME_BYTES : (n + 1) * FRAME_BYTES] for n in range(count)]
    return found, refused.value, skipped.value
