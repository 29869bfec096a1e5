"""Reference contacts on the simulated rig: pressures from the instrument, forces from a force sensor."""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterable, Iterator
from statistics import fmean
from typing import NamedTuple

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.measurement import Measurement
from pneuforce.instrument.studies.measured_playback import measure_playback
from pneuforce.sim.headless import Playback
from pneuforce.sim.rig import Truth
from pneuforce.sim.scenario import PlantTable, Scenario

CONTACTS_PER_SETPOINT = 3
#: Span of the setpoints. The board reaches a setpoint within 0.1 kPa, so ΔP_i is in the validated range.
SETPOINT_SPAN_KPA = (5.05, 11.35)
FORCE_SPAN_N = (0.2, 3.5)
REFERENCE_STD_N = 0.01  #: noise of the simulated force sensor
HOLD_S, PAUSE_S = 1.2, 1.5
SETTLING_SAMPLES = 300  #: samples at the beginning of a plateau that are not used


class ReferenceContact(NamedTuple):
    """One plateau: pressures from the instrument, force from the simulated force sensor."""

    baseline_kpa: float
    final_kpa: float
    force_n: float
    force_std_n: float


def reference_contacts(plant: PlantTable, count: int, seed: int) -> Iterator[ReferenceContact]:
    """Yield contacts on a simulated balloon.

    Setpoints and forces are spread evenly over their spans, in random order.
    """
    playback = Playback(_scenario(plant, count, seed))
    noise = random.Random(seed)
    for plateau in _plateaus(measure_playback(playback, ChainSettings())):
        in_contact = [m for m, _ in plateau if m.in_contact]
        if len(in_contact) == len(plateau):
            yield ReferenceContact(
                fmean(m.baseline_kpa for m in in_contact),
                fmean(m.baseline_kpa + m.rise_kpa for m in in_contact),
                fmean(truth.force_n for _, truth in plateau) + noise.gauss(0.0, REFERENCE_STD_N),
                REFERENCE_STD_N,
            )


def as_csv(plant: PlantTable, count: int, seed: int) -> Iterator[str]:
    """Yield the lines of a CSV file for `pneuforce calibrate force`."""
    yield ",".join(ReferenceContact._fields)
    for contact in reference_contacts(plant, count, seed):
        yield ",".join(f"{value:.5f}" for value in contact)


def _scenario(plant: PlantTable, count: int, seed: int) -> Scenario:
    generator = random.Random(seed)
    setpoints = spread(SETPOINT_SPAN_KPA, -(-count // CONTACTS_PER_SETPOINT), generator)
    forces = iter(spread(FORCE_SPAN_N, count, generator))
    press = {"kind": "press", "hold_s": HOLD_S, "pause_s": PAUSE_S}
    groups = ((kpa, list(itertools.islice(forces, CONTACTS_PER_SETPOINT))) for kpa in setpoints)
    phases = [{"setpoint_kpa": kpa, "contact": [press | {"force_n": part}]} for kpa, part in groups]
    return Scenario.model_validate(
        {"doc": "reference contacts", "seed": seed, "plant": plant, "phase": phases}
    )


def spread(span: tuple[float, float], count: int, generator: random.Random) -> list[float]:
    """Return one random number from each of `count` equal parts of a span, in random order."""
    low, high = span
    numbers = [round(low + (high - low) * (n + generator.random()) / count, 3) for n in range(count)]
    generator.shuffle(numbers)
    return numbers


def _plateaus(pairs: Iterable[tuple[Measurement, Truth]]) -> Iterator[list[tuple[Measurement, Truth]]]:
    """Yield the settled samples of each period of constant force."""
    for force_n, same in itertools.groupby(pairs, key=lambda pair: pair[1].force_n):
        plateau = list(same)[SETTLING_SAMPLES:]
        if force_n > 0 and plateau:
            yield plateau
