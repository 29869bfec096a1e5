"""Tests of each fault of the catalogue with board and instrument in virtual time."""

import math

import pytest

from pneuforce.protocol.frames import Fault, Valve
from pneuforce.sim.faults import (
    CATALOGUE,
    FaultInjector,
    FaultSchedule,
    ScheduledFault,
    SimulatorRequestError,
)
from pneuforce.sim.faults.kind import FromArgument
from pneuforce.sim.hand import Hand
from pneuforce.sim.plants.published import PublishedPlant
from pneuforce.sim.rig import Rig
from pneuforce.sim.world import World
from tests.sim.station import Station

PLANT = PublishedPlant()
BOARD = [kind for kind in CATALOGUE.values() if kind.board_fault is not None]
MAINTENANCE = [kind for kind in CATALOGUE.values() if kind.effect == "maintenance_required"]
HARMLESS = [kind for kind in CATALOGUE.values() if kind.board_fault is None and kind.effect == ""]
DRIFTING = [kind for kind in CATALOGUE.values() if kind.effect == "drift"]
LOSSES = [kind for kind in CATALOGUE.values() if kind.effect == "losses"]
NO_TRIP = ("", "drift", "losses", "maintenance_required")  #: effects that do not trip the rig
STATUS = [k for k in CATALOGUE.values() if k.board_fault is None and k.effect not in NO_TRIP]
#: Time limits of faults that the board detects slowly [s]. All other faults must trip within 3 s.
TIME_LIMITS_S = {"leak": 60.0, "inlet_open": 6.0, "vent_shut": 5.0, "regulator_high": 5.0}


def each(kinds):
    return pytest.mark.parametrize("kind", kinds, ids=[kind.name for kind in kinds])


def station_with(kind):
    """Return a station with the fault, in the phase in which the fault has an effect."""
    start_phases = {"vented": "vented", "inflating": "inflating", "holding": "holding", "venting": "holding"}
    station = getattr(Station(PLANT), start_phases[kind.phase])()
    station.world.faults.inject(kind.name)
    if kind.phase == "vented":
        station.write(mode="hold", setpoint_requested_kpa=8.0)
    if kind.phase == "venting":
        station.write(mode="vent")
    return station


@each(BOARD)
def test_the_board_latches_the_fault_of_the_catalogue_and_is_safe(kind):
    station = station_with(kind)
    assert station.run(TIME_LIMITS_S.get(kind.name, 3.0), lambda: station.latched_faults), station.snapshot()
    assert station.latched_faults == {kind.board_fault}
    assert station.world.rig.board.valves == Valve.NONE
    station.run(0.2)
    assert station.snapshot().state == "tripped"
    assert kind.board_fault in station.snapshot().faults


@pytest.mark.parametrize(("kpa_per_s", "fault"), [(0.5, Fault.SETPOINT_TIMEOUT), (5.0, Fault.NO_RISE)])
def test_a_leak_that_a_top_up_cannot_replace_trips_another_fault(kpa_per_s, fault):
    station = Station(PLANT).holding()
    station.world.faults.inject("leak", {"kpa_per_s": kpa_per_s})
    assert station.run(10.0, lambda: station.latched_faults)
    assert station.latched_faults == {fault}


@each(STATUS)
def test_a_fault_that_the_board_cannot_detect_sets_the_status_bit_of_the_catalogue(kind):
    station = station_with(kind)
    assert station.run(2.0, lambda: kind.effect in station.snapshot().status), station.snapshot()
    station.run(0.01)  # the trip follows in the next tick
    assert station.snapshot().state == "tripped"
    assert math.isnan(station.snapshot().force_n)


@each(HARMLESS)
def test_a_harmless_fault_trips_nothing(kind):
    station = station_with(kind)
    station.run(5.0)
    assert station.snapshot().faults == ()
    assert station.snapshot().state == "holding"


@each(MAINTENANCE)
def test_a_fault_that_needs_maintenance_sets_its_bit_and_the_rig_continues_to_measure(kind):
    station = Station(PLANT).holding()
    station.run(10.0)
    assert "maintenance_required" not in station.snapshot().status
    station.world.faults.inject(kind.name)
    assert station.run(12.0, lambda: kind.effect in station.snapshot().status)
    assert (station.snapshot().state, station.snapshot().faults, station.snapshot().force_n) == (
        "holding",
        (),
        0.0,
    )
    station.world.faults.remove(kind.name)
    assert station.run(12.0, lambda: kind.effect not in station.snapshot().status)


@pytest.mark.parametrize("rate", [0.995, 1.005])
def test_a_resonator_within_its_tolerance_sets_no_bit_and_ages_are_true(rate):
    station = Station(PLANT).holding()
    station.world.faults.inject("clock_off", {"rate": rate})
    station.run(10.0)
    assert station.snapshot().status & {"maintenance_required", "stale", "failure"} == set()
    assert station.link.clock.rate_error == pytest.approx(rate - 1, abs=1e-4)
    assert station.snapshot().age_s <= 0.01


@pytest.fixture(scope="module")
def healthy_kpa():
    """Return the balloon pressure of a rig that has held for 20 s without a fault."""
    station = Station(PLANT).holding()
    station.run(20.0)
    return station.world.rig.truth.balloon_kpa


@each(DRIFTING)
def test_a_slow_change_is_drift_and_no_contact(kind, healthy_kpa):
    station = station_with(kind)
    station.run(20.0)
    assert abs(station.world.rig.truth.balloon_kpa - healthy_kpa) > 0.005
    assert station.snapshot().contact_counter == 0
    assert station.snapshot().state == "holding"
    assert station.snapshot().faults == ()


@each(LOSSES)
def test_a_disturbed_line_loses_frames_which_are_counted_and_the_rig_continues_to_hold(kind):
    station = station_with(kind)
    assert station.run(5.0, lambda: station.link.decoder.skipped_bytes > 20)
    station.world.faults.remove(kind.name)
    station.run(0.1)
    lost, used = station.link.lost_frames, station.used_samples
    station.run(1.0)
    assert (station.link.lost_frames, station.used_samples) == (lost, used + 500)
    assert station.link.implausible_frames == 0
    assert station.snapshot().faults == ()
    assert station.snapshot().state == "holding"


def test_every_fault_belongs_to_one_group():
    groups = (BOARD, MAINTENANCE, HARMLESS, DRIFTING, LOSSES, STATUS)
    assert sum(map(len, groups)) == len(CATALOGUE)


def test_a_sensor_that_freezes_while_the_balloon_is_held_is_detected_at_the_vent():
    station = Station(PLANT).holding()
    station.world.faults.inject("sensor_frozen")
    station.run(2.0)
    assert station.snapshot().state == "holding"
    station.write(mode="vent")
    assert station.run(1.0, lambda: station.latched_faults)
    assert station.latched_faults == {CATALOGUE["sensor_frozen"].board_fault}


def test_the_board_does_not_inflate_for_a_host_that_rejected_its_version():
    station = Station(PLANT)
    station.world.faults.inject("other_version")
    station.run(2.0)
    assert "version 2" in str(station.rejection)
    assert station.used_samples == 0


# injection and removal of faults


def state_of(world):
    """Return the value of every attribute that a fault may change."""
    paths = {path for kind in CATALOGUE.values() for path in kind.attributes}
    return {path: eval(f"world.{path}", {"world": world}) for path in paths}


@pytest.fixture
def world():
    return World(Rig(PLANT, Hand(False)))


@each([kind for kind in CATALOGUE.values() if kind.is_persistent])
def test_a_fault_that_is_removed_leaves_a_healthy_rig(world, kind):
    healthy = state_of(world)
    world.faults.inject(kind.name)
    assert list(world.faults.active) == [kind.name]
    assert (state_of(world) != healthy) == bool(kind.attributes)
    world.faults.remove(kind.name)
    assert state_of(world) == healthy
    assert world.faults.active == {}


@each(list(CATALOGUE.values()))
def test_an_argument_out_of_range_changes_nothing(world, kind):
    healthy = state_of(world)
    for argument in kind.arguments:
        for value in (math.nan, math.inf, argument.minimum - 1, argument.maximum + 1, "1", None, True):
            with pytest.raises(SimulatorRequestError, match=f"{argument.name} of {kind.name}"):
                world.faults.inject(kind.name, {argument.name: value})
    with pytest.raises(SimulatorRequestError, match=f"{kind.name} takes .*, not 'colour'"):
        world.faults.inject(kind.name, {"colour": 1.0})
    assert state_of(world) == healthy
    assert world.faults.active == {}


@each([kind for kind in CATALOGUE.values() if kind.arguments and kind.attributes])
def test_an_argument_reaches_the_rig(world, kind):
    [argument] = kind.arguments
    value = 0.7 * argument.maximum + 0.3 * argument.minimum
    world.faults.inject(kind.name, {argument.name: value})
    [path] = [path for path, value in kind.attributes.items() if isinstance(value, FromArgument)]
    applied = round(value) if argument.integer else value
    assert state_of(world)[path] == applied
    assert world.faults.active[kind.name] == {argument.name: applied}


def test_of_two_faults_of_one_part_the_later_fault_is_active(world):
    world.faults.inject("inlet_open")
    world.faults.inject("inlet_shut")
    assert list(world.faults.active) == ["inlet_shut"]
    assert world.rig.pneumatics.inlet.stuck is False
    world.faults.remove("inlet_open")
    assert world.rig.pneumatics.inlet.stuck is False


def test_faults_of_different_parts_are_active_together(world):
    world.faults.inject("leak", {"kpa_per_s": 0.5})
    world.faults.inject("sensor_short")
    assert world.faults.active == {"leak": {"kpa_per_s": 0.5}, "sensor_short": {}}


def test_an_unknown_fault_is_rejected_with_the_command_that_lists_all_faults(world):
    for act in (world.faults.inject, world.faults.remove):
        with pytest.raises(SimulatorRequestError, match=r"'gremlin'.*pneuforce sim fault --list"):
            act("gremlin")


def test_removal_of_an_inactive_fault_changes_nothing(world):
    world.faults.inject("sensor_short")
    world.faults.remove("sensor_open")
    assert world.rig.sensor.stuck_at == 0


# faults on a schedule


def test_faults_start_and_end_at_their_times():
    faults = [
        ScheduledFault(0.10, 0.06, "leak", {"kpa_per_s": 0.5}),
        ScheduledFault(0.12, math.inf, "supply_low", {}),
        ScheduledFault(0.15, 0.02, "leak", {"kpa_per_s": 0.7}),
        ScheduledFault(0.15, math.inf, "board_reset", {}),
    ]
    world = World(Rig(PLANT, Hand(False)), FaultSchedule(faults))
    seen = {}
    for _ in range(100):
        world.step()
        seen[round(world.now_s, 3)] = dict(world.faults.active)
    leaking = {t_s: faults["leak"]["kpa_per_s"] for t_s, faults in seen.items() if "leak" in faults}
    assert set(leaking.values()) == {0.5, 0.7}
    assert min(leaking) == pytest.approx(0.10, abs=0.002)
    assert max(leaking) == pytest.approx(0.168, abs=0.002)
    assert leaking[0.152] == leaking[0.166] == 0.7
    assert "supply_low" in seen[0.2]


def test_a_fault_of_zero_duration_starts_and_ends_in_one_step():
    faults = [
        ScheduledFault(0.1, 0.0, "leak", {}),
        ScheduledFault(0.1, 0.0, "board_reset", {}),
        ScheduledFault(0.14, 1e-18, "burst", {}),
        ScheduledFault(0.14, 0.02, "leak", {}),
        ScheduledFault(0.16, 0.02, "leak", {}),
    ]
    world = World(Rig(PLANT, Hand(False)), FaultSchedule(faults))
    present = {}
    for _ in range(100):
        world.step()
        present[round(world.now_s, 3)] = list(world.faults.active)
    assert present[0.1] == []
    assert present[0.14] == present[0.15] == present[0.162] == present[0.17] == ["leak"]
    assert present[0.182] == []
    assert world.rig.truth.t_s == pytest.approx(world.now_s - 0.1, abs=0.003)


def test_a_schedule_with_an_invalid_fault_is_rejected_when_it_is_created():
    with pytest.raises(SimulatorRequestError, match="'gremlin'"):
        FaultSchedule([ScheduledFault(1.0, 1.0, "gremlin", {})])
    with pytest.raises(SimulatorRequestError, match="kpa_per_s of leak"):
        FaultSchedule([ScheduledFault(1.0, 1.0, "leak", {"kpa_per_s": -1.0})])


def test_each_rig_has_its_own_faults():
    one, other = (World(Rig(PLANT, Hand(False))) for _ in range(2))
    one.faults.inject("leak")
    assert other.faults.active == {}
    assert isinstance(other.faults, FaultInjector)
