"""Do the contract tests notice a firmware that is wrong? `python -m tests.firmware.mutants [header …]`

In a copy of this tree one thing at a time is changed in the headers that decide about pressure. The contract
(tests/sim/test_board*.py) then runs on the headers as compiled for this machine, until its first failure.
"""

import os
import re
import shutil
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

from tests.firmware.compiled import ROOT

HEADERS, SHARED = Path("firmware/pneuforce"), Path("tests/firmware/shared.c")
NUMBERS = "numbers.h"
#: The wire has tests of its own; pins are the sketch's.
NOT_JUDGED = {"board.h", "wire.h", "hardware.h"}
COPIED = ("firmware", "instrument", "sim", "tests", "pyproject.toml")
#: Those that notice most come first.
CONTRACT = [f"tests/sim/test_board{name}.py" for name in ("_filling", "_limits", "")]
#: On the board named "c" alone; what is compiled is not kept.
ON_C = ("-B", "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-k", "[c] or [c-", *CONTRACT)
#: The contract takes 12 s of one core. A mutant that never ends is noticed too.
BOUND = ("prlimit", "--cpu=60")
WITHOUT_PLUGINS = {**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
#: In an order that is drawn once, so that those tried in this time stand for all.
MOST_S = 600.0

#: What is changed in code, and into what.
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
    """A number that is too small and too large."""
    return {r"(?<= )\d+(\.\d+)?[uf]$": lambda found: [f"({found} / {factor})", f"({found} * {factor})"]}


#: What is changed in each section of the numbers; the others are what is on the wire.
IN_NUMBERS: dict[str, Changes] = {
    r"instrument\.rig\.limits|sim\.board\.(limits|pressure|situation|watches) \*": scaled(2),
    r"sim\.board\.(reading|filling|supply) \*": scaled(10),  # chosen with room on both sides
    r"sim\.board\.(states|limits): |When a latched": IN_TABLES,
}


class Mutant(NamedTuple):
    """One change in one line."""

    header: str
    number: int  # of the line, from 1
    line: str
    start: int
    end: int
    other: str

    @property
    def changed(self) -> str:
        return self.line[: self.start] + self.other + self.line[self.end :]

    @property
    def told(self) -> str:
        """What it is, as `before → after` in its line."""
        before = self.line[self.start : self.end].strip()
        return f"{self.line[: self.start]}⟦{before} → {self.other}⟧{self.line[self.end :]}".strip()


def mutants_of(header: str, text: str) -> Iterator[Mutant]:
    """Every change of a header that is tried."""
    in_comment, changes = False, {} if header == NUMBERS else IN_CODE
    for number, line in enumerate(text.splitlines(), 1):
        if header == NUMBERS and line.startswith("/* "):
            changes = next((c for begin, c in IN_NUMBERS.items() if re.match(begin, line[3:])), {})
        code, in_comment = without_comment(line, in_comment)
        if header == NUMBERS or not code.startswith("#"):
            for pattern, others in changes.items():
                for match in re.finditer(pattern, code):
                    yield from (
                        Mutant(header, number, line, *match.span(), other) for other in others(match[0])
                    )


def without_comment(line: str, in_comment: bool) -> tuple[str, bool]:
    """The code of a line, and whether a comment is still open at its end."""
    if in_comment:
        return "", "*/" not in line
    begins = line.find("/*")
    return (line, False) if begins < 0 else (line[:begins].rstrip(), "*/" not in line[begins:])


class Tree:
    """A copy of this tree, in which one mutant at a time lives."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        for name in COPIED:
            source, target = ROOT / name, folder / name
            shutil.copytree(source, target) if source.is_dir() else shutil.copy(source, target)
        for header in (folder / HEADERS).glob("*.h"):  # what a mutant leaves unused is no reason to refuse it
            header.write_text("#pragma GCC system_header\n" + header.read_text(encoding="utf-8"))

    def judge(self, mutant: Mutant) -> bool | None:
        """Whether the contract notices; None where the mutant is no program."""
        header = self._folder / HEADERS / mutant.header
        sound = header.read_text(encoding="utf-8")
        lines = sound.splitlines()
        assert lines[mutant.number] == mutant.line  # below the pragma
        lines[mutant.number] = mutant.changed
        header.write_text("\n".join(lines) + "\n", encoding="utf-8")
        try:
            return self.fails() if self._builds() else None
        finally:
            header.write_text(sound, encoding="utf-8")

    def _builds(self) -> bool:
        command = ("gcc", "-std=c11", "-fsyntax-only", "-I", HEADERS, SHARED)
        return subprocess.run(command, cwd=self._folder, capture_output=True, check=False).returncode == 0

    def fails(self) -> bool:
        """Whether the contract is broken, or does not come to an end."""
        command = (*BOUND, sys.executable, *ON_C)
        done = subprocess.run(
            command, cwd=self._folder, env=WITHOUT_PLUGINS, capture_output=True, check=False
        )
        return done.returncode != 0


def judged(mutants: list[Mutant], folder: Path) -> Iterator[tuple[Mutant, bool | None]]:
    """Each mutant and its verdict, None where it was not tried, on as many copies as there are cores."""
    cores, until_s = os.cpu_count() or 1, monotonic() + MOST_S
    trees: SimpleQueue[Tree] = SimpleQueue()
    for n in range(cores):
        trees.put(Tree(folder / str(n)))

    def judge(mutant: Mutant) -> bool | None:
        if monotonic() > until_s:
            return None
        tree = trees.get()
        try:
            return tree.judge(mutant)
        finally:
            trees.put(tree)

    with ThreadPoolExecutor(cores) as pool:
        yield from zip(mutants, pool.map(judge, mutants), strict=True)


def table_of(verdicts: list[tuple[Mutant, bool]]) -> Table:
    """What was tried, line by line."""
    table = Table("", "line", "change", box=None)
    for mutant, noticed in verdicts:
        said = Text("noticed", "dim") if noticed else Text("survives", "bold red")
        table.add_row(said, f"{mutant.header}:{mutant.number}", Text(mutant.told))
    return table


def verdicts_of(mutants: list[Mutant], console: Console) -> list[tuple[Mutant, bool]]:
    """What was tried, and whether it was noticed; what survives is printed at once."""
    tried = []
    with tempfile.TemporaryDirectory() as folder:
        if Tree(Path(folder) / "sound").fails():
            sys.exit("the contract is broken without any change")
        verdicts = judged(mutants, Path(folder))
        for mutant, noticed in track(verdicts, "mutants", len(mutants), console=Console(stderr=True)):
            if noticed is not None:
                tried.append((mutant, noticed))
            if noticed is False:
                console.print(Text(f"survives: {mutant.header}:{mutant.number}  {mutant.told}"))
    return tried


def main(headers: list[str]) -> int:
    """Try the mutants of these headers, or of every one that is judged; 1 where one survives."""
    console = Console()
    names = headers or sorted({path.name for path in (ROOT / HEADERS).glob("*.h")} - NOT_JUDGED)
    texts = {name: (ROOT / HEADERS / name).read_text(encoding="utf-8") for name in names}
    mutants = [mutant for name in names for mutant in mutants_of(name, texts[name])]
    Random(1).shuffle(mutants)
    tried = verdicts_of(mutants, console)
    console.print(table_of(sorted(tried)))
    noticed = sum(noticed for _, noticed in tried)
    console.print(f"{len(tried)} of {len(mutants)} tried, {noticed} noticed: {noticed / len(tried):.1%}")
    return int(noticed < len(tried))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
