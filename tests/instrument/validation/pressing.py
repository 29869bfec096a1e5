"""Recordings of known contacts: a pressure that rises with the force, behind the lag of the tube."""

import numpy as np

from instrument.chain import ChainSettings
from instrument.validation.contacts import contacts_of
from instrument.validation.course import courses_of, exponential
from instrument.validation.trial import Sample, trials_of

SETTINGS = ChainSettings()
STEP_S, BASELINE_KPA, KPA_PER_N = 0.002, 8.0, 1.2


def force_n(lasts_s, *presses):
    """A force that is the highest of half-cosine presses (begin, rise, hold in s, peak in N)."""
    t_s = np.arange(0.0, lasts_s, STEP_S)
    force = np.zeros_like(t_s)
    for begin_s, rise_s, hold_s, peak_n in presses:
        since_s = t_s - begin_s
        going = np.minimum(since_s / rise_s, (2 * rise_s + hold_s - since_s) / rise_s)
        force = np.maximum(force, peak_n * 0.5 * (1 - np.cos(np.pi * np.clip(going, 0, 1))))
    return t_s, force


def trial(t_s, force, noise_kpa=0.0, seed=1):
    """The one trial in which this force is recorded."""
    steps_s = np.full(len(t_s), STEP_S)
    pressure = exponential(BASELINE_KPA + KPA_PER_N * force, steps_s, SETTINGS.tube_s)
    pressure += np.random.default_rng(seed).normal(0.0, 1.0, len(t_s)) * noise_kpa
    rows = (
        Sample(*sample, "one") for sample in zip(t_s.tolist(), pressure.tolist(), force.tolist(), strict=True)
    )
    [made] = trials_of(rows)
    return made


def contacts(t_s, force, noise_kpa=0.0):
    """The contacts that are found in it."""
    [course] = courses_of([trial(t_s, force, noise_kpa)], SETTINGS)
    return contacts_of(course, SETTINGS)
