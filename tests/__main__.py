"""All tests: `python -m tests [PYTEST ARGUMENTS]`.

First the tests in real time, because they fail beside other work. Then the tests in virtual time, then the
starved tests alone. All failures are printed once more, so that the end of a long output says what failed.
"""

import contextlib
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
NO_TESTS = 5  # exit code of pytest if the arguments select no test of one kind
STARVED = ROOT / "build/starved-tests"
FAILURES = ROOT / "build/failed-tests.txt"
PYTEST = [sys.executable, "-m", "pytest", f"--failures={FAILURES}"]
IN_PARALLEL = [*PYTEST, "-n", "auto", "--dist", "loadfile", "--no-loadscope-reorder"]


def run(arguments):
    """Run all tests, then the starved tests alone. Return the exit code."""
    STARVED.parent.mkdir(exist_ok=True)
    for file in (STARVED, FAILURES):
        file.unlink(missing_ok=True)
    codes = []
    for time, options in [("real", [f"--repeat-later={STARVED}"]), ("virtual", [])]:
        print(f"tests in {time} time", flush=True)
        codes.append(subprocess.call([*IN_PARALLEL, f"--time={time}", *options, *arguments]))
    if STARVED.is_file() and STARVED.stat().st_size:
        print("starved tests, alone", flush=True)
        codes.append(subprocess.call([*PYTEST, f"@{STARVED}"]))
    if FAILURES.is_file():
        print(FAILURES.read_text(encoding="utf-8"), end="")
    failed = [code for code in codes if code not in (0, NO_TESTS)]
    return failed[0] if failed else min(codes)


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        sys.exit(run(sys.argv[1:]))
    sys.exit(130)
