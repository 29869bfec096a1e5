"""`pneuforce sim press`: press the balloon of a running simulator, or release it."""

from __future__ import annotations

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.terminal.output import print_done, stop_after
from pneuforce.sim.server.client import SimulatorClient


def press(
    control_port: int, force_n: float | None, release: bool, seconds: float | None, as_json: bool
) -> None:
    """Press the balloon, or release it, and print the request. With `seconds`, release after this time.

    With `as_json` and `seconds`, only the release is printed, so that the output is one JSON object.

    Raises ConfigurationError if the request is incomplete, SimulatorRequestError if the simulator rejects
    the request, SimulatorNotResponding if no simulator answers.
    """
    if (force_n is None) != release or (release and seconds is not None):
        raise ConfigurationError(
            "give either a force in N, for example pneuforce sim press 2.0 --seconds 3, or only --release"
        )
    simulator = SimulatorClient(control_port)
    if force_n is not None:
        simulator.request(press=force_n)
        if seconds is None or not as_json:
            print_done(f"The hand presses with {force_n:g} N.", as_json, force_n=force_n)
    if seconds is not None:
        stop_after(seconds).wait()
    if release or seconds is not None:
        simulator.request(release=True)
        print_done("The hand releases the balloon.", as_json, force_n=0.0)
