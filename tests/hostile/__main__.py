"""Play the hostile cases to a Modbus TCP server and print what it made of them.

The server may be anybody's. One that shows the test pattern of a pneuforce instrument is played the cases of
that instrument's map too: they vent it, and nothing in them inflates it. Any other may find its first
registers and coils overwritten. Not for a plant at work.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from dataclasses import replace

from tests.hostile.case import Wrong
from tests.hostile.cases import CASES
from tests.hostile.line import Line, Server
from tests.hostile.play import FAIL, Outcome, played

_VENT = "06 0204 0000"


def main() -> int:
    """The exit status: 0 where nothing failed, 1 where a case did, 2 where nobody answers."""
    options = _options()
    server = Server(**{name: value for name, value in vars(options).items() if name != "json"})
    try:
        server = replace(server, ours=server.is_pneuforce())
        outcomes = play_all(server, quiet=options.json)
    except Wrong as wrong:
        print(f"{server.host}:{server.port}: {wrong}", file=sys.stderr)
        return 2
    if options.json:
        print(json.dumps([outcome.as_json() for outcome in outcomes], indent=1))
    else:
        print(_summary(outcomes))
    return int(any(outcome.verdict == FAIL for outcome in outcomes))


def play_all(server: Server, *, quiet: bool = True) -> list[Outcome]:
    """Every case that concerns the server, each printed as it is played unless `quiet`. Raises Wrong."""
    if server.ours:
        with Line(server) as line:
            line.said(_VENT)
    outcomes = []
    for case in CASES:
        if server.ours or not case.ours:
            outcomes.append(played(case, server))
            if not quiet:
                print(_line(outcomes[-1]), flush=True)
    return outcomes


def _line(outcome: Outcome) -> str:
    case = outcome.case
    return f"{outcome.verdict:4}  {case.group + ': ' + case.name:72}  {case.expected:40}  {outcome.got}"


def _summary(outcomes: list[Outcome]) -> str:
    count = Counter(outcome.verdict for outcome in outcomes)
    return f"{len(outcomes)} cases: " + ", ".join(f"{number} {verdict}" for verdict, number in count.items())


def _options() -> argparse.Namespace:
    usual = Server()
    parser = argparse.ArgumentParser(
        prog="python -m tests.hostile",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--host", default=usual.host)
    parser.add_argument("--port", type=int, default=usual.port)
    parser.add_argument("--unit", type=int, default=usual.unit)
    parser.add_argument(
        "--patience", dest="patience_s", type=float, default=usual.patience_s, help="silence [s]"
    )
    parser.add_argument(
        "--frame-s", type=float, default=usual.frame_s, help="time for a frame to be completed [s]"
    )
    parser.add_argument("--idle-s", type=float, default=usual.idle_s, help="idle time of the server [s]")
    parser.add_argument("--connections", type=int, default=usual.connections, help="its connection limit")
    parser.add_argument("--json", action="store_true", help="print JSON when all is done")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
