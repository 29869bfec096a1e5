"""Mutation test of the host's safety modules: `python -m tests.instrument.mutants`.

mutmut makes one change (mutation) after the other in a copy of the code, and runs the tests that execute
the changed function. A mutant that fails no test survives. Prints the number of detected mutants, and each
survivor. Ends with code 1 if less than 90 % are detected, or if a survivor has no reason in `EXPLAINED`. It
takes about fifteen minutes on two processors.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

from tests.source_tree import ROOT

TREE = ROOT / "build/mutants"
MIN_DETECTED = 0.9
DETECTED = (1, 3)  #: exit codes of pytest: a test has failed, or an internal error
TIMED_OUT = (36, 24, 152, -24)  #: exit codes of mutmut for a mutant that takes too long, for example for ever

CORE = (
    "authorization", "operations", "lease", "interlocks", "vent_monitor", "command_monitor", "snapshot",
    "status", "stall_monitor", "proof_test_schedule",
)  # fmt: skip
MUTATED = [f"pneuforce/instrument/core/{name}.py" for name in CORE] + [
    "pneuforce/instrument/measurement/chain.py",
]
TESTS = [
    "tests/instrument/core",
    *(f"tests/instrument/measurement/test_{name}.py" for name in ("chain", "implausible_force", "contact")),
    "tests/instrument/config/test_calibrated.py",
    "tests/instrument/calibration/test_grip.py",
    "tests/instrument/audit/test_audit_logger.py",
]
#: The wording of the log is not a safety function.
NOT_MUTATED = [r"log\.(info|warning|error)\("]

#: Changed lines that no test can or needs to detect, and the reason.
EXPLAINED = {
    "clearing.count -= 1": "the board compares the count with the last one; each change has the same effect",
    "clearing.count += 2": "the board compares the count with the last one; each change has the same effect",
    "elif not VALID_LOW_KPA < curve.baseline_kpa <= VALID_HIGH_KPA:": "only exactly 4.95 kPa differs",
    "elif not VALID_LOW_KPA <= curve.baseline_kpa < VALID_HIGH_KPA:": "only exactly 11.45 kPa differs",
    "in_range = VALID_LOW_KPA < curve.baseline_kpa <= VALID_HIGH_KPA and math.isfinite(limit_n)": (
        "only exactly 4.95 kPa differs"
    ),
    "in_range = VALID_LOW_KPA <= curve.baseline_kpa < VALID_HIGH_KPA and math.isfinite(limit_n)": (
        "only exactly 11.45 kPa differs"
    ),
    "quality = Quality.INTERPOLATED if rise_kpa <= curve.model.lower_range_rise_kpa else Quality.GOOD": (
        "only a rise of exactly 0.5 kPa differs"
    ),
    "if not abs(reference_kpa - self.reference_kpa) < REFERENCE_TOLERANCE_KPA:": (
        "only a change of exactly the tolerance differs"
    ),
    "self._wait_s = 1.0": "the balloon must be free for two seconds before the next test, which is longer",
    'mode = values.get("mode", "hold" if context.arming is Arming.HOLDING else "XXventXX")': (
        "every mode except hold has the same effect"
    ),
    'mode = values.get("mode", "hold" if context.arming is Arming.HOLDING else "VENT")': (
        "every mode except hold has the same effect"
    ),
}


def make_tree() -> None:
    """Make a copy of the code in which `pneuforce/` contains folders instead of links, as mutmut needs it."""
    shutil.rmtree(TREE, ignore_errors=True)
    ignored = shutil.ignore_patterns("__pycache__", "static")
    shutil.copytree(ROOT / "pneuforce", TREE / "pneuforce", ignore=ignored)
    for name in ("tests", "firmware"):
        shutil.copytree(ROOT / name, TREE / name, ignore=ignored)
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["pytest"]
    (TREE / "pyproject.toml").write_text(
        f"""[tool.pytest.ini_options]
addopts = {json.dumps(settings["ini_options"]["addopts"])}
markers = {json.dumps(settings["ini_options"]["markers"])}

[tool.mutmut]
source_paths = ["pneuforce"]
only_mutate = {json.dumps(MUTATED)}
also_copy = ["firmware"]
do_not_mutate_patterns = {json.dumps(NOT_MUTATED)}
pytest_add_cli_args = ["-p", "no:cacheprovider"]
pytest_add_cli_args_test_selection = {json.dumps(TESTS)}
""",
        encoding="utf-8",
    )


def mutmut(*arguments: str, **options) -> subprocess.CompletedProcess:
    """Run mutmut in the copy."""
    program = Path(sys.executable).with_name("mutmut")
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return subprocess.run((program, *arguments), cwd=TREE, env=environment, text=True, **options)


def exit_codes() -> dict[str, int | None]:
    """Return the exit code of the tests for each mutant, by its name."""
    files = sorted((TREE / "mutants").rglob("*.meta"))
    return {
        name: code
        for file in files
        for name, code in json.loads(file.read_text(encoding="utf-8"))["exit_code_by_key"].items()
    }


def changed_line(name: str) -> str:
    """Return the line that a mutant contains instead of the original line."""
    difference = mutmut("show", name, capture_output=True).stdout
    return " ".join(line[1:].strip() for line in difference.splitlines() if re.match(r"\+(?!\+)", line))


def main() -> int:
    """Run the mutation test and print its result. Return the exit code."""
    make_tree()
    mutmut("run", "--max-children", "2", check=True)
    codes = exit_codes()
    survivors = [name for name, code in codes.items() if code not in (*DETECTED, *TIMED_OUT)]
    lines = {name: changed_line(name) for name in survivors}
    unexplained = [name for name in survivors if lines[name] not in EXPLAINED]
    detected = 1 - len(survivors) / len(codes)
    print(f"\n{len(codes)} mutants, {detected:.1%} detected, {len(survivors)} survive")
    for name in survivors:
        print(f"{name}\n  {lines[name]}\n  {EXPLAINED.get(lines[name], 'NO REASON')}")
    return 1 if unexplained or detected < MIN_DETECTED else 0


if __name__ == "__main__":
    sys.exit(main())
