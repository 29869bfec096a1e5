"""Play the hostile cases to our instrument and to the servers of others, and print docs/hostile.md."""

from __future__ import annotations

import argparse
import re
from concurrent.futures import ThreadPoolExecutor
from itertools import groupby
from pathlib import Path

from tests.hostile.cases import CASES
from tests.hostile.line import Server
from tests.hostile.play import FAIL, PASS, Outcome, played
from tests.hostile.rivals.stock import RIVALS, outcomes_of

_PAGE = Path(__file__).with_name("page.md")
_SERVERS = [("pneuforce", "this one", "Python"), *((r.name, r.version, r.language) for r in RIVALS)]
_SHORT = [
    (r".*dead but open", "dead, open"),
    (r"answer (\d+) of \d+: silent.*", r"silent from \1 on"),
    (r"answer (\d+) of \d+: transaction.*", r"out of order at \1"),
    (r"answer (\d+) of \d+: (.*)", r"\1: \2"),
    (r"silent, and open", "silent"),
    (r"took (\d+) kB.*goes on", r"takes \1 kB and more"),
    (r"took (\d+) kB.*", r"takes \1 kB, stays"),
    (r"still open after.*", "stays open"),
    (r"no Modbus frame.*", "no Modbus frame"),
    (r"an answer to transaction.*", "stray answers"),
]

Row = tuple[Outcome, ...]


def main() -> None:
    """Print the page."""
    options = _options()
    ours = Server(port=options.port)
    with ThreadPoolExecutor(2) as pool:
        others = pool.map(lambda rival: outcomes_of(rival, options.tools), RIVALS)
        columns = [[played(case, ours) for case in CASES if not case.ours], *others]
    page = _PAGE.read_text(encoding="utf-8")
    rows = list(zip(*columns, strict=True))
    print(page.format(count=len(rows), sums=_sums(columns), cases="\n".join(_tables(rows))), end="")


def _sums(columns: list[list[Outcome]]) -> str:
    lines = ["| server | version | language | passed | failed | has no such function |", "|" + " --- |" * 6]
    for (name, version, language), outcomes in zip(_SERVERS, columns, strict=True):
        verdicts = [outcome.verdict for outcome in outcomes]
        passed, failed = verdicts.count(PASS), verdicts.count(FAIL)
        rest = len(verdicts) - passed - failed
        lines.append(f"| {name} | {version} | {language} | {passed} | {failed} | {rest} |")
    return "\n".join(lines)


def _tables(rows: list[Row]) -> list[str]:
    """A table for each group, of the cases that somebody failed."""
    lines = []
    for group, those in groupby(rows, key=lambda row: row[0].case.group):
        its = list(those)
        failed = [row for row in its if any(outcome.verdict == FAIL for outcome in row)]
        lines += ["", f"### {group.capitalize()}", ""]
        lines.append(f"{len(its)} cases, {len(its) - len(failed)} of which nobody failed.")
        if failed:
            names = " | ".join(name for name, *_ in _SERVERS)
            lines += ["", f"| case | legal | {names} |", "|" + " --- |" * (len(_SERVERS) + 2)]
            lines += [_row(row) for row in failed]
    return lines


def _row(row: Row) -> str:
    case = row[0].case
    return f"| {case.name} | {case.expected} | " + " | ".join(_cell(outcome) for outcome in row) + " |"


def _cell(outcome: Outcome) -> str:
    if outcome.verdict != FAIL:
        return "✓" if outcome.verdict == PASS else "–"
    for long, short in _SHORT:
        if re.fullmatch(long, outcome.got):
            return re.sub(long, short, outcome.got)
    return outcome.got


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.hostile.rivals", description=__doc__)
    parser.add_argument("--port", type=int, default=5020, help="Modbus port of our running instrument")
    parser.add_argument("--tools", type=Path, required=True, help="folder in which the others are installed")
    return parser.parse_args()


if __name__ == "__main__":
    main()
