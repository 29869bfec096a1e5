"""Courses of a locked balloon: true force and pressure, and the measurements of the chain for each sample.

The pressure follows from a force on the balloon, from changes of the gas and of the surroundings, or from
both. The pneumatic circuit is simulated in steps of `COARSE_S`. Between the steps, the pressure is linear.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from pneuforce.instrument.calibration.apply import COMPENSATED_INPUTS
from pneuforce.instrument.calibration.force import fit_force
from pneuforce.instrument.calibration.residuals import share_and_floor
from pneuforce.instrument.measurement.chain import Chain
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model.uncertainty import ModelUncertainty
from pneuforce.instrument.rig.link import RawSample
from pneuforce.protocol.frames import BoardState, Sample, Valve
from pneuforce.sim.plants.plant import amount_kpa_mm3
from pneuforce.sim.pneumatics import Pneumatics, PneumaticSettings
from tests.instrument.calibration.plant_contacts import plant_contacts, plant_of
from tests.instrument.instrument_harness import adc_sum_of

COARSE_S = 0.02
NOISE_COUNTS = 4 * (0.7**2 + 1 / 12) ** 0.5  # standard deviation of the sum of 16 conversions
REFERENCE_PERIOD_S = 0.1  #: interval of the writes of the pressure around the balloon
START_S = 10.0  #: time from the lock to the first change


def polyline(*points):
    """Return the piecewise linear function through points of time and value."""
    times_s, values = zip(*points, strict=True)
    return lambda t_s: float(np.interp(t_s, times_s, values))


def presses(*steps, start_s=START_S):
    """Return a force [N] as a function of time, from steps of force, rate [N/s], hold and pause [s]."""
    points = [(0.0, 0.0), (start_s, 0.0)]
    for force_n, rate_n_per_s, hold_s, pause_s in steps:
        for to_n, duration_s in (
            (force_n, force_n / rate_n_per_s),
            (force_n, hold_s),
            (0.0, force_n / rate_n_per_s),
            (0.0, pause_s),
        ):
            points.append((points[-1][0] + max(duration_s, 1e-6), to_n))
    return polyline(*points)


def _zero(_t_s):
    return 0.0


@dataclass(frozen=True)
class Course:
    """Force and disturbances of a balloon that is locked at the time 0."""

    seconds: float
    force_n: Callable[[float], float] = _zero
    cavity_kpa: Callable[[float], float] = _zero  #: pressure around the balloon, relative to the room
    setpoint_kpa: float = 8.0
    plant: str = "published"
    inlet_leak_kpa_per_s: float = 0.0  #: from `START_S` on
    leak_kpa_per_s: float = 0.0003
    balloon_k: float = 0.0  #: warming from `START_S` on
    circuit_k: float = 0.0  #: warming from `START_S` on
    creep: float = 0.0
    creep_s: float = 600.0
    tops_up: bool = False  #: True if the board tops up the balloon
    reference_written: bool = False  #: True if a master writes the pressure around the balloon

    def simulate(self):
        """Return times, sensor pressures, true forces and board states, every `COARSE_S`."""
        plant = plant_of(self.plant)
        settings = PneumaticSettings(
            creep=self.creep, creep_s=self.creep_s, leak_kpa_per_s=self.leak_kpa_per_s
        )
        amount = amount_kpa_mm3(plant, self.setpoint_kpa)
        gas = Pneumatics(settings, amount, self.setpoint_kpa, Valve.VENT_CLOSED)
        times_s = np.arange(0.0, self.seconds, COARSE_S)
        pressures_kpa, forces_n = np.empty_like(times_s), np.empty_like(times_s)
        for n, t_s in enumerate(times_s.tolist()):
            if t_s >= START_S:
                gas.inlet_leak_kpa_per_s = self.inlet_leak_kpa_per_s
                gas.balloon_temperature.target_k = self.balloon_k
                gas.circuit_temperature.target_k = self.circuit_k
            gas.reference_kpa = self.cavity_kpa(t_s)
            forces_n[n] = self.force_n(t_s)
            gas.step(plant.settle(gas.gas, forces_n[n]), Valve.VENT_CLOSED, COARSE_S)
            pressures_kpa[n] = gas.sensor_kpa
        return times_s, pressures_kpa, forces_n


@dataclass
class Outcome:
    """Measurements of one course: one element for each sample."""

    t_s: np.ndarray
    truth_n: np.ndarray
    force_n: np.ndarray  #: NaN if the force is not valid
    std_n: np.ndarray
    in_contact: np.ndarray
    chain: Chain = field(repr=False)

    @property
    def valid(self):
        """Return a mask of the samples with a valid force."""
        return np.isfinite(self.force_n + self.std_n)

    @property
    def covered(self):
        """Return the share of the samples with a valid force whose true force is within ±2u."""
        return self._share_within(2.0)

    @property
    def worst(self):
        """Return the largest error of a valid force in multiples of u."""
        valid = self.valid
        return float((np.abs(self.force_n - self.truth_n)[valid] / self.std_n[valid]).max(initial=0.0))

    def _share_within(self, multiple):
        valid = self.valid
        inside = np.abs(self.force_n - self.truth_n)[valid] <= multiple * self.std_n[valid]
        return float(inside.mean()) if valid.any() else math.nan


@cache
def calibrated_settings(plant):
    """Return settings with a force calibration of a simulated balloon, by 24 contacts."""
    settings = ChainSettings()
    calibration = fit_force(plant_contacts(plant, settings, seed=1), settings)
    share, floor_n = share_and_floor(calibration.chosen.held_out_n, calibration.contacts)
    model = ModelUncertainty.constant(share, floor_n)
    inputs = replace(settings.input_uncertainties, **dict.fromkeys(COMPENSATED_INPUTS, 0.0))
    return replace(
        settings,
        correction=calibration.correction,
        model_uncertainty=model,
        input_uncertainties=inputs,
    )


def measure(course, sample_s=0.002, seed=5, settings=None):
    """Return the outcome of a course."""
    coarse_s, pressures_kpa, forces_n = course.simulate()
    t_s = np.arange(0.0, course.seconds - COARSE_S, sample_s)
    low, high = adc_sum_of(0.0), adc_sum_of(50.0)
    noise = np.random.default_rng(seed).normal(0.0, NOISE_COUNTS, len(t_s))
    counts = low + (high - low) * np.interp(t_s, coarse_s, pressures_kpa) / 50.0
    sums = np.rint(counts + noise).astype(int).tolist()
    chain = Chain(settings or ChainSettings())
    chain.zero.zero_kpa = 0.0
    rows, every = [], round(REFERENCE_PERIOD_S / sample_s)
    for n, adc_sum in enumerate(sums):
        if course.reference_written and n % every == 0:
            chain.check_reference(course.cavity_kpa(t_s[n]))
        sample = Sample(0, adc_sum, 5000, Valve.VENT_CLOSED, BoardState.HOLDING, 0, 0, 0, 8000)
        m = chain.step(RawSample(0, float(t_s[n]), sample, sample_s))
        rows.append((m.force_n, m.force_std_n, m.in_contact))
    force_n, std_n, in_contact = np.array(rows, dtype=float).T
    truth_n = np.interp(t_s, coarse_s, forces_n)
    return Outcome(t_s, truth_n, force_n, std_n, in_contact > 0, chain)
