"""Mutation test of the firmware: `python -m tests.firmware.mutants [header …]`.

A mutant is one change in one line of the headers that control the pressure. For each mutant, the contract
tests (tests/sim/test_board*.py) run on the changed headers, compiled for this machine, until the first
failure. A mutant that fails no test survives. All changes are made in a copy of this tree.
"""

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue
from random import Random
from time import monotonic
from typing import NamedTuple

from rich.console import Console
from rich.progress import track
from rich.table import Table
from rich.text import Text

from tests.code_copy import copy_code
from tests.firmware.compiled import ROOT

HEADERS, SHARED = Path("firmware/pneuforce"), Path("tests/firmware/shared.c")
NUMBERS = "numbers.h"
#: Headers without mutants: the rig link has its own tests, and hardware.h is used on the chip only.
NOT_MUTATED = {"board.h", "wire.h", "hardware.h"}
#: Files of the contract tests. The file that detects most mutants runs first.
CONTRACT = [f"tests/sim/test_board{name}.py" for name in ("_filling", "_limits", "_proof_test", "")]
#: Arguments of Python that run the contract tests on the board "c" only, without bytecode files.
ON_C = ("-B", "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-k", "[c] or [c-", *CONTRACT)
#: CPU time limit, so that an endless loop is detected too. The contract tests take 12 s of one core.
CPU_LIMIT = ("prlimit", "--cpu=60")
WITHOUT_PLUGINS = {**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
#: Time limit for all mutants [s]. The order of the mutants is random with a fixed seed, so that the tested
#: mutants represent all mutants.
MAX_RUN_S = 600.0

#: Changes in code: the found text, and its replacement.
FLIPPED = {"<": ">=", "<=": ">", ">": "<=", ">=": "<", "==": "!=", "!=": "=="}
OPPOSITE = {"&&": "||", "||": "&&", "+": "-", "-": "+", "*": "/", "/": "*", "true": "false", "false": "true"}
VALVES = {"SAFE": "LOCKED", "LOCKED": "SAFE", "FILL": "LOCKED"}
Changes = dict[str, Callable[[str], list[str]]]
IN_CODE: Changes = {
    r"(?<= )(<=?|>=?|==|!=)(?= )": lambda found: [FLIPPED[found]],
    r"(?<= )(&&|\|\||[+*/-])(?= )|\b(true|false)\b": lambda found: [OPPOSITE[found]],
    r"\b(SAFE|LOCKED|FILL)\b": lambda found: [VALVES[found]],
    r"!(?=[\w(])": lambda found: [""],
    r"(?<![\w.])(?!0\b|0\.0)\d+(\.\d+)?(e-?\d+)?[uf]?\b": lambda found: [f"2 * {found}"],
    r"(?<=^    )\s*[\w>.\[\]+-]+( [|+-]?= [^;]*|\+\+|\([^;]*\));$": lambda found: [";"],
}
IN_TABLES: Changes = {
    r"(?<=u, )(?!1,)\d+(?=, )": lambda found: [f"2 * {found}"],
    r"\bSTATE_\w+": lambda found: ["STAYS"],
    r"\b0x\w\wu(?=, \d+, )": lambda found: ["0u"],
    r"\bFAULT_\w+(?=, [a-z_]+\))": lambda found: ["FAULT_NONE"],
}


def scaled(factor: int) -> Changes:
    """Return the changes that divide and multiply a number by a factor."""
    return {r"(?<= )\d+(\.\d+)?[uf]$": lambda found: [f"({found} / {factor})", f"({found} * {factor})"]}


#: Changes for each section of numbers.h. All other sections define the wire format and are not changed.
IN_NUMBERS: dict[str, Changes] = {
    r"pneuforce\.(protocol\.limits|sim\.board\.(limits|pressure_control|board_status|monitors)) \*": scaled(
        2
    ),
    # These numbers have wide margins. A test need not detect a factor of 2.
    r"pneuforce\.sim\.board\.(reading|filling|supply) \*": scaled(10),
    r"pneuforce\.sim\.board\.(states|limits): |Condition under which": IN_TABLES,
}


class Mutant(NamedTuple):
    """One change in one line of a header."""

    header: str
    number: int  # line number, from 1
    line: str
    start: int
    end: int
    replacement: str

    @property
    def changed(self) -> str:
        return self.line[: self.start] + self.replacement + self.line[self.end :]

    @property
    def description(self) -> str:
        """Return the line with the change as `before → after`."""
        before = self.line[self.start : self.end].strip()
        return f"{self.line[: self.start]}⟦{before} → {self.replacement}⟧{self.line[self.end :]}".strip()


def mutants_of(header: str, text: str) -> Iterator[Mutant]:
    """Yield every mutant of a header."""
    in_comment, changes = False, {} if header == NUMBERS else IN_CODE
    for number, line in enumerate(text.splitlines(), 1):
        if header == NUMBERS and line.startswith("/* "):
            changes = next((c for section, c in IN_NUMBERS.items() if re.match(section, line[3:])), {})
        code, in_comment = without_comment(line, in_comment)
        if header == NUMBERS or not code.startswith("#"):
            for pattern, replacements in changes.items():
                for match in re.finditer(pattern, code):
                    yield from (
                        Mutant(header, number, line, *match.span(), replacement)
                        for replacement in replacements(match[0])
                    )


def without_comment(line: str, in_comment: bool) -> tuple[str, bool]:
    """Return the code of a line, and True if a comment is still open at its end."""
    if in_comment:
        return "", "*/" not in line
    begins = line.find("/*")
    return (line, False) if begins < 0 else (line[:begins].rstrip(), "*/" not in line[begins:])


class Tree:
    """Copy of this source tree for one mutant at a time."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        copy_code(folder, "firmware", "tests")
        for header in (folder / HEADERS).glob("*.h"):  # the pragma prevents warnings about unused code
            header.write_text("#pragma GCC system_header\n" + header.read_text(encoding="utf-8"))

    def detects(self, mutant: Mutant) -> bool | None:
        """Return True if a contract test fails for the mutant, None if the mutant does not compile."""
        header = self._folder / HEADERS / mutant.header
        original = header.read_text(encoding="utf-8")
        lines = original.splitlines()
        assert lines[mutant.number] == mutant.line  # lines[0] is the pragma
        lines[mutant.number] = mutant.changed
        header.write_text("\n".join(lines) + "\n", encoding="utf-8")
        try:
            return self.fails() if self._builds() else None
        finally:
            header.write_text(original, encoding="utf-8")

    def _builds(self) -> bool:
        command = ("gcc", "-std=c11", "-fsyntax-only", "-I", HEADERS, SHARED)
        return subprocess.run(command, cwd=self._folder, capture_output=True, check=False).returncode == 0

    def fails(self) -> bool:
        """Return True if a contract test fails, or if the tests exceed the CPU time limit."""
        return self.run(*ON_C).returncode != 0

    def run(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run Python in the copy, with a limit of its processor time."""
        command = (*CPU_LIMIT, sys.executable, *arguments)
        return subprocess.run(
            command, cwd=self._folder, env=WITHOUT_PLUGINS, capture_output=True, text=True, check=False
        )


def run_mutants(mutants: list[Mutant], folder: Path) -> Iterator[tuple[Mutant, bool | None]]:
    """Yield each mutant with True if the tests detected this mutant, and False if not. Use all cores.

    None means that the mutant does not compile, or that the time limit had passed.
    """
    cores, until_s = os.cpu_count() or 1, monotonic() + MAX_RUN_S
    trees: SimpleQueue[Tree] = SimpleQueue()
    for n in range(cores):
        trees.put(Tree(folder / str(n)))

    def run(mutant: Mutant) -> bool | None:
        if monotonic() > until_s:
            return None
        tree = trees.get()
        try:
            return tree.detects(mutant)
        finally:
            trees.put(tree)

    with ThreadPoolExecutor(cores) as pool:
        yield from zip(mutants, pool.map(run, mutants), strict=True)


def result_table(results: list[tuple[Mutant, bool]]) -> Table:
    """Return a table of the tested mutants."""
    table = Table("", "line", "change", box=None)
    for mutant, detected in results:
        result = Text("detected", "dim") if detected else Text("survives", "bold red")
        table.add_row(result, f"{mutant.header}:{mutant.number}", Text(mutant.description))
    return table


def results_of(mutants: list[Mutant], console: Console) -> list[tuple[Mutant, bool]]:
    """Return the tested mutants and their results. Print each surviving mutant immediately."""
    tested = []
    with tempfile.TemporaryDirectory() as folder:
        if Tree(Path(folder) / "original").fails():
            sys.exit("the contract tests fail without any change: run pytest tests/sim/test_board*.py first")
        results = run_mutants(mutants, Path(folder))
        for mutant, detected in track(results, "mutants", len(mutants), console=Console(stderr=True)):
            if detected is not None:
                tested.append((mutant, detected))
            if detected is False:
                console.print(Text(f"survives: {mutant.header}:{mutant.number}  {mutant.description}"))
    return tested


def main(headers: list[str]) -> int:
    """Test the mutants of these headers, or of all headers. Return 1 if a mutant survives."""
    console = Console()
    names = headers or sorted({path.name for path in (ROOT / HEADERS).glob("*.h")} - NOT_MUTATED)
    texts = {name: (ROOT / HEADERS / name).read_text(encoding="utf-8") for name in names}
    mutants = [mutant for name in names for mutant in mutants_of(name, texts[name])]
    Random(1).shuffle(mutants)
    tested = results_of(mutants, console)
    console.print(result_table(sorted(tested)))
    detected = sum(detected for _, detected in tested)
    console.print(
        f"{len(tested)} of {len(mutants)} tested, {detected} detected: {detected / len(tested):.1%}"
    )
    return int(detected < len(tested))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
