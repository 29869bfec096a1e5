"""Benchmark of the peak force: its error over many presses, and the time per sample."""

import statistics
import time

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.peak import PeakTracker
from tests.instrument.measurement.simulated_peaks import half_sine, plateau, simulated_presses
from tests.instrument.measurement.test_peak import REST, TUBE_S, samples_of

SEEDS, FORCES_N, SETPOINTS_KPA = range(1, 11), (0.8, 1.5), (5.3, 8.0, 9.5, 11.3)
SHAPES = {
    "plateau of 0.2 s": lambda force_n: plateau(force_n, 0.2),
    "plateau of 0.5 s": lambda force_n: plateau(force_n, 0.5),
    "plateau of 3 s": lambda force_n: plateau(force_n, 3.0),
    "half sine of 0.2 s": lambda force_n: half_sine(force_n, 0.2),
    "rise and fall at 10 N/s": lambda force_n: plateau(force_n, 0.0),
}
FAST = (SHAPES["half sine of 0.2 s"], SHAPES["rise and fall at 10 N/s"])


def bench_peaks(brief=False):
    """Print the error of the peak force, and that of the greatest sample, for each shape of a press."""
    seeds, setpoints_kpa = (SEEDS[:1], SETPOINTS_KPA[:1]) if brief else (SEEDS, SETPOINTS_KPA)
    plants = ("published",) if brief else ("published", "membrane")
    shapes = ["plateau of 0.2 s"] if brief else SHAPES
    found = {(shape, force_n): [] for force_n in FORCES_N for shape in shapes}
    wrong_count = 0
    contacts = [SHAPES[shape](force_n) for shape, force_n in found]
    for plant in plants:
        for setpoint_kpa in setpoints_kpa:
            cells = {key: [] for key in found}
            for seed in seeds:
                presses = simulated_presses(contacts, setpoint_kpa, plant, seed)
                wrong_count += sum(len(press.peaks) != 1 for press in presses)
                for cell, press in zip(cells.values(), presses, strict=True):
                    cell.append((100 * press.error, 100 * (press.greatest_n / press.true_n - 1)))
            for key, cell in cells.items():
                found[key].append(cell)
    for (shape, force_n), cells in found.items():
        errors, greatest = zip(*(pair for cell in cells for pair in cell), strict=True)
        worst = max((statistics.fmean(error for error, _ in cell) for cell in cells), key=abs)
        print(
            f"{force_n} N, {shape}: {len(errors)} presses, mean error {statistics.fmean(errors):+.2f} % "
            f"(target {2 if force_n < 1 else 1}), worst mean at one setpoint {worst:+.2f} %, standard "
            f"deviation {statistics.pstdev(errors):.2f} %; largest sample {statistics.fmean(greatest):+.2f} %"
        )
    print(f"presses with another number of peaks than 1: {wrong_count} (target 0)")
    _print_limits(plants, seeds[:3], setpoints_kpa, FORCES_N[-1:] if brief else FORCES_N)
    _print_time(3 if brief else 30)


def _print_limits(plants, seeds, setpoints_kpa, forces_n):
    """Print the greatest mean error at one setpoint for very short presses, and for a wrong lag."""
    short = [half_sine(force_n, duration_s) for duration_s in (0.1, 0.05) for force_n in forces_n]
    _print_worst("half sine of 0.1 s and of 0.05 s", short, plants, seeds, setpoints_kpa, TUBE_S)
    usual = [shape(force_n) for force_n in forces_n for shape in (SHAPES["plateau of 0.5 s"], *FAST)]
    for tube_s in (0.7 * TUBE_S, 1.3 * TUBE_S):
        name = f"lag of {tube_s:.3f} s instead of {TUBE_S} s; plateau of 0.5 s, half sine of 0.2 s, 10 N/s"
        _print_worst(name, usual, plants, seeds, setpoints_kpa, tube_s)


def _print_worst(name, contacts, plants, seeds, setpoints_kpa, tube_s):
    settings, worst = ChainSettings(tube_time_constant_s=tube_s), [0.0] * len(contacts)
    for plant in plants:
        for setpoint_kpa in setpoints_kpa:
            rows = [
                simulated_presses(contacts, setpoint_kpa, plant, seed, settings=settings) for seed in seeds
            ]
            means = [
                statistics.fmean(100 * press.error for press in column) for column in zip(*rows, strict=True)
            ]
            worst = [max(pair, key=abs) for pair in zip(worst, means, strict=True)]
    errors = "; ".join(f"{error:+.1f} %" for error in worst)
    print(f"{name}, worst mean error at one setpoint for each press (at 0.8 N and 1.5 N): {errors}")


def _print_time(repeats):
    for name, samples in (
        ("free", samples_of(REST * 4)),
        ("in contact", samples_of([1.0 + 1e-4 * (n % 7) for n in range(2000)])),
    ):
        times_s = []
        for _ in range(repeats):
            tracker, begun_s = PeakTracker(TUBE_S), time.process_time()
            for m in samples:
                tracker.step(m)
            times_s.append(time.process_time() - begun_s)
        us = [1e6 * seconds / len(samples) for seconds in times_s]
        median_us, least_us = statistics.median(us), min(us)
        print(f"time per sample, {name}: median {median_us:.2f} µs (target 3), least {least_us:.2f} µs")
