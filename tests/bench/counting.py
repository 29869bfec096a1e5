"""Benchmark of the counts for monitoring: their share of the time of the host for one second of samples."""

import json
import statistics
import time

from pneuforce.instrument.core.event_counts import EventCounts
from pneuforce.instrument.service.host.command_gaps import CommandGaps
from pneuforce.protocol.frames import SAMPLES_PER_S
from pneuforce.registers.codes import FAULTS, REJECT_REASONS
from tests.instrument.instrument_harness import InstrumentHarness

COMMANDS_PER_S = 20
MAX_SHARE = 0.01


def bench_counting(brief=False):
    """Print the time of the counts for one second, as a share of the time for the samples of one second."""
    repetitions = 3 if brief else 50
    counts, gaps = EventCounts(), CommandGaps()
    for code in FAULTS.names:
        counts.count_faults((), (code,))
    for reason in REJECT_REASONS.codes:
        counts.count_rejected_write(reason)
    second_s = statistics.median(_process_s() for _ in range(repetitions))
    counting_s = statistics.median(_count_s(counts, gaps) for _ in range(repetitions))
    print(
        f"counts for monitoring: {counting_s / SAMPLES_PER_S * 1e6:.2f} µs per sample, "
        f"{counting_s / second_s:.2%} of the time of the instrument (target at most {MAX_SHARE:.0%})"
    )


def _process_s():
    """Return the time in which the instrument processes the samples of one second."""
    harness = InstrumentHarness.holding()
    process, spent_s = harness.instrument.process, 0.0

    def measured(raw):
        nonlocal spent_s
        begun_s = time.perf_counter()
        measurement = process(raw)
        spent_s += time.perf_counter() - begun_s
        return measurement

    harness.instrument.process = measured
    harness.run(1.0)
    return spent_s


def _count_s(counts, gaps):
    """Return the time of the counts for one second: each command, and the values for the web process."""
    begun_s = time.perf_counter()
    for number in range(COMMANDS_PER_S):
        gaps.sent(time.monotonic() + number)
    json.dumps([counts.values(), gaps.values()])
    return time.perf_counter() - begun_s
