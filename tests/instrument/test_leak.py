"""A slow leak, seen on the whole simulated rig and on made-up slopes."""

import pytest

from instrument.leak import LEAK_KPA_PER_S, LeakWatch
from instrument.rig.frames import SAMPLES_PER_S
from sim.published import PublishedPlant
from tests.sim.station import Station

DT_S = 1 / SAMPLES_PER_S


def seen_after_s(watch, kpa_per_s, lasts_s, setpoint_pa=8000, pressed=lambda t_s: False):
    """When a fall is seen, None where it is not."""
    for n in range(round(lasts_s * SAMPLES_PER_S)):
        t_s = n * DT_S
        watch.step(setpoint_pa, not pressed(t_s), 8.0 - kpa_per_s * t_s, DT_S)
        if watch.seen:
            return t_s
    return None


@pytest.mark.parametrize(("share", "seen"), [(0.9, False), (1.1, True), (-2.0, False), (float("nan"), False)])
def test_a_fall_is_seen_from_its_limit_on(share, seen):
    assert (seen_after_s(LeakWatch(), share * LEAK_KPA_PER_S, 150.0) is not None) == seen


def test_the_first_minute_at_a_setpoint_is_creep_and_the_next_one_tells():
    assert seen_after_s(LeakWatch(), 0.002, 200.0) == pytest.approx(120.0, abs=11.0)


def test_at_another_setpoint_it_begins_anew():
    watch = LeakWatch()
    assert seen_after_s(watch, 0.002, 200.0)
    assert seen_after_s(watch, 0.002, 100.0, setpoint_pa=9000) is None


def test_contacts_in_between_cost_only_the_time_that_they_are_in():
    """Of each 20 s 15 are free, and hold one piece: 80 s for the first free minute, then six pieces."""
    often = seen_after_s(LeakWatch(), 0.002, 400.0, pressed=lambda t_s: t_s % 20 > 15)
    assert often == pytest.approx(80.0 + 6 * 20.0, abs=20.0)
    assert seen_after_s(LeakWatch(), 0.002, 200.0, pressed=lambda t_s: t_s % 8 > 6) is None


@pytest.mark.parametrize(("kpa_per_s", "wants"), [(0.0, False), (0.0015, True)])
def test_a_slow_leak_of_the_rig_wants_maintenance_before_it_is_a_failure(kpa_per_s, wants):
    station = Station(PublishedPlant()).holding()
    if kpa_per_s:
        station.world.faults.put_in("leak", {"kpa_per_s": kpa_per_s})
    assert station.run(130.0, lambda: station.instrument.chain.leak.seen) == wants
    assert ("maintenance" in station.see().status) == wants
    assert (station.see().state, station.see().faults) == ("holding", ())
