"""Accuracy of the method membrane on simulated rigs in time, whose gas heats and cools in each contact.

The population of balloons (`population_study.py`) has no time: each contact is compressed from the true ΔP_i.
Here, the instrument measures ΔP_i itself, a short time after the release of the contact before.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from datetime import date
from itertools import groupby
from statistics import fmean
from typing import NamedTuple

import numpy as np

from pneuforce.instrument.calibration import file, grip, parts, radius
from pneuforce.instrument.calibration.apply import apply_calibration
from pneuforce.instrument.calibration.sections import RadiusPart
from pneuforce.instrument.measurement.chain import Chain
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.measurement import Measurement
from pneuforce.instrument.model import LIVE_LAW
from pneuforce.instrument.model.uncertainty import InputUncertainties
from pneuforce.instrument.rig.link import Link, RawSample
from pneuforce.instrument.studies.balloon_population import (
    GRAVITY_M_PER_S2,
    LOWEST_RADIUS_KPA,
    RADIUS_POINTS,
    WEIGHT_G,
    WEIGHT_KPA,
)
from pneuforce.instrument.studies.reference_contacts import FORCE_SPAN_N, SETPOINT_SPAN_KPA, spread
from pneuforce.instrument.validation.accuracy import AccuracyScore
from pneuforce.sim.headless import Playback
from pneuforce.sim.plants.membrane.material import RUBBERS, Skin
from pneuforce.sim.plants.membrane.press_path import free_radius_mm
from pneuforce.sim.plants.plant import AMBIENT_KPA
from pneuforce.sim.rig import Truth
from pneuforce.sim.scenario import Scenario
from pneuforce.support.columns import Points

POLYTROPIC = 1.2
CONTACT = 0.5  #: position of the contact between sliding (0) and sticking (1)
SETPOINTS, CONTACTS_PER_SETPOINT = 4, 4
PRESS = {"kind": "press", "hold_s": 1.2, "pause_s": 1.5}
#: Samples at the beginning of a plateau that are not used: the gas exchanges its heat in this time.
SETTLING_SAMPLES = 300
#: Forces from this value on have a relative error, smaller forces an absolute error [N].
RELATIVE_MIN_N = 1.0

Pairs = list[tuple[Measurement, Truth]]


class RigScore(NamedTuple):
    """Results on all rigs."""

    rigs: int
    contacts: int  #: contacts with a force
    score: AccuracyScore  #: plateaus of the contacts, without the weight
    samples_percent: float  #: share of all samples with a valid force whose true force is within ±2u
    false_contact_percent: float  #: share of the time without a true force in which a force was shown


class _Rig(NamedTuple):
    samples: list[tuple[RawSample, Truth]]
    settings: ChainSettings  #: settings with the calibrated grip


def evaluate_rigs(rigs: int, seed: int, report_progress: Callable[[int, int], None]) -> RigScore:
    """Return the results on rigs with different errors of gain and P_0.

    `report_progress` is called with the number of completed rigs and the total number.
    """
    content = file.empty(0).model_copy(update={"radius": _radius_part()})
    plateaus: list[tuple[float, float, float]] = []
    forces: list[tuple[float, float, float]] = []
    for number in range(rigs):
        pairs = _measured_after_weight(_rig(seed + number, content))
        forces += [_force(pair) for pair in pairs if math.isfinite(pair[0].force_std_n)]
        plateaus += [_mean_force(plateau) for plateau in _plateaus(pairs)]
        report_progress(number + 1, rigs)
    known = np.array([row for row in plateaus if all(map(math.isfinite, row))])
    samples = np.array(forces)
    free = samples[:, 2] == 0.0
    return RigScore(
        rigs,
        len(known),
        _score(known),
        100 * float(_covered(samples).mean()),
        100 * float((samples[free, 0] > 0.0).mean()),
    )


def _radius_part() -> RadiusPart:
    pressure = np.linspace(LOWEST_RADIUS_KPA, SETPOINT_SPAN_KPA[1] + 0.5, RADIUS_POINTS)
    radius_mm = free_radius_mm(Skin(RUBBERS["mooney-rivlin"]), pressure)
    points = _points("radius", pressure_kpa=pressure, radius_mm=radius_mm)
    return parts.radius_part(radius.fit_radius(points), points, date.today())


def _points(name: str, **columns: object) -> Points:
    arrays = {key: np.atleast_1d(np.asarray(values, float)) for key, values in columns.items()}
    return Points(name, "", arrays, tuple(range(1, len(next(iter(arrays.values()))) + 1)))


def _rig(seed: int, content: file.Calibration) -> _Rig:
    """Play the contacts on a rig, and calibrate the grip with the first contact, which is a known weight."""
    membrane = ChainSettings.of(replace(LIVE_LAW, method="membrane"))
    settings = apply_calibration(membrane, content)
    samples = list(_raw_samples(Playback(_scenario(seed))))
    weight = next(_plateaus(_measured(samples, settings)))
    points = _points(
        "weight",
        mass_g=WEIGHT_G,
        before_kpa=fmean(m.baseline_kpa for m, _ in weight),
        after_kpa=fmean(m.baseline_kpa + m.rise_kpa for m, _ in weight),
    )
    part = parts.grip_part(grip.fit_grip(points, settings), points, settings, date.today())
    return _Rig(samples, apply_calibration(membrane, content.model_copy(update={"grip": part})))


def _scenario(seed: int) -> Scenario:
    """Return a weight, and then contacts with random forces. Gain and P_0 have errors as in the budget."""
    generator, inputs = random.Random(seed), InputUncertainties()
    forces = iter(spread(FORCE_SPAN_N, SETPOINTS * CONTACTS_PER_SETPOINT, generator))
    weight = PRESS | {"force_n": WEIGHT_G * 1e-3 * GRAVITY_M_PER_S2}
    phases = [{"setpoint_kpa": WEIGHT_KPA, "contact": [weight]}]
    for kpa in spread(SETPOINT_SPAN_KPA, SETPOINTS, generator):
        contact = PRESS | {"force_n": [next(forces) for _ in range(CONTACTS_PER_SETPOINT)]}
        phases.append({"setpoint_kpa": kpa, "contact": [contact]})
    limit = inputs.gain * math.sqrt(3)
    ambient_kpa = AMBIENT_KPA + generator.gauss(0.0, inputs.ambient_kpa)
    return Scenario.model_validate(
        {
            "doc": "contacts on a rig whose gas heats and cools",
            "seed": seed,
            "plant": {"kind": "membrane", "contact": CONTACT},
            "pneumatics": {"polytropic": POLYTROPIC, "ambient_kpa": ambient_kpa},
            "sensor": {"gain_error": generator.uniform(-limit, limit)},
            "phase": phases,
        }
    )


def _raw_samples(playback: Playback) -> Iterator[tuple[RawSample, Truth]]:
    link = Link()
    for received in playback:
        for raw in link.feed(received, playback.now_s):
            yield raw, playback.truth


def _measured(samples: Iterable[tuple[RawSample, Truth]], settings: ChainSettings) -> Pairs:
    chain, pairs = Chain(settings), []
    for raw, truth in samples:
        pairs.append((chain.step(raw), truth))
        if not chain.zero.taken:
            chain.zero.take()
    return pairs


def _measured_after_weight(rig: _Rig) -> Pairs:
    """Return the measurements after the weight was removed."""
    pairs = _measured(rig.samples, rig.settings)
    first = next(n for n, (_, truth) in enumerate(pairs) if truth.force_n > 0.0)
    removed = next(n for n, (_, truth) in enumerate(pairs[first:], first) if truth.force_n == 0.0)
    return pairs[removed:]


def _plateaus(pairs: Pairs) -> Iterator[Pairs]:
    """Yield the settled samples of each contact with a constant force."""
    for force_n, same in groupby(pairs, key=lambda pair: pair[1].force_n):
        plateau = list(same)[SETTLING_SAMPLES:]
        if force_n > 0.0 and plateau and all(m.in_contact for m, _ in plateau):
            yield plateau


def _force(pair: tuple[Measurement, Truth]) -> tuple[float, float, float]:
    return pair[0].force_n, pair[0].force_std_n, pair[1].force_n


def _mean_force(plateau: Pairs) -> tuple[float, float, float]:
    shown_n, std_n, true_n = (fmean(values) for values in zip(*map(_force, plateau), strict=True))
    return shown_n, std_n, true_n


def _covered(rows: np.ndarray) -> np.ndarray:
    return np.asarray(np.abs(rows[:, 0] - rows[:, 2]) <= 2 * rows[:, 1])


def _score(rows: np.ndarray) -> AccuracyScore:
    error, large = rows[:, 0] - rows[:, 2], rows[:, 2] >= RELATIVE_MIN_N
    return AccuracyScore(
        100 * float(np.abs(error / rows[:, 2])[large].mean()),
        float(np.sqrt((error[~large] ** 2).mean())),
        100 * float(_covered(rows).mean()),
    )
