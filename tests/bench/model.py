"""Benchmarks of the force model with arrays of contacts, and of the measuring chain with single samples."""

import statistics
import time
import warnings

import numpy as np
from scipy.optimize import brentq, fsolve

from pneuforce.instrument.measurement.chain import Chain
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import PAPER_LAW, Balloon, Circuit, solve_contact
from pneuforce.instrument.model.contact_geometry import ContactGeometry
from pneuforce.instrument.model.methods import METHODS
from pneuforce.instrument.rig.link import RawSample
from pneuforce.protocol.frames import BoardState, Sample
from tests.instrument.instrument_harness import adc_sum_of

BALLOON, CIRCUIT = Balloon(), Circuit()
ONE_BY_ONE = 100  #: number of contacts for the solvers of scipy, which solve one contact after another


def pairs(count):
    """Return pressures before and during contacts in the validated range."""
    draw = np.random.default_rng(1)
    initial = draw.uniform(4.95, 11.45, count)
    return initial, initial + draw.uniform(0.5, 6.0, count)


def bracketed(baseline_kpa, final_kpa):
    """Return the energy balance of a contact as a function of d, and limits [mm] that enclose its root."""
    weight = PAPER_LAW.small_strain_weight(baseline_kpa, BALLOON)
    pressed = ContactGeometry.between(baseline_kpa, final_kpa, weight, BALLOON, CIRCUIT)
    method = METHODS["energetic"]

    def balance(d):
        # The balance is complex outside its domain.
        return method.balance(float(np.ravel(d)[0]), pressed)[0].real

    return balance, method.lower_bound_mm(pressed), pressed.radius_mm


def by_brentq(baseline_kpa, final_kpa):
    balance, low, high = bracketed(baseline_kpa, final_kpa)
    return brentq(balance, low, high * (1 - 1e-9))


def by_fsolve(baseline_kpa, final_kpa):
    balance, low, high = bracketed(baseline_kpa, final_kpa)
    return fsolve(balance, low + 0.4 * (high - low))[0]


def us_per_sample(work, count, repeats):
    times_s = []
    for _ in range(repeats):
        begun_s = time.perf_counter()
        work()
        times_s.append(time.perf_counter() - begun_s)
    return min(times_s) / count * 1e6


def bench_arrays(brief=False):
    """Print the time [µs] to solve a contact, and the share of contacts for which all solvers agree."""
    initial, final = pairs(ONE_BY_ONE)
    exact = solve_contact(initial, final, BALLOON, CIRCUIT).indentation_mm
    peers = {}
    for name, solve in (("brentq", by_brentq), ("fsolve", by_fsolve)):

        def one_by_one(solve=solve):
            return np.array([solve(p, q) for p, q in zip(initial.tolist(), final.tolist(), strict=True)])

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            agree = np.mean(np.abs(one_by_one() - exact) < 1e-6)
            peers[name] = us_per_sample(one_by_one, ONE_BY_ONE, 3)
        print(
            f"scipy's {name}, one contact after another: {peers[name]:.0f} µs per contact, {agree:.0%} agree"
        )
    for count in (1, 1000) if brief else (1, 1000, 1_000_000):
        p, q = pairs(count)
        if count == 1:
            p, q = float(p[0]), float(q[0])
        us = us_per_sample(
            lambda p=p, q=q: solve_contact(p, q, BALLOON, CIRCUIT), count, 3 if count > 1000 else 200
        )
        print(
            f"{count} contacts solved at once: {us:.2f} µs per contact; "
            f"{peers['fsolve'] / us:.0f} × as fast as fsolve, {peers['brentq'] / us:.0f} × as fast as brentq"
            + (" (target 50 × as fast as fsolve)" if count > 1000 else "")
        )


def bench_chain(brief=False):
    """Print the time per sample of the live chain, without contact and during presses of up to 10 N/s."""
    chain = Chain(ChainSettings())
    chain.zero.zero_kpa = 0.0
    rises = np.clip(2.0 * np.sin(np.linspace(0, 60, 1000 if brief else 15_000)), 0.0, None)
    sums = [adc_sum_of(8.0 + rise) for rise in rises.tolist()]
    free_us, pressed_us = [], []
    for adc_sum in [sums[0]] * 2000 + sums:
        raw = RawSample(0, 0.0, Sample(0, adc_sum, 5000, 0, BoardState.HOLDING, 0, 0, 0, 8000))
        begun_ns = time.perf_counter_ns()
        measurement = chain.step(raw)
        us = (time.perf_counter_ns() - begun_ns) / 1e3
        (pressed_us if measurement.in_contact else free_us).append(us)
    for name, values in (("free", free_us), ("in contact", pressed_us)):
        print(
            f"time per sample in the live chain, {name}: "
            f"median {statistics.median(values):.1f} µs (target 10), "
            f"mean {statistics.mean(values):.1f} µs, p99 {sorted(values)[int(0.99 * len(values))]:.0f} µs"
        )
