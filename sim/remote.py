"""A running simulator from afar: orders and truth over its control port."""

from __future__ import annotations

import json
import socket
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sim.faults import Refused

ANSWER_S = 5.0


class NoSimulator(ConnectionError):
    """Nobody answers on a control port, or somebody else."""

    def __init__(self, port: int) -> None:
        super().__init__(
            f"no simulator answers on control port {port}: pneuforce sim prints its port as it starts"
        )


def beside(link: Path) -> Path:
    """The file beside the link to a simulator's serial port in which its control port stands."""
    return link.with_name(f"{link.name}.control")


class Remote:
    """The control port of one simulator; a connection for each question."""

    def __init__(self, port: int) -> None:
        self.port = port

    def order(self, **request: Any) -> None:
        """Have one order of `sim.orders` carried out, as `press=2.0`. Raises Refused, NoSimulator."""
        self._ask(request, {"faults": True})  # an order has no answer, what is asked behind it has

    def faults(self) -> list[dict[str, Any]]:
        """The faults that are in: name and arguments. Raises NoSimulator."""
        present: list[dict[str, Any]] = self._ask({"faults": True})["faults"]
        return present

    def truth(self) -> dict[str, Any]:
        """The truth of the next sample (`sim.rig.Truth`), and the scenario's setpoint. Raises NoSimulator."""
        return self._ask({"truth": 1})

    def _ask(self, *requests: Mapping[str, Any]) -> dict[str, Any]:
        """The first line of the answer."""
        try:
            with socket.create_connection(("127.0.0.1", self.port), ANSWER_S) as connection:
                connection.sendall(b"".join(json.dumps(request).encode() + b"\n" for request in requests))
                answer: dict[str, Any] = json.loads(connection.makefile().readline())
        except (OSError, ValueError):
            raise NoSimulator(self.port) from None
        if "error" in answer:
            raise Refused(answer["error"])
        return answer
