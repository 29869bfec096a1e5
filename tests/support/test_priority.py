"""Tests of the priority of a process, also under a system call filter as that of the systemd unit."""

import platform
import subprocess
import sys

import pytest

#: seccomp filter (BPF) that answers setpriority (141 on x86-64) with EPERM, as SystemCallFilter=~@resources.
FILTER = """
import ctypes, struct

class Program(ctypes.Structure):
    _fields_ = [("length", ctypes.c_ushort), ("code", ctypes.c_char_p)]

code = [(0x20, 0, 0, 0), (0x15, 0, 1, 141), (0x06, 0, 0, 0x00050001), (0x06, 0, 0, 0x7FFF0000)]
code = b"".join(struct.pack("HBBI", *each) for each in code)
libc = ctypes.CDLL(None)
assert libc.prctl(38, 1, 0, 0, 0) == 0
assert libc.prctl(22, 2, ctypes.byref(Program(len(code) // 8, code)), 0, 0) == 0
"""
REDUCE = """
import os
from pneuforce.support.priority import reduce_priority
reduce_priority(12)
print(os.getpriority(os.PRIO_PROCESS, 0))
"""


def run(script):
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=600, check=False
    )
    return done.stdout.strip(), done.stderr


def test_the_priority_is_reduced():
    assert run(REDUCE) == ("12", "")


@pytest.mark.skipif(platform.machine() != "x86_64", reason="the number of the system call is that of x86-64")
def test_a_process_that_may_not_change_its_priority_continues():
    niceness, error = run(FILTER + REDUCE)
    assert (niceness.isdecimal(), error) == (True, "")
