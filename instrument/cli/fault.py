"""`pneuforce fault`: put a fault into a running simulator, take it out, or show what there is."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from instrument.errors import ConfigurationError, RigError
from sim.faults import CATALOGUE, Refused
from sim.faults.document import answer_of, arguments_in_words
from sim.faults.kind import FaultKind
from sim.remote import NoSimulator, Remote, beside


def show_catalogue(as_json: bool) -> None:
    """Print every fault that there is: what happens, its arguments, and the answer to it."""
    if as_json:
        print(json.dumps([_facts(kind) for kind in CATALOGUE.values()], indent=2, ensure_ascii=False))
        return
    table = Table("name", "what happens", "arguments: usual (span)", "answer", box=SIMPLE_HEAD)
    for kind in CATALOGUE.values():
        table.add_row(kind.name, kind.what, arguments_in_words(kind), answer_of(kind))
    Console().print(table)


def inject(control_port: int, name: str | None, pairs: Sequence[str], off: bool, as_json: bool) -> str:
    """Put a fault in or take it out, where one is named; the faults that are in then, as text or JSON.

    Raises ConfigurationError where the simulator refuses, RigError where none answers.
    """
    arguments = arguments_of(pairs)
    if off and (name is None or arguments):
        raise ConfigurationError("--off takes the name of one fault alone, as pneuforce fault leak --off")
    simulator = Remote(control_port)
    try:
        before = simulator.faults()
        if name is not None:
            simulator.order(fault={"name": name, "on": not off, **arguments})
        present = simulator.faults()
    except NoSimulator as error:
        raise RigError(str(error)) from None
    except Refused as error:
        raise ConfigurationError(str(error)) from None
    told = "\n".join(_line(**fault) for fault in present) or "no fault is in"
    if off and name not in [fault["name"] for fault in before]:
        raise ConfigurationError(f"{name} was not in: {told.replace(chr(10), ', ')}")
    return json.dumps(present) if as_json else told


def control_beside(link: Path) -> int:
    """The control port of the simulator whose serial port is at `link`. Raises ConfigurationError."""
    try:
        return int(beside(link).read_text(encoding="ascii"))
    except (OSError, ValueError):
        raise ConfigurationError(
            f"no simulator has its port at {link}: start pneuforce sim, or name --link or --control PORT"
        ) from None


def _facts(kind: FaultKind) -> dict[str, Any]:
    return {
        "name": kind.name,
        "what": kind.what,
        "rule": kind.rule,
        "where": kind.where,
        "arguments": [argument._asdict() for argument in kind.arguments],
        "answer": answer_of(kind),
    }


def arguments_of(pairs: Iterable[str]) -> dict[str, float]:
    """The arguments of a fault from `name=number` as typed. Raises ConfigurationError."""
    arguments: dict[str, float] = {}
    for pair in pairs:
        name, _, text = pair.partition("=")
        try:
            arguments[name.replace("-", "_")] = float(text)
        except ValueError:
            raise ConfigurationError(f"{pair}: an argument is name=number, as kpa_per_s=0.02") from None
    return arguments


def _line(name: str, **arguments: float) -> str:
    return " ".join([name, *(f"{argument}={value:g}" for argument, value in arguments.items())])
