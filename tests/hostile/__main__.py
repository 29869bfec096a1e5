"""Command that runs the hostile cases against a Modbus TCP server and prints the results.

Any Modbus TCP server can be tested. A server that contains the test pattern of a pneuforce instrument is also
tested with the cases for its register map. These cases vent the instrument, and none of them inflates it. On
any other server, the first registers and coils may be overwritten. Do not use this program in an operating
plant.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from dataclasses import replace

from tests.hostile.case import CaseFailure
from tests.hostile.cases import CASES
from tests.hostile.connection import RawConnection, ServerUnderTest
from tests.hostile.runner import FAIL, CaseResult, run_case

_VENT = "06 0204 0000"


def main() -> int:
    """Return the exit status: 0 if no case failed, 1 if a case failed, 2 if the server does not answer."""
    options = _options()
    server = ServerUnderTest(**{name: value for name, value in vars(options).items() if name != "json"})
    try:
        server = replace(server, is_pneuforce_server=server.shows_test_pattern())
        results = run_all(server, quiet=options.json)
    except CaseFailure as failure:
        print(f"{server.host}:{server.port}: {failure}", file=sys.stderr)
        return 2
    if options.json:
        print(json.dumps([result.as_json() for result in results], indent=1))
    else:
        print(_summary(results))
    return int(any(result.verdict == FAIL for result in results))


def run_all(server: ServerUnderTest, *, quiet: bool = True) -> list[CaseResult]:
    """Run every case for this server, and print each result unless `quiet`. Raises CaseFailure."""
    if server.is_pneuforce_server:
        with RawConnection(server) as connection:
            connection.request(_VENT)
    results = []
    for case in CASES:
        if server.is_pneuforce_server or not case.needs_pneuforce:
            results.append(run_case(case, server))
            if not quiet:
                print(_format_result(results[-1]), flush=True)
    return results


def _format_result(result: CaseResult) -> str:
    case = result.case
    return f"{result.verdict:4}  {case.group + ': ' + case.name:72}  {case.expected:40}  {result.got}"


def _summary(results: list[CaseResult]) -> str:
    count = Counter(result.verdict for result in results)
    return f"{len(results)} cases: " + ", ".join(f"{number} {verdict}" for verdict, number in count.items())


def _options() -> argparse.Namespace:
    defaults = ServerUnderTest()
    parser = argparse.ArgumentParser(
        prog="python -m tests.hostile",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--host", default=defaults.host)
    parser.add_argument("--port", type=int, default=defaults.port)
    parser.add_argument("--unit", type=int, default=defaults.unit)
    parser.add_argument(
        "--answer-timeout-s",
        type=float,
        default=defaults.answer_timeout_s,
        help="time to wait for an answer [s]",
    )
    parser.add_argument(
        "--frame-timeout-s",
        type=float,
        default=defaults.frame_timeout_s,
        help="frame time-out of the server [s]",
    )
    parser.add_argument(
        "--idle-timeout-s",
        type=float,
        default=defaults.idle_timeout_s,
        help="idle time-out of the server [s]",
    )
    parser.add_argument(
        "--max-connections", type=int, default=defaults.max_connections, help="connection limit of the server"
    )
    parser.add_argument("--json", action="store_true", help="print JSON after the last case")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
