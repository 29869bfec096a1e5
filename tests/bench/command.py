"""Benchmark of the start of the command line."""

import statistics
import subprocess
import sys
import time


def seconds_of(command):
    begun_s = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - begun_s


def bench_estimate(brief=False):
    """Print the duration of the command `pneuforce estimate`, and of an empty Python process."""
    command = [sys.executable, "-m", "pneuforce", "estimate", "--dpi", "8", "--dpf", "9"]
    mine = [seconds_of(command) for _ in range(1 if brief else 10)]
    bare = [seconds_of([sys.executable, "-c", "pass"]) for _ in range(1 if brief else 10)]
    print(
        f"pneuforce estimate in a new process: median {statistics.median(mine):.3f} s, "
        f"worst {max(mine):.3f} s (target 0.5 s); "
        f"for comparison, an empty Python process {statistics.median(bare):.3f} s"
    )
