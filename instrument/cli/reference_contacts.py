"""Reference contacts on the simulated rig: its force cell beside the instrument's pressures."""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterable, Iterator
from statistics import fmean
from typing import NamedTuple

from instrument.chain import ChainSettings
from instrument.cli.measured_scenario import measured
from instrument.measurement import Measurement
from sim.headless import Playback
from sim.rig import Truth
from sim.scenario import Scenario

CONTACTS_PER_SETPOINT = 3
#: Spans of the contacts; the setpoint is reached within 0.1 kPa, and must stay in the validated range.
SETPOINTS_KPA = (5.05, 11.35)
FORCES_N = (0.2, 3.5)
CELL_STD_N = 0.01  #: noise of the force cell
HOLD_S, SETTLED, PAUSE_S = 1.2, 300, 1.5  #: samples of a plateau that are not looked at


class ReferenceContact(NamedTuple):
    """One plateau, as the instrument and a force cell see it."""

    initial_kpa: float
    final_kpa: float
    force_n: float
    force_std_n: float


def reference_contacts(plant: str, count: int, seed: int) -> Iterator[ReferenceContact]:
    """Contacts spread evenly over setpoints and forces, in an order drawn by lot, on a scenario's plant."""
    playback = Playback(_scenario(plant, count, seed))
    cell = random.Random(seed)
    for plateau in _plateaus(measured(playback, ChainSettings())):
        shown = [m for m, _ in plateau if m.in_contact]
        if len(shown) == len(plateau):
            yield ReferenceContact(
                fmean(m.initial_kpa for m in shown),
                fmean(m.initial_kpa + m.rise_kpa for m in shown),
                fmean(truth.force_n for _, truth in plateau) + cell.gauss(0.0, CELL_STD_N),
                CELL_STD_N,
            )


def as_csv(plant: str, count: int, seed: int) -> Iterator[str]:
    """The lines of a file for `pneuforce calibrate force`."""
    yield ",".join(ReferenceContact._fields)
    for contact in reference_contacts(plant, count, seed):
        yield ",".join(f"{value:.5f}" for value in contact)


def _scenario(plant: str, count: int, seed: int) -> Scenario:
    lot = random.Random(seed)
    setpoints = spread(SETPOINTS_KPA, -(-count // CONTACTS_PER_SETPOINT), lot)
    forces = iter(spread(FORCES_N, count, lot))
    press = {"kind": "press", "hold_s": HOLD_S, "pause_s": PAUSE_S}
    groups = ((kpa, list(itertools.islice(forces, CONTACTS_PER_SETPOINT))) for kpa in setpoints)
    phases = [{"setpoint_kpa": kpa, "contact": [press | {"force_n": part}]} for kpa, part in groups]
    return Scenario.model_validate(
        {"doc": "reference contacts", "seed": seed, "plant": {"kind": plant}, "phase": phases}
    )


def spread(span: tuple[float, float], count: int, lot: random.Random) -> list[float]:
    """One number drawn in each of `count` equal parts of a span, shuffled."""
    low, high = span
    drawn = [round(low + (high - low) * (n + lot.random()) / count, 3) for n in range(count)]
    lot.shuffle(drawn)
    return drawn


def _plateaus(pairs: Iterable[tuple[Measurement, Truth]]) -> Iterator[list[tuple[Measurement, Truth]]]:
    """The settled samples of each force that stays."""
    for force_n, same in itertools.groupby(pairs, key=lambda pair: pair[1].force_n):
        plateau = list(same)[SETTLED:]
        if force_n > 0 and plateau:
            yield plateau
