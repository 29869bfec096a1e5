"""Client of a running simulator: requests over its control port."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator, Mapping
from typing import Any

from pneuforce.errors import RigError
from pneuforce.sim.faults import SimulatorRequestError

ANSWER_TIMEOUT_S = 5.0


class SimulatorNotResponding(RigError, ConnectionError):
    """Missing or invalid answer of a simulator on its control port."""

    def __init__(self, port: int, error: Exception) -> None:
        cause = (
            f" within {ANSWER_TIMEOUT_S:g} s: its process is stopped, or the computer is too busy; end other "
            "programs, and try again"
            if isinstance(error, TimeoutError)
            else ": check the port number, which pneuforce sim run prints at its start"
        )
        super().__init__(f"no simulator answers on control port {port}{cause}")


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

    def truths(self, every: int, wait_s: float) -> Iterator[dict[str, Any] | None]:
        """Yield the true state of every `every`-th sample, and None after each `wait_s` without a sample.

        Raises SimulatorRequestError for an invalid `every`, and SimulatorNotResponding if no simulator
        answers, or at the end of the simulator.
        """
        try:
            with socket.create_connection(("127.0.0.1", self.port), ANSWER_TIMEOUT_S) as connection:
                connection.sendall(json.dumps({"truth": every}).encode() + b"\n")
                connection.settimeout(wait_s)
                yield from _received_objects(connection)
        except (OSError, ValueError) as error:
            raise SimulatorNotResponding(self.port, error) from None

    def _first_answer(self, *requests: Mapping[str, Any]) -> dict[str, Any]:
        """Send the requests and return the first line of the answer."""
        try:
            with socket.create_connection(("127.0.0.1", self.port), ANSWER_TIMEOUT_S) as connection:
                connection.sendall(b"".join(json.dumps(request).encode() + b"\n" for request in requests))
                answer: dict[str, Any] = json.loads(connection.makefile().readline())
        except (OSError, ValueError) as error:
            raise SimulatorNotResponding(self.port, error) from None
        if "error" in answer:
            raise SimulatorRequestError(answer["error"])
        return answer


def _received_objects(connection: socket.socket) -> Iterator[dict[str, Any] | None]:
    """Yield each JSON object that is received, and None after a timeout of the connection.

    Raises SimulatorRequestError for an error, ConnectionError at the end of the connection, and ValueError
    for a line that is not JSON.
    """
    received = b""
    while True:
        try:
            data = connection.recv(1 << 16)
        except TimeoutError:
            yield None
            continue
        if not data:
            raise ConnectionError("the simulator has closed the connection")
        *lines, received = (received + data).split(b"\n")
        for line in lines:
            answer = json.loads(line)
            if "error" in answer:
                raise SimulatorRequestError(answer["error"])
            yield answer
