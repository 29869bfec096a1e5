"""`pneuforce sim hand`: stop or continue the contacts of the simulated hand."""

from __future__ import annotations

from pneuforce.instrument.cli.terminal.output import print_done
from pneuforce.sim.server.client import SimulatorClient

MESSAGES = {
    True: "The hand continues with the contacts of its scenario.",
    False: "The hand stops the contacts of its scenario.",
}


def play_scenario(control_port: int, plays: bool, as_json: bool) -> None:
    """Let the hand press as its scenario says, or not. Print the request.

    Raises SimulatorRequestError if the simulator rejects the request, SimulatorNotResponding if no simulator
    answers.
    """
    SimulatorClient(control_port).request(hand=plays)
    print_done(MESSAGES[plays], as_json, hand=plays)
