"""Command that runs the hostile cases against several Modbus servers and prints docs/hostile.md."""

from __future__ import annotations

import argparse
import re
from concurrent.futures import ThreadPoolExecutor
from itertools import groupby
from pathlib import Path

from tests.hostile.cases import CASES
from tests.hostile.connection import ServerUnderTest
from tests.hostile.other_servers.processes import OTHER_SERVERS, results_of
from tests.hostile.runner import FAIL, PASS, CaseResult, run_case

_PAGE = Path(__file__).with_name("page.md")
_SERVERS = [("pneuforce", "this one", "Python"), *((r.name, r.version, r.language) for r in OTHER_SERVERS)]
#: Short forms of failures for the cells of the tables.
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
    (r"an unexpected answer to transaction.*", "stray answers"),
]

Row = tuple[CaseResult, ...]


def main() -> None:
    """Print the page."""
    options = _options()
    instrument = ServerUnderTest(port=options.port)
    with ThreadPoolExecutor(2) as pool:
        others = pool.map(lambda other_server: results_of(other_server, options.tools), OTHER_SERVERS)
        columns = [[run_case(case, instrument) for case in CASES if not case.needs_pneuforce], *others]
    page = _PAGE.read_text(encoding="utf-8")
    rows = list(zip(*columns, strict=True))
    print(page.format(count=len(rows), sums=_summary_table(columns), cases="\n".join(_tables(rows))), end="")


def _summary_table(columns: list[list[CaseResult]]) -> str:
    lines = ["| server | version | language | passed | failed | not supported |", "|" + " --- |" * 6]
    for (name, version, language), results in zip(_SERVERS, columns, strict=True):
        verdicts = [result.verdict for result in results]
        passed, failed = verdicts.count(PASS), verdicts.count(FAIL)
        not_supported = len(verdicts) - passed - failed
        lines.append(f"| {name} | {version} | {language} | {passed} | {failed} | {not_supported} |")
    return "\n".join(lines)


def _tables(rows: list[Row]) -> list[str]:
    """Return one table per group, with the cases that at least one server failed."""
    lines = []
    for group, group_rows in groupby(rows, key=lambda row: row[0].case.group):
        cases = list(group_rows)
        failed = [row for row in cases if any(result.verdict == FAIL for result in row)]
        lines += ["", f"### {group.capitalize()}", ""]
        passed_by_all = len(cases) - len(failed)
        lines.append(
            f"{len(cases)} cases. All servers passed {passed_by_all} of these cases, which the table omits."
        )
        if failed:
            names = " | ".join(name for name, *_ in _SERVERS)
            lines += ["", f"| case | legal | {names} |", "|" + " --- |" * (len(_SERVERS) + 2)]
            lines += [_row(row) for row in failed]
    return lines


def _row(row: Row) -> str:
    case = row[0].case
    return f"| {case.name} | {case.expected} | " + " | ".join(_cell(result) for result in row) + " |"


def _cell(result: CaseResult) -> str:
    if result.verdict != FAIL:
        return "✓" if result.verdict == PASS else "–"
    for pattern, short in _SHORT:
        if re.fullmatch(pattern, result.got):
            return re.sub(pattern, short, result.got)
    return result.got


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.hostile.other_servers", description=__doc__)
    parser.add_argument("--port", type=int, default=5020, help="Modbus port of the running instrument")
    parser.add_argument(
        "--tools", type=Path, required=True, help="folder in which the other servers are installed"
    )
    return parser.parse_args()


if __name__ == "__main__":
    main()
