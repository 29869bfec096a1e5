"""Population of simulated balloons: rubber, thickness, friction and gas differ from balloon to balloon."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from pneuforce.instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA
from pneuforce.instrument.model.pressure_bins import BIN_EDGES_KPA
from pneuforce.sim.plants.membrane.material import RUBBERS, Skin
from pneuforce.sim.plants.membrane.paths import PressedBalloon, SealedCircuit
from pneuforce.sim.plants.membrane.press_path import PressPath, free_radius_mm, limit_kpa, press_path
from pneuforce.sim.plants.plant import AMBIENT_KPA, TUBES_MM3

Floats = npt.NDArray[np.float64]

LAWS = ("mooney-rivlin", "gent", "ogden")
#: Spans of the properties, each with a uniform distribution. The unevenness is that of `Skin`.
THICKNESS_SPAN, UNEVENNESS_SPAN, VOLUME_SPAN = (0.85, 1.15), (-0.1, 0.1), (0.99, 1.01)
GAS_EXPONENT_SPAN, FORCE_SPAN_N = (1.0, 1.2), (0.2, 3.5)
#: Standard deviations of the noise: of ΔP_i, of ΔP_f at rest, of the radius by a caliper, and of the
#: reference force.
BASELINE_STD_KPA, FINAL_STD_KPA, RADIUS_STD_MM, REFERENCE_STD_N = 0.002, 0.010, 0.03, 0.01
#: Highest pressure of the free balloon, as a share of its limit pressure (docs/calibration.md).
MAX_LIMIT_SHARE = 0.9
#: Pressure of the contact at which the instrument vents [kPa].
CONTACT_LIMIT_KPA = 18.0
RADIUS_POINTS, LOWEST_RADIUS_KPA = 12, 2.0
WEIGHT_G, WEIGHT_KPA, GRAVITY_M_PER_S2 = 150.0, 8.0, 9.80665
MIN_RISE_KPA = 0.06  #: a smaller rise is not detected as a contact


class SimulatedBalloon(NamedTuple):
    """One balloon of the population in its circuit."""

    law: str
    skin: Skin
    sides: int
    grip: float  #: position between the sliding (0) and the sticking balloon (1)
    tubes_mm3: float
    gas_exponent: float

    @property
    def highest_kpa(self) -> float:
        """Return the highest ΔP_i to which an operator inflates the balloon."""
        return min(VALID_HIGH_KPA, MAX_LIMIT_SHARE * limit_kpa(self.skin))


class Contacts(NamedTuple):
    """Measured contacts: arrays of equal length."""

    baseline_kpa: Floats
    final_kpa: Floats
    force_n: Floats  #: true force

    def select(self, rows: npt.NDArray[np.bool_]) -> Contacts:
        """Return the contacts of these rows."""
        return Contacts(*(values[rows] for values in self))


class BalloonData(NamedTuple):
    """Everything that is measured on one balloon."""

    balloon: SimulatedBalloon
    radius_kpa: Floats  #: pressures at which the radius was measured
    radius_mm: Floats
    weight: Contacts  #: one contact by a known weight
    calibration: Contacts  #: contacts for a force calibration, with a noisy reference force
    evaluated: Contacts


def draw(number: int, generator: np.random.Generator) -> SimulatedBalloon:
    """Return a random balloon. Rubber law and number of pressed sides follow from the number."""
    law = LAWS[number % len(LAWS)]
    rubber = replace(
        RUBBERS[law], thickness_mm=RUBBERS[law].thickness_mm * generator.uniform(*THICKNESS_SPAN)
    )
    return SimulatedBalloon(
        law,
        Skin(rubber, generator.uniform(*UNEVENNESS_SPAN)),
        1 + number // len(LAWS) % 2,
        generator.uniform(),
        TUBES_MM3 * generator.uniform(*VOLUME_SPAN),
        generator.uniform(*GAS_EXPONENT_SPAN),
    )


def measure(balloon: SimulatedBalloon, generator: np.random.Generator) -> BalloonData:
    """Return simulated measurements on a balloon."""
    pressure = np.linspace(LOWEST_RADIUS_KPA, balloon.highest_kpa + 0.5, RADIUS_POINTS)
    radius = free_radius_mm(balloon.skin, pressure) + generator.normal(0, RADIUS_STD_MM, RADIUS_POINTS)
    weight_n = np.array([[WEIGHT_G * 1e-3 * GRAVITY_M_PER_S2]])
    at_kpa = np.array([min(WEIGHT_KPA, balloon.highest_kpa)])
    calibration = contacts(balloon, _baselines(balloon, 8, generator), 3, generator)
    noisy_n = calibration.force_n + generator.normal(0, REFERENCE_STD_N, len(calibration.force_n))
    return BalloonData(
        balloon,
        pressure,
        radius,
        _measured(balloon, at_kpa, weight_n, generator),
        calibration._replace(force_n=noisy_n),
        contacts(balloon, _baselines(balloon, len(BIN_EDGES_KPA) - 1, generator), 4, generator),
    )


def contacts(
    balloon: SimulatedBalloon, baseline_kpa: Floats, per_baseline: int, generator: np.random.Generator
) -> Contacts:
    """Return contacts with random forces, one from each of `per_baseline` equal parts of the span."""
    low_n, high_n = FORCE_SPAN_N
    parts = np.arange(per_baseline)[:, None] + generator.uniform(size=(per_baseline, len(baseline_kpa)))
    return _measured(balloon, baseline_kpa, low_n + (high_n - low_n) * parts / per_baseline, generator)


def _baselines(balloon: SimulatedBalloon, count: int, generator: np.random.Generator) -> Floats:
    """Return one random ΔP_i from each of `count` equal parts of the range, without those out of reach."""
    edges = np.linspace(VALID_LOW_KPA, VALID_HIGH_KPA, count + 1)
    drawn: Floats = generator.uniform(edges[:-1], edges[1:])
    return drawn[drawn <= balloon.highest_kpa]


def _measured(
    balloon: SimulatedBalloon, baseline_kpa: Floats, force_n: Floats, generator: np.random.Generator
) -> Contacts:
    """Return contacts with these forces (forces, baselines), without those that the instrument cannot show.

    These are contacts that flatten the balloon, that exceed the limit of the pressure, or that are too light
    to be detected.
    """
    final = (1 - balloon.grip) * _final_kpa(balloon, "slide", baseline_kpa, force_n)
    final += balloon.grip * _final_kpa(balloon, "stick", baseline_kpa, force_n)
    baseline = np.broadcast_to(baseline_kpa, final.shape)
    shown = (final < CONTACT_LIMIT_KPA) & (final - baseline > MIN_RISE_KPA)
    count = int(shown.sum())
    return Contacts(
        baseline[shown] + generator.normal(0, BASELINE_STD_KPA, count),
        final[shown] + generator.normal(0, FINAL_STD_KPA, count),
        force_n[shown],
    )


def _final_kpa(balloon: SimulatedBalloon, contact: str, baseline_kpa: Floats, force_n: Floats) -> Floats:
    """Return the true ΔP_f of a skin that slides or sticks, (forces, baselines)."""
    circuit = SealedCircuit(balloon.tubes_mm3, AMBIENT_KPA, balloon.gas_exponent)
    path = press_path(PressedBalloon(balloon.skin, balloon.sides, contact, circuit), baseline_kpa)  # type: ignore[arg-type]
    finals = [
        PressPath(*(values[:, [column]] for values in path)).at(forces).final_kpa[:, 0]
        for column, forces in enumerate(force_n.T)
    ]
    return np.stack(finals, axis=1)
