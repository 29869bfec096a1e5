"""Population of simulated balloons: rubber, thickness, friction and gas differ from balloon to balloon."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from pneuforce.instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA
from pneuforce.instrument.model.pressure_bins import BIN_COUNT
from pneuforce.sim.plants.membrane.material import RUBBERS, Skin
from pneuforce.sim.plants.membrane.paths import Contact, PressedBalloon, SealedCircuit, Sides
from pneuforce.sim.plants.membrane.press_path import free_radius_mm, limit_kpa, press_path
from pneuforce.sim.plants.plant import AMBIENT_KPA, TUBES_MM3

Floats = npt.NDArray[np.float64]

LAWS = ("mooney-rivlin", "gent", "ogden")
#: Spans of the properties, each with a uniform distribution. The unevenness is that of `Skin`.
THICKNESS_SPAN, UNEVENNESS_SPAN, VOLUME_SPAN = (0.85, 1.15), (-0.1, 0.1), (0.99, 1.01)
FORCE_SPAN_N = 0.2, 3.5
#: Exponent of the gas at rest, and its span for sudden contacts.
GAS_EXPONENT_AT_REST, GAS_EXPONENT_SPAN = 1.0, (1.0, 1.2)
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
    sides: Sides
    grip: float  #: position between the sliding (0) and the sticking balloon (1)
    tubes_mm3: float
    gas_exponent: float  #: exponent of the gas in sudden contacts

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
    evaluated: Contacts  #: contacts at rest, like those with the weight and for the calibration
    fast: Contacts  #: sudden contacts with the ΔP_i and the forces of the evaluated contacts


def draw(number: int, generator: np.random.Generator) -> SimulatedBalloon:
    """Return a random balloon. Rubber law and number of pressed sides follow from the number."""
    law = LAWS[number % len(LAWS)]
    rubber = replace(
        RUBBERS[law], thickness_mm=RUBBERS[law].thickness_mm * generator.uniform(*THICKNESS_SPAN)
    )
    return SimulatedBalloon(
        law,
        Skin(rubber, generator.uniform(*UNEVENNESS_SPAN)),
        2 if number // len(LAWS) % 2 else 1,
        generator.uniform(),
        TUBES_MM3 * generator.uniform(*VOLUME_SPAN),
        generator.uniform(*GAS_EXPONENT_SPAN),
    )


def measure(balloon: SimulatedBalloon, generator: np.random.Generator) -> BalloonData:
    """Return simulated measurements on a balloon."""
    pressure = np.linspace(LOWEST_RADIUS_KPA, balloon.highest_kpa + 0.5, RADIUS_POINTS)
    radius = free_radius_mm(balloon.skin, pressure) + generator.normal(0, RADIUS_STD_MM, RADIUS_POINTS)
    weight = np.array([[min(WEIGHT_KPA, balloon.highest_kpa)], [WEIGHT_G * 1e-3 * GRAVITY_M_PER_S2]])
    calibration = _pressures_and_forces(balloon, 8, 3, generator)
    evaluated = _pressures_and_forces(balloon, BIN_COUNT, 4, generator)
    pressed = [weight, calibration, evaluated, evaluated]
    counts = [part.shape[1] for part in pressed]
    exponents = np.repeat([GAS_EXPONENT_AT_REST] * 3 + [balloon.gas_exponent], counts)
    found = _press(balloon, np.concatenate(pressed, axis=1), exponents, generator)
    part, shown = np.repeat(range(len(pressed)), counts), _shown(found)
    weight_contact, calibrated, at_rest, fast = (
        found.select((part == number) & shown) for number in range(len(pressed))
    )
    noisy_n = calibrated.force_n + generator.normal(0, REFERENCE_STD_N, len(calibrated.force_n))
    return BalloonData(
        balloon,
        pressure,
        radius,
        weight_contact,
        calibrated._replace(force_n=noisy_n),
        at_rest,
        fast,
    )


def _shown(contacts: Contacts) -> npt.NDArray[np.bool_]:
    """Return a mask of the contacts that the instrument can show.

    The others flatten the balloon, exceed the limit of the pressure, or are too light to be detected.
    """
    rise = contacts.final_kpa - contacts.baseline_kpa
    return (contacts.final_kpa < CONTACT_LIMIT_KPA) & (rise > MIN_RISE_KPA)


def _pressures_and_forces(
    balloon: SimulatedBalloon, pressures: int, forces: int, generator: np.random.Generator
) -> Floats:
    """Return ΔP_i and force of contacts, one column each.

    ΔP_i is one random value from each of `pressures` equal parts of the range, without those out of reach.
    Each ΔP_i has one random force from each of `forces` equal parts of the span.
    """
    edges = np.linspace(VALID_LOW_KPA, VALID_HIGH_KPA, pressures + 1)
    baseline = generator.uniform(edges[:-1], edges[1:])
    baseline = baseline[baseline <= balloon.highest_kpa]
    low_n, high_n = FORCE_SPAN_N
    part = np.arange(forces)[:, None] + generator.uniform(size=(forces, len(baseline)))
    force = low_n + (high_n - low_n) * part / forces
    return np.stack([np.broadcast_to(baseline, force.shape).ravel(), force.ravel()])


def _press(
    balloon: SimulatedBalloon, wanted: Floats, exponents: Floats, generator: np.random.Generator
) -> Contacts:
    """Return contacts with these ΔP_i and forces (2, contacts), and these gas exponents (contacts).

    ΔP_f is NaN if the balloon is too flat.
    """
    starts, column = np.unique([wanted[0], exponents], axis=1, return_inverse=True)
    baselines, final = starts[0], np.zeros(wanted.shape[1])
    circuit = SealedCircuit(balloon.tubes_mm3, AMBIENT_KPA, starts[1])
    contacts: tuple[tuple[Contact, float], ...] = (("slide", 1 - balloon.grip), ("stick", balloon.grip))
    for contact, share in contacts:
        path = press_path(PressedBalloon(balloon.skin, balloon.sides, contact, circuit), baselines)
        final += share * np.diagonal(path.at(wanted[1]).final_kpa[:, column])
    noise = generator.normal(0, [[BASELINE_STD_KPA], [FINAL_STD_KPA]], wanted.shape)
    return Contacts(wanted[0] + noise[0], final + noise[1], wanted[1])
