"""Playback of scenarios in virtual time, with the link and the measuring chain of the instrument."""

import itertools
import math
from dataclasses import replace

import pytest

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import LIVE_LAW
from pneuforce.instrument.studies.measured_playback import measure_playback
from pneuforce.sim.headless import Playback
from pneuforce.sim.scenario import load

CHAIN = ChainSettings(law=replace(LIVE_LAW, sides=2))  # with one side, a press of 3.5 N has no force


def one_tap(tmp_path, more="", force_n=1.0):
    path = tmp_path / "mine.toml"
    path.write_text(
        f'doc = "mine"\n{more}\n[[phase]]\nsetpoint_kpa = 8.0\n'
        f'[[phase.contact]]\nkind = "tap"\nforce_n = {force_n}\n'
    )
    return load(str(path))


def ends_of_plateaus(pairs):
    """Yield measurement and truth once for each force, after it has been constant for 0.9 s."""
    for force_n, constant in itertools.groupby(pairs, key=lambda pair: pair[1].force_n):
        plateau = list(constant)
        if force_n > 0 and len(plateau) > 450:
            yield plateau[450]


def test_two_pressures_of_the_campaign_are_measured_within_their_stated_uncertainty():
    campaign = load("campaign")
    [phase] = campaign.phase
    fewer = phase.model_copy(update={"setpoint_kpa": phase.setpoint_kpa[2::16]})
    playback = Playback(campaign.model_copy(update={"phase": [fewer]}))
    plateaus = list(ends_of_plateaus(measure_playback(playback, CHAIN)))
    assert not playback.tripped
    assert playback.now_s == pytest.approx(playback.expected_s, rel=0.05)
    assert [truth.force_n for _, truth in plateaus] == pytest.approx([0.2 + 0.3 * n for n in range(12)] * 2)
    held_kpa = [plateaus[12 * n][1].baseline_kpa for n in range(2)]
    assert held_kpa == pytest.approx([5.45, 9.45], abs=0.1)
    for measurement, truth in plateaus:
        error_n = measurement.force_n - truth.force_n
        assert abs(error_n) <= 2 * measurement.force_std_n, (measurement, truth)
        if measurement.in_contact:
            assert measurement.baseline_kpa == pytest.approx(truth.baseline_kpa, abs=0.02)


def test_the_same_scenario_gives_the_same_bytes_and_another_seed_does_not(tmp_path):
    once, again = (b"".join(Playback(one_tap(tmp_path))) for _ in range(2))
    other = b"".join(Playback(one_tap(tmp_path, "seed = 2")))
    assert once == again
    assert once != other


def test_a_press_that_trips_the_board_ends_the_playback(tmp_path):
    playback = Playback(one_tap(tmp_path, force_n=20.0))
    for _ in playback:
        pass
    assert playback.tripped
    assert playback.truth.balloon_kpa < 0.5
    assert playback.now_s < 2 * playback.expected_s


def test_only_the_axial_part_of_an_oblique_force_presses_the_balloon():
    playback = Playback(load("oblique"))
    shares = {
        round(t.force_n / t.applied_n, 3) for _, t in measure_playback(playback, CHAIN) if t.applied_n > 1.9
    }
    assert shares == {round(math.cos(math.radians(angle)), 3) for angle in (0, 20, 40, 60)}


def test_the_travel_of_the_tissue_scenario_is_shared_by_balloon_and_tissue():
    truths = [truth for _, truth in measure_playback(Playback(load("tissue")), CHAIN)]
    contacts = [list(same) for pressed, same in itertools.groupby(truths, lambda t: t.force_n > 0) if pressed]
    tops = [contact[len(contact) // 2] for contact in contacts]
    walls, springs = tops[:3], tops[3:5]
    assert [truth.indentation_mm for truth in walls] == pytest.approx([1.0, 2.0, 3.0], abs=1e-3)
    for truth, travel_mm in zip(springs, [3.0, 6.0], strict=True):
        assert truth.indentation_mm + truth.force_n / 0.6 == pytest.approx(travel_mm, abs=1e-3)
    assert len(tops) == 9


def test_a_fault_of_the_scenario_is_injected(tmp_path):
    fault = '[[fault]]\nat_s = 1.0\nname = "no_supply"\n'
    playback = Playback(one_tap(tmp_path, fault))
    assert sum(len(sent) for sent in playback) > 0
    assert playback.tripped
    assert not playback.finished


def test_the_playback_ends_if_no_sample_arrives(tmp_path):
    playback = Playback(one_tap(tmp_path, '[[fault]]\nat_s = 0.0\nname = "line_cut"\n'))
    assert sum(len(sent) for sent in playback) < 100
    assert not playback.finished
    assert not playback.tripped
