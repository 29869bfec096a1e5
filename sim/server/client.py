"""Client of a running simulator: requests over its control port."""

from __future__ import annotations

import json
import socket
from collections.abc import Mapping
from typing import Any

from pneuforce.errors import RigError
from pneuforce.sim.faults import SimulatorRequestError

ANSWER_TIMEOUT_S = 5.0


class SimulatorNotResponding(RigError, ConnectionError):
    """Missing or invalid answer of a simulator on its control port."""

    def __init__(self, port: int) -> None:
        super().__init__(
            f"no simulator answers on control port {port}: check the port number, which "
            "pneuforce sim run prints at its start"
        )


class SimulatorClient:
    """Client of the control port of one simulator. Each request uses its own connection."""

    def __init__(self, port: int) -> None:
        self.port = port

    def request(self, **request: Any) -> None:
        """Send one request of `pneuforce.sim.server.control_requests`, for example `press=2.0`.

        Raises SimulatorRequestError if the simulator rejects the request, and SimulatorNotResponding if no
        simulator answers.
        """
        # Most requests have no answer. The answer to the second request confirms that the first was executed.
        self._first_answer(request, {"faults": True})

    def faults(self) -> list[dict[str, Any]]:
        """Return the active faults: name and arguments. Raises SimulatorNotResponding."""
        active: list[dict[str, Any]] = self._first_answer({"faults": True})["faults"]
        return active

    def truth(self) -> dict[str, Any]:
        """Return the true state at the next sample (`pneuforce.sim.rig.Truth`), and the scenario's setpoint.

        Raises SimulatorNotResponding.
        """
        return self._first_answer({"truth": 1})

    def _first_answer(self, *requests: Mapping[str, Any]) -> dict[str, Any]:
        """Send the requests and return the first line of the answer."""
        try:
            with socket.create_connection(("127.0.0.1", self.port), ANSWER_TIMEOUT_S) as connection:
                connection.sendall(b"".join(json.dumps(request).encode() + b"\n" for request in requests))
                answer: dict[str, Any] = json.loads(connection.makefile().readline())
        except (OSError, ValueError):
            raise SimulatorNotResponding(self.port) from None
        if "error" in answer:
            raise SimulatorRequestError(answer["error"])
        return answer
