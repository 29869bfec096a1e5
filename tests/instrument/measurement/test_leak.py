"""Tests of the leak monitor, on constant slopes and on the simulated rig."""

import pytest

from pneuforce.instrument.measurement.leak import LEAK_LIMIT_KPA_PER_S, LeakMonitor
from pneuforce.protocol.frames import SAMPLES_PER_S
from pneuforce.sim.plants.published import PublishedPlant
from tests.sim.station import Station

DT_S = 1 / SAMPLES_PER_S


def detected_after_s(monitor, kpa_per_s, duration_s, setpoint_pa=8000, pressed=lambda t_s: False):
    """Lower the baseline at a constant rate. Return the time [s] until a leak is detected, or None."""
    for n in range(round(duration_s * SAMPLES_PER_S)):
        t_s = n * DT_S
        monitor.step(setpoint_pa, not pressed(t_s), 8.0 - kpa_per_s * t_s, DT_S)
        if monitor.detected:
            return t_s
    return None


@pytest.mark.parametrize(
    ("ratio", "detected"), [(0.9, False), (1.1, True), (-2.0, False), (float("nan"), False)]
)
def test_a_fall_above_the_limit_is_a_leak(ratio, detected):
    assert (detected_after_s(LeakMonitor(), ratio * LEAK_LIMIT_KPA_PER_S, 150.0) is not None) == detected


def test_a_leak_is_detected_after_one_minute_of_creep_and_one_minute_of_slope():
    assert detected_after_s(LeakMonitor(), 0.002, 200.0) == pytest.approx(120.0, abs=11.0)


def test_a_new_setpoint_restarts_the_monitor():
    monitor = LeakMonitor()
    assert detected_after_s(monitor, 0.002, 200.0)
    monitor.forget()
    assert detected_after_s(monitor, 0.002, 100.0, setpoint_pa=9000) is None


def test_a_detected_leak_stays_detected_until_a_later_minute_shows_no_leak():
    monitor = LeakMonitor()
    assert detected_after_s(monitor, 0.002, 200.0)
    for setpoint_pa in (0, 8000):
        monitor.step(setpoint_pa, False, 0.0, DT_S)
    assert monitor.detected  # vented, then inflated again
    for _ in range(round(105.0 * SAMPLES_PER_S)):
        monitor.step(8000, True, 8.0, DT_S)
    assert monitor.detected  # the latex creeps, then a minute that is not complete
    for _ in range(round(20.0 * SAMPLES_PER_S)):
        monitor.step(8000, True, 8.0, DT_S)
    assert not monitor.detected


def test_a_new_balloon_ends_a_detected_leak():
    monitor = LeakMonitor()
    assert detected_after_s(monitor, 0.002, 200.0)
    monitor.forget()
    assert not monitor.detected


def test_a_contact_discards_only_its_segment():
    """The balloon is free for 15 s of each 20 s, so that each 20 s contain one complete segment of 10 s.

    The latex creeps during the first 60 s without contact, which take 80 s. The next six segments take 120 s.
    """
    with_contacts_s = detected_after_s(LeakMonitor(), 0.002, 400.0, pressed=lambda t_s: t_s % 20 > 15)
    assert with_contacts_s == pytest.approx(80.0 + 6 * 20.0, abs=20.0)
    assert detected_after_s(LeakMonitor(), 0.002, 200.0, pressed=lambda t_s: t_s % 8 > 6) is None


@pytest.mark.parametrize(("kpa_per_s", "required"), [(0.0, False), (0.0015, True)])
def test_a_slow_leak_of_the_rig_requires_maintenance_before_the_board_trips(kpa_per_s, required):
    station = Station(PublishedPlant()).holding()
    if kpa_per_s:
        station.world.faults.inject("leak", {"kpa_per_s": kpa_per_s})
    assert station.run(160.0, lambda: station.instrument.chain.leak.detected) == required
    assert ("maintenance_required" in station.snapshot().status) == required
    assert (station.snapshot().state, station.snapshot().faults) == ("holding", ())
