"""Synthetic trials with known contacts. The pressure is proportional to the force and has the tube's lag."""

import numpy as np

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.validation.contacts import find_contacts
from pneuforce.instrument.validation.processed_trial import exponential_filter, process_trials
from pneuforce.instrument.validation.trial import TrialSample, split_trials

SETTINGS = ChainSettings()
STEP_S, BASELINE_KPA, KPA_PER_N = 0.002, 8.0, 1.2


def force_n(duration_s, *presses):
    """Return times [s] and forces [N]. If presses overlap, the force is that of the strongest press.

    A press is a tuple: begin [s], rise time [s], hold time [s], peak [N]. Its flanks are half cosines.
    """
    t_s = np.arange(0.0, duration_s, STEP_S)
    force = np.zeros_like(t_s)
    for begin_s, rise_s, hold_s, peak_n in presses:
        elapsed_s = t_s - begin_s
        progress = np.minimum(elapsed_s / rise_s, (2 * rise_s + hold_s - elapsed_s) / rise_s)
        force = np.maximum(force, peak_n * 0.5 * (1 - np.cos(np.pi * np.clip(progress, 0, 1))))
    return t_s, force


def trial(t_s, force, noise_kpa=0.0, seed=1):
    """Return a trial with this true force and the pressure that the force causes."""
    steps_s = np.full(len(t_s), STEP_S)
    pressure = exponential_filter(BASELINE_KPA + KPA_PER_N * force, steps_s, SETTINGS.tube_time_constant_s)
    pressure += np.random.default_rng(seed).normal(0.0, 1.0, len(t_s)) * noise_kpa
    columns = zip(t_s.tolist(), pressure.tolist(), force.tolist(), strict=True)
    [only] = split_trials(TrialSample(*values, "one") for values in columns)
    return only


def contacts(t_s, force, noise_kpa=0.0):
    """Return the contacts that are found in a trial with this true force."""
    [processed] = process_trials([trial(t_s, force, noise_kpa)], SETTINGS)
    return find_contacts(processed, SETTINGS)
