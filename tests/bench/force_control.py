"""Force control over each bus: overshoot and settling time of docs/examples/force_control.py.

`python -m tests.bench.force_control --figure docs/figures/force-control.png` also draws the true forces.
"""

import argparse
import importlib.util
import json
import socket
import statistics
import sys
import threading
from contextlib import ExitStack, contextmanager
from typing import NamedTuple

import pneuforce
from pneuforce.testing import simulated_rig
from pneuforce.teststand.stack import free_port
from tests.source_tree import ROOT

TISSUES = {
    "soft tissue (20 kPa)": {"tissue": {"law": "hertz", "modulus_kpa": 20.0}},
    "stiff tissue (200 kPa)": {"tissue": {"law": "hertz", "modulus_kpa": 200.0}},
    "rigid wall": {},
}
SETPOINT_KPA, DISTANCE_MM, SECONDS = 8.0, 5.0, 6.0
TOUCHED_N, BAND = 0.01, 0.05
MAX_OVERSHOOT = 0.10


def load_example():
    """Return the module of the example program."""
    path = ROOT / "docs/examples/force_control.py"
    spec = importlib.util.spec_from_file_location("force_control", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Course(NamedTuple):
    """True force over time, from the first touch."""

    t_s: list
    force_n: list

    def overshoot(self, target_n):
        """Return how far the force exceeds the target, as a fraction."""
        return max(self.force_n) / target_n - 1

    def settling_s(self, target_n):
        """Return the time from the touch until the force stays within 5 % of the target."""
        outside = [t for t, f in zip(self.t_s, self.force_n, strict=True) if abs(f / target_n - 1) > BAND]
        return outside[-1]


@contextmanager
def true_forces(control_port):
    """Collect the true force of each sample in a list, in the background."""
    samples = []
    with socket.create_connection(("127.0.0.1", control_port)) as connection:
        connection.sendall(b'{"truth": 1}\n')

        def receive():
            for line in connection.makefile():
                truth = json.loads(line)
                samples.append((truth["t_s"], truth["force_n"]))

        thread = threading.Thread(target=receive)
        thread.start()
        try:
            yield samples
        finally:
            connection.shutdown(socket.SHUT_WR)  # the simulator then sends the end of the stream
            thread.join()


def controlled(example, rig, url, start, seconds):
    """Control the force over one connection. Return the course of the true force."""
    with ExitStack() as stack:
        sensor = stack.enter_context(pneuforce.connect(url))
        holder = stack.enter_context(pneuforce.connect(rig.url)) if url.startswith("rdt") else sensor
        stack.enter_context(holder.hold(SETPOINT_KPA, lease_s=1.0))
        robot = stack.enter_context(
            example.SimulatedRobot(rig.control_port, distance_mm=DISTANCE_MM, **start)
        )
        with true_forces(rig.control_port) as samples:
            example.control(sensor, holder, robot, seconds)
        example.move_back(robot, 0.5)
    rig.release(wait=False)
    touch_s = next(t_s for t_s, force_n in samples if force_n > TOUCHED_N)
    return Course(*zip(*((t - touch_s, f) for t, f in samples if t >= touch_s - 0.5), strict=True))


def courses_by_bus(seconds, tissues, buses=3):
    """Return the courses of a program that uses the first buses, by bus and tissue, and the target."""
    example = load_example()
    port = free_port()
    instrument = {"can": {"force_rate_hz": 500}, "rdt": {"enabled": True, "port": port}}
    with simulated_rig(instrument=instrument) as rig:
        urls = {"Modbus TCP": rig.url, "CAN, 500 Hz": rig.can_url, "RDT": f"rdt://127.0.0.1:{port}"}
        return {
            (bus, name): controlled(example, rig, url, start, seconds)
            for bus, url in list(urls.items())[:buses]
            for name, start in tissues.items()
        }, example.TARGET_N


def bench_force_control(brief=False, figure=None):
    """Print overshoot and settling time at an approach of 5 mm/s, for each bus and each tissue."""
    tissues = {"rigid wall": {}} if brief else TISSUES
    courses, target_n = courses_by_bus(2.0, tissues, buses=1) if brief else courses_by_bus(SECONDS, tissues)
    for (bus, name), course in courses.items():
        mean_n = statistics.fmean(course.force_n[-100:])
        print(
            f"force control, {bus}, {name}: overshoot {100 * course.overshoot(target_n):.1f} % (target "
            f"{100 * MAX_OVERSHOOT:.0f} %), within 5 % after {course.settling_s(target_n):.2f} s, then "
            f"{mean_n:.3f} N of {target_n} N"
        )
    if figure:
        draw(courses, target_n).savefig(figure, dpi=150)


def draw(courses, target_n):
    """Return a figure with one plot for each tissue and one line for each bus."""
    from matplotlib.figure import Figure

    drawn = Figure(figsize=(9.0, 3.2), layout="constrained")
    for axes, name in zip(drawn.subplots(1, len(TISSUES), sharey=True), TISSUES, strict=True):
        for (bus, tissue), course in courses.items():
            if tissue == name:
                axes.plot(course.t_s, course.force_n, label=bus, linewidth=1.2)
        axes.axhline(target_n, color="grey", linestyle="dotted")
        axes.set(title=name, xlabel="time since the touch [s]", xlim=(-0.5, 4.5))
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(alpha=0.25)
    drawn.axes[0].set(ylabel="true force [N]")
    drawn.axes[0].legend(frameon=False, fontsize=8)
    return drawn


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--figure", help="PNG file to write")
    sys.exit(bench_force_control(figure=parser.parse_args().figure))
