"""All tests: `python -m tests [PYTEST ARGUMENTS]`.

The tests in real time mostly wait. The tests in virtual time run beside them, and use only processor time
that nothing else needs (scheduling policy "idle", sched(7)). Their output follows, and then all failures
once more, so that the end of a long output says what failed.
"""

import contextlib
import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
NO_TESTS = 5  # exit code of pytest if the arguments select no test of one kind
OUTPUT = ROOT / "build/virtual-time-tests.txt"
STARVED = ROOT / "build/starved-tests"
FAILURES = ROOT / "build/failed-tests.txt"
PYTEST = [sys.executable, "-m", "pytest", f"--failures={FAILURES}"]
IN_PARALLEL = [*PYTEST, "-n", "auto", "--dist", "loadfile", "--no-loadscope-reorder"]


def use_idle_time_only():
    """Let this process run only while no other process needs the processor, where the system supports it."""
    with contextlib.suppress(AttributeError, OSError):
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))


def copy_until_end(process, file):
    """Print the output of a process from its file until the process ends. Return its exit code."""
    with file.open(encoding="utf-8") as output:
        while True:
            code = process.poll()
            print(output.read(), end="", flush=True)
            if code is not None:
                return code
            time.sleep(0.5)


def run(arguments):
    """Run all tests, then the starved tests alone. Return the exit code."""
    STARVED.parent.mkdir(exist_ok=True)
    for file in (STARVED, FAILURES):
        file.unlink(missing_ok=True)
    with OUTPUT.open("w", encoding="utf-8") as output:
        in_virtual_time = subprocess.Popen(
            [*IN_PARALLEL, "--time=virtual", *arguments],
            stdout=output,
            stderr=subprocess.STDOUT,
            preexec_fn=use_idle_time_only,
        )
    try:
        print("tests in real time; the tests in virtual time run in the background", flush=True)
        codes = [subprocess.call([*IN_PARALLEL, "--time=real", f"--repeat-later={STARVED}", *arguments])]
        print("tests in virtual time", flush=True)
        codes.append(copy_until_end(in_virtual_time, OUTPUT))
    finally:
        in_virtual_time.terminate()
    if STARVED.is_file() and STARVED.stat().st_size:
        codes.append(subprocess.call([*PYTEST, f"@{STARVED}"]))
    if FAILURES.is_file():
        print(FAILURES.read_text(encoding="utf-8"), end="")
    failed = [code for code in codes if code not in (0, NO_TESTS)]
    return failed[0] if failed else min(codes)


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        sys.exit(run(sys.argv[1:]))
    sys.exit(130)
