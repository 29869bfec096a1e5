"""Tests of the contacts that are found in a stream of measured samples."""

import math
import random
from itertools import islice

import pytest

from pneuforce.instrument.recording.contacts import (
    DEFAULT_TUBE_TIME_CONSTANT_S,
    ContactHistory,
    tube_time_constant_of,
)
from pneuforce.instrument.stream.sample_record import pack, unpack
from pneuforce.instrument.validation.accuracy import estimate_forces
from pneuforce.protocol.frames import BoardState
from tests.instrument.instrument_harness import DT_S, InstrumentHarness

OPEN_CIRCUIT = 0


class Stream:
    """Instrument that holds 8 kPa, and the history of its contacts."""

    def __init__(self, **options):
        self.harness, self.contacts = InstrumentHarness.holding(), ContactHistory(**options)
        self.samples, self.changes, self.peaks = [], 0, []

    def run(self, seconds, **changes):
        instrument = self.harness.instrument
        for _ in range(round(seconds / DT_S)):
            m = self.harness.feed(**changes)
            self.samples.append(unpack(pack(instrument.raw, m)))
            self.changes += self.contacts.add_sample(self.samples[-1])
            if instrument.peaks.count != len(self.peaks):
                self.peaks.append(instrument.peak_force_n)
        return self

    def press(self, push_kpa, seconds=0.6):
        self.harness.push_kpa = push_kpa
        return self.run(seconds)

    @property
    def rows(self):
        return self.contacts.rows

    @property
    def tracker(self):
        return self.harness.instrument.chain.tracker


def test_a_free_balloon_has_no_contact():
    stream = Stream().run(1.0)
    assert (stream.rows, stream.changes) == ([], 0)


def test_a_press_is_one_contact_with_its_pressures_and_its_greatest_force():
    stream = Stream().run(0.5)
    stream.press(1.5).press(0.0, 1.0)
    [row] = stream.rows
    assert (row.number, row.open, row.peaks) == (1, False, 1)
    assert stream.changes == 3  # the start, the peak and the end
    assert row.baseline_kpa == pytest.approx(8.0, abs=0.02)
    assert row.final_kpa == pytest.approx(9.5, abs=0.05)
    assert row.radius_mm == pytest.approx(
        stream.harness.instrument.chain.settings.balloon.radius_mm(8.0), abs=0.01
    )
    at_plateau = stream.samples[round(0.9 / DT_S)]
    assert [row.peak_n] == pytest.approx(stream.peaks)
    assert row.peak_n == pytest.approx(at_plateau.force_n, rel=0.01)
    assert row.peak_std_n == pytest.approx(at_plateau.force_std_n, rel=0.3)
    assert 0.6 < row.duration_s < 1.0  # the contact ends late, because the pressure lags


def test_the_initial_and_final_times_are_those_of_the_two_pressures():
    stream = Stream().run(0.5)
    stream.press(1.5, 2.0).press(0.0, 1.0)
    [row] = stream.rows
    at = {m.t_s: m for m in stream.samples}
    assert at[row.initial_s].pressure_kpa == pytest.approx(row.baseline_kpa, abs=0.02)
    assert row.begin_s - 0.2 < row.initial_s <= row.begin_s < row.final_s
    assert at[row.final_s].baseline_kpa + at[row.final_s].rise_kpa == pytest.approx(row.final_kpa, abs=0.25)


def test_the_force_of_a_contact_is_that_of_its_pressures():
    """The highest sample has noise and overshoots, so that its force would be up to a third larger."""
    stream = Stream().run(0.5)
    for push_kpa, seconds in ((0.3, 0.6), (1.0, 0.2), (2.0, 0.6)):
        stream.press(push_kpa, seconds).press(0.0, 1.0)
    stream.press(2.0).press(0.25, 0.4).press(1.5, 0.5)
    pairs = [(row.baseline_kpa, row.final_kpa) for row in stream.rows]
    force_n, _ = estimate_forces(pairs, stream.harness.instrument.chain.settings)
    assert [row.peak_n for row in stream.rows] == pytest.approx(force_n, rel=1e-3)
    assert [row.open for row in stream.rows] == [False, False, False, False, True]


def test_a_contact_without_a_peak_has_the_values_of_its_greatest_sample():
    stream, contacts = Stream(), ContactHistory()
    stream.press(1.5, 0.3)
    for m in stream.samples:
        contacts.add_sample(m._replace(unfiltered_kpa=math.nan))  # samples without a reading give no peak
    [row] = contacts.rows
    assert row.peaks == 0
    highest = next(m for m in stream.samples if m.t_s == row.final_s)
    assert (row.peak_n, row.peak_std_n) == (highest.force_n, highest.force_std_n)
    assert row.final_kpa == pytest.approx(highest.baseline_kpa + highest.rise_kpa)


def test_an_open_contact_has_its_present_values():
    stream = Stream()
    stream.press(1.0, 0.3)
    [early] = stream.rows
    stream.press(2.0, 0.5)
    [late] = stream.rows
    assert early.open
    assert late.open
    assert (late.number, late.begin_s) == (early.number, early.begin_s)
    assert late.peak_n > early.peak_n
    assert late.duration_s == pytest.approx(early.duration_s + 0.5)
    assert stream.changes == 1


def test_a_new_contact_before_the_end_of_the_previous_contact_starts_at_the_trough():
    stream = Stream()
    stream.press(2.0).press(0.25, 0.4).press(1.5).press(0.0, 1.0)
    first, second = stream.rows
    assert stream.tracker.contact_count == 2
    assert first.final_s < second.initial_s <= second.begin_s < second.final_s
    assert second.baseline_kpa == pytest.approx(first.baseline_kpa, abs=0.01)
    trough = min(
        (m for m in stream.samples if first.final_s < m.t_s < second.final_s), key=lambda m: m.rise_kpa
    )
    assert second.initial_s == trough.t_s


@pytest.mark.parametrize("seed", range(4))
def test_the_contacts_are_those_of_the_instrument_for_random_presses(seed):
    """The number of contacts and all peaks are equal, even if presses overlap."""
    chance, stream = random.Random(seed), Stream()
    for _ in range(40):
        stream.press(chance.choice([0.0, 0.1, 0.3, 1.0, 2.0, 3.5]), chance.uniform(0.05, 0.5))
    stream.press(0.0, 1.5)
    assert len(stream.rows) == stream.tracker.contact_count == stream.tracker.finished_count > 5
    with_peaks, remaining = [row for row in stream.rows if row.peaks], iter(stream.peaks)
    highest = [max(islice(remaining, row.peaks)) for row in with_peaks]
    assert [row.peak_n for row in with_peaks] == pytest.approx(highest)
    assert not list(remaining)
    assert len(with_peaks) > 5
    assert [row.number for row in stream.rows] == list(range(1, len(stream.rows) + 1))


def test_the_initial_time_of_a_contact_is_never_before_the_previous_contact():
    """The pressure is at rest before the first contact, but not between the two contacts."""
    stream = Stream().run(0.5)
    stream.press(1.5)
    pressed = stream.samples[-1]
    stream.contacts.add_sample(pressed._replace(t_s=pressed.t_s + DT_S, in_contact=False))
    stream.contacts.add_sample(pressed._replace(t_s=pressed.t_s + 2 * DT_S))
    first, second = stream.rows
    assert first.initial_s < first.begin_s < first.final_s < second.initial_s == second.begin_s


def test_a_trip_ends_a_contact():
    stream = Stream()
    stream.press(1.5, 0.3)
    stream.run(0.1, state=BoardState.TRIPPED)
    [row] = stream.rows
    assert not row.open
    assert row.duration_s < 0.35
    assert math.isfinite(row.peak_n)


def test_samples_with_a_sensor_fault_do_not_end_a_contact_while_the_board_holds():
    stream = Stream()
    stream.press(1.5, 0.3).run(0.01, adc_sum=OPEN_CIRCUIT).run(0.3)
    [row] = stream.rows
    assert row.open
    assert row.duration_s == pytest.approx(0.6, abs=0.05)
    assert stream.tracker.contact_count == 1
    stream.run(0.01, adc_sum=OPEN_CIRCUIT, state=BoardState.TRIPPED)
    assert not stream.rows[0].open


@pytest.mark.parametrize("jump_s", [0.3, 3600.0, -5.0])
def test_a_jump_in_time_longer_than_the_host_timeout_ends_a_contact(jump_s):
    """The time jumps back when a replay of a recording starts again."""
    stream = Stream()
    stream.press(1.5, 0.4)
    for m in [m for m in stream.samples if m.in_contact]:
        stream.contacts.add_sample(m._replace(t_s=m.t_s + jump_s + 0.4))
    first, second = stream.rows
    assert (first.open, second.open) == (False, True)
    assert (first.cut, second.cut) == (False, True)
    assert second.begin_s == second.initial_s == pytest.approx(first.begin_s + jump_s + 0.4)
    assert all(0 < row.duration_s < 0.4 for row in stream.rows)


def test_a_short_gap_in_time_does_not_end_a_contact():
    stream, contacts = Stream(), ContactHistory()
    stream.press(1.5, 1.0)
    for m in (*stream.samples[:200], *stream.samples[300:]):
        contacts.add_sample(m)
    assert [row.number for row in contacts.rows] == [1]


def test_a_stream_can_begin_during_a_contact():
    stream, contacts = Stream(), ContactHistory()
    stream.press(1.5).press(0.0, 1.0)
    [complete], later = stream.rows, stream.samples[200:]
    for m in later:
        contacts.add_sample(m)
    [row] = contacts.rows
    assert (row.begin_s, row.initial_s) == (later[0].t_s, later[0].t_s)
    assert row.baseline_kpa == pytest.approx(complete.baseline_kpa, abs=0.01)
    assert row.radius_mm == pytest.approx(complete.radius_mm, abs=0.01)
    assert (row.cut, complete.cut) == (True, False)


@pytest.mark.parametrize("push_kpa", [0.15, 1.5])
@pytest.mark.parametrize(("before_s", "cut"), [(0.7, True), (0.1, True), (0.0, False), (-0.5, False)])
def test_a_proof_test_cuts_a_contact_that_begins_in_it(push_kpa, before_s, cut):
    """`before_s` is the time from the beginning of the press to the end of the test."""
    stream = Stream().run(0.5).run(0.72 - max(before_s, 0.0), state=BoardState.TESTING)
    stream.run(max(-before_s, 0.0))
    stream.harness.push_kpa = push_kpa
    stream.run(max(before_s, 0.0), state=BoardState.TESTING).run(1.0).press(0.0, 1.0).press(push_kpa)
    assert [row.cut for row in stream.rows] == [cut, False]


def test_a_contact_without_a_force_has_no_peak():
    """Outside the validated range of ΔP_i only the pressures are available."""
    stream, contacts = Stream(), ContactHistory()
    stream.press(1.5).press(0.0, 1.0)
    for m in stream.samples:
        contacts.add_sample(m._replace(force_n=math.nan, force_std_n=math.nan))
    [row], [known] = contacts.rows, stream.rows
    assert math.isnan(row.peak_n)
    assert math.isnan(row.peak_std_n)
    assert row.final_kpa == known.final_kpa


def test_the_force_of_a_contact_is_unknown_if_that_of_its_highest_peak_is_unknown():
    """For example, the second peak presses the balloon flat."""
    stream, contacts = Stream(), ContactHistory()
    stream.press(1.0).press(0.6).press(1.5).press(0.0, 1.0)
    for m in stream.samples:
        is_flat = m.rise_kpa > 1.2
        contacts.add_sample(m._replace(force_n=math.nan, force_std_n=math.nan) if is_flat else m)
    [row], [known] = contacts.rows, stream.rows
    assert (row.peaks, known.peaks) == (2, 2)
    assert math.isnan(row.peak_n)
    assert row.final_kpa == pytest.approx(known.final_kpa, abs=0.01)


def test_only_the_latest_contacts_are_kept():
    stream, contacts = Stream(), ContactHistory(capacity=3)
    stream.press(1.5, 0.1)
    pressed, free = stream.samples[-1], stream.samples[-1]._replace(in_contact=False)
    for n in range(10):
        contacts.add_sample(pressed._replace(t_s=0.1 * n))
        contacts.add_sample(free._replace(t_s=0.1 * n + 0.05))
    assert [row.number for row in contacts.rows] == [8, 9, 10]
    contacts.add_sample(pressed._replace(t_s=1.0))
    assert [(row.number, row.open) for row in contacts.rows] == [(9, False), (10, False), (11, True)]


def test_two_overlapping_presses_are_one_contact_with_two_peaks():
    stream = Stream().run(0.5)
    stream.press(1.5).press(0.8).press(2.0).press(0.0, 1.0)
    [row] = stream.rows
    assert (row.peaks, stream.tracker.contact_count) == (2, 1)
    assert len(stream.peaks) == 2
    assert row.peak_n == pytest.approx(max(stream.peaks))


@pytest.mark.parametrize("value", [None, "0.03", math.nan, -0.1, 2.0, []])
def test_an_invalid_time_constant_in_a_header_is_replaced_by_the_default(value):
    assert tube_time_constant_of({"tube_time_constant_s": value}) == DEFAULT_TUBE_TIME_CONSTANT_S
    assert tube_time_constant_of({"tube_time_constant_s": 0.03}) == 0.03
    assert tube_time_constant_of({}) == DEFAULT_TUBE_TIME_CONSTANT_S


@pytest.mark.parametrize("seconds", [0.15, 0.6])
def test_a_contact_that_is_cut_has_no_higher_force_than_its_samples(seconds):
    """The pressure before the first sample is unknown: it can be falling, and lags behind the balloon."""
    stream = Stream().press(2.0, seconds).press(0.0, 0.5)
    begin_s, end_s = stream.rows[0].begin_s, stream.rows[0].begin_s + stream.rows[0].duration_s
    cuts = [n for n, m in enumerate(stream.samples) if begin_s < m.t_s < end_s - 0.05][::7]
    assert len(cuts) > 10
    for cut in cuts:
        contacts = ContactHistory()
        for m in stream.samples[cut:]:
            contacts.add_sample(m)
        row = contacts.rows[0]
        assert row.cut
        assert row.peak_n <= 1.05 * max(m.force_n for m in stream.samples[cut:]) + 0.01
        nearest = min(stream.samples[cut:], key=lambda m: abs(m.rise_kpa + m.baseline_kpa - row.final_kpa))
        assert row.peak_n == pytest.approx(nearest.force_n, rel=0.05, abs=0.05)
