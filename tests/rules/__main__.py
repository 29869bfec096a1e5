"""Exhaustive search: `python -m tests.rules [SEARCH …]`.

Prints one line per search: the numbers of states and changes, the depth, the time, and a rule that does not
hold, with the shortest sequence of events. Then plants one error after the other in a copy of the host, and
prints whether the search finds it. Ends with code 1 if a rule does not hold, or if an error is not found.
"""

import sys
import time
from argparse import ArgumentParser
from concurrent.futures import ThreadPoolExecutor

from tests.rules.explorer import explore
from tests.rules.mutants import PLANTED_ERRORS, finding_of
from tests.rules.searches import SEARCHES, Search


def show_progress(states: int, waiting: int) -> None:
    """Show how many states were found, if somebody watches."""
    if sys.stderr.isatty():
        print(f"\r{states} states, {waiting} to examine ", end="", file=sys.stderr, flush=True)


def searched(search: Search, rule: str) -> bool:
    """Run one search and print its result. Return True if all rules hold."""
    started_s = time.monotonic()
    result = explore(search, rule, show_progress)
    counts = f"{result.states:6} states {result.changes:8} changes, depth {result.depth:2}"
    print(f"{search.name:9} {counts}, {time.monotonic() - started_s:5.1f} s: {search.sentence}", flush=True)
    if result.finding:
        events = ", ".join(" ".join(event).strip() for event in result.finding.events)
        print(f"  {result.finding.rule} does not hold after: {events}")
    return result.finding is None


def planted_errors_found(names: list[str]) -> bool:
    """Plant the errors of the searches with these names, or all. Return True if each is found."""
    chosen = [planted for planted in PLANTED_ERRORS if not names or planted.search in names]
    with ThreadPoolExecutor(max_workers=2) as executor:
        findings = list(executor.map(finding_of, chosen))
    missed = [p for p, finding in zip(chosen, findings, strict=True) if p.rule not in finding]
    for planted in missed:
        print(f"NOT FOUND: {planted}")
    print(f"{len(chosen) - len(missed)} of {len(chosen)} planted errors found")
    return not missed


def main(arguments: list[str]) -> int:
    """Run the searches with these names, or all. Return the exit code."""
    parser = ArgumentParser(
        prog="python -m tests.rules", description="Search all states of the host's rules."
    )
    names = [search.name for search in SEARCHES]
    parser.add_argument(
        "search", nargs="*", choices=[*names, []], help=f"name of a search: {', '.join(names)}"
    )
    parser.add_argument("--rule", default="", help="check only this rule, and plant no errors")
    options = parser.parse_args(arguments)
    chosen = [search for search in SEARCHES if not options.search or search.name in options.search]
    good = [searched(search, options.rule) for search in chosen]
    if not options.rule and all(good):
        good.append(planted_errors_found(options.search))
    return 0 if all(good) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
