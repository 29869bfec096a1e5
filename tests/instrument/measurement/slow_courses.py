"""Courses with slow presses and with slow disturbances, and the share of the forces that ±2u covers.

`python -m tests.instrument.measurement.slow_courses [SETPOINT [BALLOON]]` prints the shares. A balloon other
than `published` is measured with a force calibration. The names of the balloons are in `plant_contacts.py`.
"""

import sys
from dataclasses import replace

import numpy as np

from tests.instrument.measurement.locked_balloon import (
    START_S,
    Course,
    calibrated_settings,
    measure,
    polyline,
    presses,
)

PRESSED_S, CAVITY_KPA = 20.0, 1.5
NORMAL = (1.0, 4.0, 2.0, 5.0)  # force [N], rate [N/s], hold [s], pause [s]


def _slow_press(rate_n_per_s):
    """Return a press with 1.5 N at a rate, and a normal press after it."""
    seconds = START_S + 2 * 1.5 / rate_n_per_s + 35.0
    return Course(seconds, presses((1.5, rate_n_per_s, 10.0, 15.0), NORMAL))


def _inlet_leak(kpa_per_s, force_n=0.0):
    """Return a leak of the inlet with a press of 20 s."""
    press = presses((force_n, 2.0, PRESSED_S, 10.0), start_s=2 * START_S) if force_n else presses()
    return Course(60.0, press, inlet_leak_kpa_per_s=kpa_per_s)


def _insufflation(seconds, reference_written=False):
    """Return a rise of the pressure around the balloon in a time."""
    end_s = START_S + seconds
    rise = polyline((0, 0), (START_S, 0), (end_s, CAVITY_KPA), (end_s + 1, CAVITY_KPA))
    return Course(end_s + 20.0, cavity_kpa=rise, reference_written=reference_written)


def _repeated(count, pause_s, **disturbance):
    """Return normal presses during a disturbance."""
    seconds = 2 * START_S + count * (3.5 + pause_s)
    return Course(seconds, presses(*[(1.0, 4.0, 3.0, pause_s)] * count, start_s=2 * START_S), **disturbance)


COURSES = {
    **{f"press at {rate} N/s": _slow_press(rate) for rate in (0.02, 0.06, 0.12, 0.3, 1.0)},
    **{f"inlet leak of {rate} kPa/s": _inlet_leak(rate) for rate in (0.005, 0.02, 0.05, 0.1)},
    **{f"inlet leak of {rate} kPa/s, press": _inlet_leak(rate, 1.0) for rate in (0.005, 0.02, 0.05, 0.1)},
    **{f"insufflation in {seconds} s": _insufflation(seconds) for seconds in (2, 10, 60)},
    **{
        f"insufflation in {seconds} s, reference written": _insufflation(seconds, True)
        for seconds in (2, 10, 60)
    },
    "insufflation in 10 s during a press, slow release": Course(
        70.0,
        polyline((0, 0), (20.0, 0), (21.0, 2.0), (36.0, 2.0), (56.0, 0), (1e3, 0)),
        cavity_kpa=polyline((0, 0), (22.0, 0), (32.0, CAVITY_KPA), (1e3, CAVITY_KPA)),
    ),
    "insertion into a body": _repeated(4, 15.0, balloon_k=15.0),
    "warming by 2 K": _repeated(8, 60.0, circuit_k=2.0),
    "creep": _repeated(4, 15.0, creep=0.02, creep_s=60.0),
    "leak of 0.01 kPa/s": _repeated(4, 15.0, leak_kpa_per_s=0.01),
    "press with 1 N for two minutes": Course(160.0, presses((1.0, 2.0, 120.0, 5.0), NORMAL)),
    "leak of 0.01 kPa/s, press at 0.06 N/s": Course(
        150.0, presses((1.0, 0.06, 20.0, 10.0), start_s=60.0), leak_kpa_per_s=0.01
    ),
    "leak of 0.01 kPa/s, press at 0.02 N/s": Course(
        190.0, presses((1.0, 0.02, 20.0, 10.0), start_s=60.0), leak_kpa_per_s=0.01
    ),
}
#: Step of the pressure around the balloon that the instrument reads as a contact. Only a written reference
#: pressure separates it from a contact.
INDISTINGUISHABLE = "insufflation in 2 s"


def _print_shares(setpoint_kpa=8.0, plant="published"):
    settings = None if plant == "published" else calibrated_settings(plant)
    print(f"{'course':52s} {'valid':>6s} {'within 2u':>9s} {'largest error':>13s} {'largest u':>9s}")
    for name, course in COURSES.items():
        outcome = measure(replace(course, setpoint_kpa=setpoint_kpa, plant=plant), settings=settings)
        largest_n = np.nanmax(outcome.std_n)
        print(
            f"{name:52s} {outcome.valid.mean():6.1%} {outcome.covered:9.2%} {outcome.worst:11.2f} u "
            f"{largest_n:7.2f} N",
            flush=True,
        )


if __name__ == "__main__":
    _print_shares(*(float(text) if text[0].isdigit() else text for text in sys.argv[1:]))
