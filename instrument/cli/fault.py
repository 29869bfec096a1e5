"""`pneuforce fault`: put a fault into a running simulator, take it out, or show what there is."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from instrument.errors import ConfigurationError, RigError
from sim.faults import CATALOGUE
from sim.faults.document import answer_of, arguments_in_words
from sim.faults.kind import FaultKind

ANSWER_S = 5.0


def show_catalogue(as_json: bool) -> None:
    """Print every fault that there is: what happens, its arguments, and the answer to it."""
    if as_json:
        print(json.dumps([_facts(kind) for kind in CATALOGUE.values()], indent=2, ensure_ascii=False))
        return
    table = Table("name", "what happens", "arguments: usual (span)", "answer", box=SIMPLE_HEAD)
    for kind in CATALOGUE.values():
        table.add_row(kind.name, kind.what, arguments_in_words(kind), answer_of(kind))
    Console().print(table)


def inject(control_port: int | None, name: str | None, pairs: Sequence[str], off: bool, as_json: bool) -> str:
    """Put a fault in or take it out, where one is named; the faults that are in then, as text or JSON.

    Raises ConfigurationError where the simulator refuses, RigError where none answers.
    """
    if control_port is None:
        raise ConfigurationError("--control PORT is needed: pneuforce sim prints it as it starts")
    arguments = arguments_of(pairs)
    request = None if name is None else {"name": name, "on": not off, **arguments}
    present = order(control_port, request)
    if as_json:
        return json.dumps(present)
    return "\n".join(_line(**fault) for fault in present) or "no fault is in"


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


def order(control_port: int, request: Mapping[str, Any] | None) -> list[dict[str, Any]]:
    """Send one request for a fault, if any; the faults that are in then.

    Raises ConfigurationError where the simulator refuses, RigError where none answers.
    """
    orders = [{"fault": request}] if request else []
    try:
        with socket.create_connection(("127.0.0.1", control_port), ANSWER_S) as connection:
            connection.sendall(b"".join(json.dumps(o).encode() + b"\n" for o in (*orders, {"faults": True})))
            answer = json.loads(connection.makefile().readline())
    except (OSError, ValueError):
        raise RigError(
            f"no simulator answers on control port {control_port}: pneuforce sim prints its port as it starts"
        ) from None
    if "error" in answer:
        raise ConfigurationError(answer["error"])
    present: list[dict[str, Any]] = answer["faults"]
    return present


def _line(name: str, **arguments: float) -> str:
    return " ".join([name, *(f"{argument}={value:g}" for argument, value in arguments.items())])
