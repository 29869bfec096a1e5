"""Contacts on simulated balloons in static equilibrium, for tests that need many force calibrations."""

from functools import cache

import numpy as np

from pneuforce.instrument.calibration.contacts import CalibrationContacts
from pneuforce.instrument.model import estimate
from pneuforce.sim.plants.membrane.material import MOONEY_RIVLIN, NEO_HOOKEAN
from pneuforce.sim.plants.membrane.plant import MembranePlant
from pneuforce.sim.plants.plant import Gas, amount_kpa_mm3
from pneuforce.sim.plants.published import PublishedPlant

#: All simulated balloons: a name, and a function that returns the plant.
PLANTS = {
    "published": PublishedPlant,
    "published, smooth": lambda: PublishedPlant(low="smooth"),
    "Mooney-Rivlin, 1 side": lambda: MembranePlant(MOONEY_RIVLIN, sides=1),
    "Mooney-Rivlin, 2 sides": lambda: MembranePlant(MOONEY_RIVLIN, sides=2),
    "neo-Hookean, 1 side": lambda: MembranePlant(NEO_HOOKEAN, sides=1),
    "neo-Hookean, 2 sides": lambda: MembranePlant(NEO_HOOKEAN, sides=2),
}
ALL_SETPOINTS_KPA, FORCES_N = (5.05, 11.35), (0.2, 3.5)
PRESSURE_STD_KPA, REFERENCE_STD_N, ONSET_KPA = 0.004, 0.01, 0.06


@cache
def plant_of(name):
    return PLANTS[name]()


def plant_contacts(name, settings, seed, count=24, setpoints_kpa=ALL_SETPOINTS_KPA, forces_n=FORCES_N):
    """Return contacts with a noisy pressure and a noisy reference force, three at each setpoint."""
    plant, generator = plant_of(name), np.random.default_rng(seed)
    baseline = np.repeat(generator.uniform(*setpoints_kpa, -(-count // 3)), 3)[:count]
    parts = (generator.permutation(count) + generator.uniform(size=count)) / count
    force_n = forces_n[0] + (forces_n[1] - forces_n[0]) * parts
    pressed = [
        plant.settle(Gas(amount_kpa_mm3(plant, kpa)), n).pressure_kpa
        for kpa, n in zip(baseline.tolist(), force_n.tolist(), strict=True)
    ]
    rise = np.array(pressed) - baseline + generator.normal(0, PRESSURE_STD_KPA, count)
    force_n = force_n + generator.normal(0, REFERENCE_STD_N, count)
    rows = (rise > ONSET_KPA) & (force_n > 0)
    baseline, rise, force_n = baseline[rows], rise[rows], force_n[rows]
    law, balloon = settings.law, settings.balloon
    law_n = estimate(baseline, baseline + rise, balloon, settings.circuit, law).force_n
    std_n = np.full(len(rise), REFERENCE_STD_N)
    return CalibrationContacts(
        baseline, rise, force_n, std_n, law_n, law.small_strain_weight(baseline, balloon)
    )
