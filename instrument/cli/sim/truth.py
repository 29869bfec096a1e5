"""`pneuforce sim truth`: print the true values of a running simulator as a table."""

from __future__ import annotations

import csv
import sys
import time

from pneuforce.instrument.cli.terminal.output import json_line, print_line, stop_after
from pneuforce.sim.server.client import SimulatorClient

WAIT_S = 0.5  #: longest time without a sample before the stop signal is checked


def print_truth(control_port: int, every: int, seconds: float | None, as_json: bool) -> None:
    """Print the true values of every `every`-th sample as CSV, or as one JSON object per line.

    `utc_s` is the time of this computer at which the values arrived, in seconds since 1970.

    Ends at Ctrl-C, or after `seconds`. Raises SimulatorNotResponding if no simulator answers, and at the
    end of the simulator, SimulatorRequestError for an invalid `every`.
    """
    stop = stop_after(seconds)
    table = csv.writer(sys.stdout, lineterminator="\n")
    is_first = True
    for truth in SimulatorClient(control_port).truths(every, WAIT_S):
        if stop.is_set():
            return
        if truth is None:
            continue
        values = {"utc_s": round(time.time(), 3)} | truth
        if as_json:
            print_line(json_line(values))
            continue
        if is_first:
            table.writerow(values)
            is_first = False
        table.writerow(values.values())
        sys.stdout.flush()
