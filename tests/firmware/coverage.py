"""Coverage of the firmware's headers: `python -m tests.firmware.coverage [FOLDER]`.

Prints the executed lines and branches of each header, from gcov, and each line that is not completely
executed, with the reason. Without FOLDER, the contract tests (tests/sim/test_board*.py) run first, which
takes half a minute. With FOLDER, the data of `make coverage` is read from there. Ends with code 1 if a line
without a reason is not completely executed. The sketch itself and hardware.h run only on the chip and are not
counted.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from tests.firmware.compiled import ROOT

FIRMWARE = (ROOT / "firmware/pneuforce").resolve()

#: Beginning of each line that the contract tests do not execute completely, and the reason.
EXPLAINED = {
    "static bool board_ok(const struct board *b)": "the OK contact: tests/firmware/test_ok_contact.py",
    "return b->identified && host_active(": "the OK contact: tests/firmware/test_ok_contact.py",
    "return;": "the buffer has room for all frames of one sample",
    "if (b->out_bytes > sizeof b->out": "the buffer has room for all frames of one sample",
    "switch (frame[2]) {": "the decoder rejects all other kinds: tests/firmware/test_wire.py",
    "if (kind != KIND_IDENTIFY && (frame[3]": "frames of an unknown kind: tests/firmware/test_wire.py",
    "if (p->change_count < MAX_CHANGES)": "no sample makes more changes; the check protects the array",
    "if (!(p->armed && p->requested_kpa > 0": (
        "a branch for each operand; proved: inflation_begins_only_if_everything_allows_it"
    ),
    "m->count = m->count < UINT8_MAX": "after 255 top-ups",
    "if (f->valve_actions < UINT8_MAX)": "after 255 pulses of the valves",
    "return r->history_count ?": "only before the first sample",
}


class Missed(NamedTuple):
    """Line that was not executed, or of which a branch was not taken."""

    number: int
    text: str


class HeaderCoverage(NamedTuple):
    """Executed and total lines and branches of one header."""

    name: str
    lines: int
    all_lines: int
    branches: int
    all_branches: int
    missed: tuple[Missed, ...]


def contract_tests_counted(folder: Path) -> None:
    """Run the contract tests on the headers with counters in `folder`."""
    environment = {**os.environ, "PNEUFORCE_GCOV": str(folder)}
    names = sorted(map(str, ROOT.glob("tests/sim/test_board*.py")))
    command = (sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-k", "[c] or [c-", *names)
    subprocess.run(command, cwd=ROOT, env=environment, check=True, stdout=subprocess.DEVNULL)


def headers_of(folder: Path) -> Iterator[HeaderCoverage]:
    """Yield the coverage of each header of the firmware."""
    data = sorted(map(str, folder.glob("*.gcda")))
    gcov = ("gcov", "--json-format", "--stdout", "--branch-probabilities", *data)
    report = subprocess.run(gcov, cwd=folder, capture_output=True, text=True, check=True).stdout
    for unit in report.splitlines():
        for file in json.loads(unit)["files"]:
            path = (folder / file["file"]).resolve()
            if path.is_relative_to(FIRMWARE):
                yield _coverage_of(path, file["lines"])


def _coverage_of(path: Path, lines: list[dict]) -> HeaderCoverage:
    source = path.read_text(encoding="utf-8").splitlines()
    branches = [branch["count"] > 0 for line in lines for branch in line["branches"]]
    incomplete = [
        line["line_number"]
        for line in lines
        if not line["count"] or not all(branch["count"] for branch in line["branches"])
    ]
    return HeaderCoverage(
        name=path.name,
        lines=sum(line["count"] > 0 for line in lines),
        all_lines=len(lines),
        branches=sum(branches),
        all_branches=len(branches),
        missed=tuple(Missed(number, source[number - 1].strip()) for number in incomplete),
    )


def report(folder: Path) -> int:
    """Print the coverage. Return the number of missed lines without a reason."""
    headers = sorted(headers_of(folder))
    unexplained = 0
    for header in headers:
        lines, branches = (
            f"{header.lines} of {header.all_lines} lines",
            f"{header.branches} of {header.all_branches}",
        )
        print(f"firmware {header.name}: {lines}, {branches} branches")
        for missed in header.missed:
            reason = next((why for text, why in EXPLAINED.items() if missed.text.startswith(text)), "")
            unexplained += not reason
            print(f"  line {missed.number}: {missed.text}\n    {reason or 'NO REASON'}")
    shares = [sum(column) for column in zip(*(header[1:5] for header in headers), strict=True)]
    print(f"Firmware: {shares[0] / shares[1]:.1%} of lines, {shares[2] / shares[3]:.1%} of branches")
    return unexplained


def main(arguments: list[str]) -> int:
    """Print the coverage in the given folder, or of the contract tests. Return the exit code."""
    if arguments:
        return 1 if report(Path(arguments[0]).resolve()) else 0
    with tempfile.TemporaryDirectory() as folder:
        contract_tests_counted(Path(folder))
        return 1 if report(Path(folder)) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
