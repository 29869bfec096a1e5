"""Each fault of the catalogue in virtual time: the real board and the real instrument answer."""

import math

import pytest

from instrument.rig.frames import Valve
from sim.faults import CATALOGUE, Faults, Planned, Refused, Schedule
from sim.faults.kind import Given
from sim.hand import Hand
from sim.published import PublishedPlant
from sim.rig import Rig
from sim.world import World
from tests.sim.station import Station

PLANT = PublishedPlant()
BOARD = [kind for kind in CATALOGUE.values() if kind.board is not None]
MAINTENANCE = [kind for kind in CATALOGUE.values() if kind.shows == "maintenance"]
HARMLESS = [kind for kind in CATALOGUE.values() if kind.board is None and kind.shows == ""]
DRIFTING = [kind for kind in CATALOGUE.values() if kind.shows == "drift"]
LOSSES = [kind for kind in CATALOGUE.values() if kind.shows == "losses"]
HELD = ("", "drift", "losses", "maintenance")  #: the rig goes on holding
STATUS = [k for k in CATALOGUE.values() if k.board is None and k.shows not in HELD]
#: How long the instrument may take, where it is not a matter of a second or two.
TAKES_S = {"leak": 60.0, "inlet_open": 6.0, "vent_shut": 5.0, "regulator_high": 5.0}


def each(kinds):
    return pytest.mark.parametrize("kind", kinds, ids=[kind.name for kind in kinds])


def station_with(kind):
    """The fault is in, and what it shows in has begun."""
    begins = {"vented": "vented", "inflating": "inflating", "holding": "holding", "venting": "holding"}
    station = getattr(Station(PLANT), begins[kind.where])()
    station.world.faults.put_in(kind.name)
    if kind.where == "vented":
        station.ask(mode="hold", setpoint_requested_kpa=8.0)
    if kind.where == "venting":
        station.ask(mode="vent")
    return station


@each(BOARD)
def test_the_board_latches_the_fault_that_the_catalogue_says_and_is_safe(kind):
    station = station_with(kind)
    assert station.run(TAKES_S.get(kind.name, 3.0), lambda: station.latched), station.see()
    assert station.latched == {kind.board}
    assert station.world.rig.board.valves == Valve.NONE
    station.run(0.2)
    assert station.see().state == "tripped"
    assert kind.board in station.see().faults


@each(STATUS)
def test_what_the_board_cannot_see_the_instrument_shows_as_the_catalogue_says(kind):
    station = station_with(kind)
    assert station.run(2.0, lambda: kind.shows in station.see().status), station.see()
    assert station.see().state == "tripped"
    assert math.isnan(station.see().force_n)


@each(HARMLESS)
def test_what_nobody_needs_to_see_trips_nothing(kind):
    station = station_with(kind)
    station.run(5.0)
    assert station.see().faults == ()
    assert station.see().state == "holding"


@each(MAINTENANCE)
def test_what_wants_maintenance_says_so_and_the_rig_goes_on_measuring(kind):
    station = Station(PLANT).holding()
    station.run(10.0)
    assert "maintenance" not in station.see().status
    station.world.faults.put_in(kind.name)
    assert station.run(12.0, lambda: kind.shows in station.see().status)
    assert (station.see().state, station.see().faults, station.see().force_n) == ("holding", (), 0.0)
    station.world.faults.take_out(kind.name)
    assert station.run(12.0, lambda: kind.shows not in station.see().status)


@pytest.mark.parametrize("rate", [0.995, 1.005])
def test_a_resonator_that_is_off_as_far_as_it_may_be_shows_nowhere_and_ages_are_true(rate):
    station = Station(PLANT).holding()
    station.world.faults.put_in("clock_off", {"rate": rate})
    station.run(10.0)
    assert station.see().status & {"maintenance", "stale", "failure"} == set()
    assert station.link.clock.rate_error == pytest.approx(rate - 1, abs=1e-4)
    assert station.see().age_s <= 0.01


@pytest.fixture(scope="module")
def healthy_kpa():
    """The balloon of a rig without a fault at the same time."""
    station = Station(PLANT).holding()
    station.run(20.0)
    return station.world.rig.truth.balloon_kpa


@each(DRIFTING)
def test_what_is_slow_is_drift_and_no_contact(kind, healthy_kpa):
    station = station_with(kind)
    station.run(20.0)
    assert abs(station.world.rig.truth.balloon_kpa - healthy_kpa) > 0.005
    assert station.see().contact_counter == 0
    assert station.see().state == "holding"
    assert station.see().faults == ()


@each(LOSSES)
def test_a_disturbed_line_loses_frames_which_are_counted_and_the_rig_goes_on_holding(kind):
    station = station_with(kind)
    assert station.run(5.0, lambda: station.link.decoder.skipped_bytes > 20)
    station.world.faults.take_out(kind.name)
    station.run(0.1)
    lost, used = station.link.lost_frames, station.used
    station.run(1.0)
    assert (station.link.lost_frames, station.used) == (lost, used + 500)
    assert station.link.implausible_frames == 0
    assert station.see().faults == ()
    assert station.see().state == "holding"


def test_every_fault_says_who_must_see_it():
    groups = (BOARD, MAINTENANCE, HARMLESS, DRIFTING, LOSSES, STATUS)
    assert sum(map(len, groups)) == len(CATALOGUE)


def test_a_sensor_that_freezes_while_the_balloon_is_held_shows_once_it_is_vented():
    station = Station(PLANT).holding()
    station.world.faults.put_in("sensor_frozen")
    station.run(2.0)
    assert station.see().state == "holding"
    station.ask(mode="vent")
    assert station.run(1.0, lambda: station.latched)
    assert station.latched == {CATALOGUE["sensor_frozen"].board}


def test_the_board_refuses_to_inflate_for_a_host_that_refused_its_version():
    station = Station(PLANT)
    station.world.faults.put_in("other_version")
    station.run(2.0)
    assert "version 2" in str(station.refused)
    assert station.used == 0


# putting in and taking out


def state_of(world):
    """Every attribute that a fault may change."""
    paths = {path for kind in CATALOGUE.values() for path in kind.sets}
    return {path: eval(f"world.{path}", {"world": world}) for path in paths}


@pytest.fixture
def world():
    return World(Rig(PLANT, Hand(False)))


@each([kind for kind in CATALOGUE.values() if kind.lasts])
def test_a_fault_that_is_taken_out_leaves_a_healthy_rig(world, kind):
    healthy = state_of(world)
    world.faults.put_in(kind.name)
    assert list(world.faults.present) == [kind.name]
    assert (state_of(world) != healthy) == bool(kind.sets)
    world.faults.take_out(kind.name)
    assert state_of(world) == healthy
    assert world.faults.present == {}


@each(list(CATALOGUE.values()))
def test_an_argument_outside_its_span_changes_nothing(world, kind):
    healthy = state_of(world)
    for argument in kind.arguments:
        for value in (math.nan, math.inf, argument.low - 1, argument.high + 1, "1", None, True):
            with pytest.raises(Refused, match=f"{argument.name} of {kind.name} is a number from"):
                world.faults.put_in(kind.name, {argument.name: value})
    with pytest.raises(Refused, match=f"{kind.name} takes .*, not 'colour'"):
        world.faults.put_in(kind.name, {"colour": 1.0})
    assert state_of(world) == healthy
    assert world.faults.present == {}


@each([kind for kind in CATALOGUE.values() if kind.arguments and kind.sets])
def test_an_argument_reaches_the_rig(world, kind):
    [argument] = kind.arguments
    value = 0.7 * argument.high + 0.3 * argument.low
    world.faults.put_in(kind.name, {argument.name: value})
    [path] = [path for path, given in kind.sets.items() if isinstance(given, Given)]
    taken = round(value) if argument.whole else value
    assert state_of(world)[path] == taken
    assert world.faults.present[kind.name] == {argument.name: taken}


def test_of_two_faults_of_one_part_the_later_one_is_in(world):
    world.faults.put_in("inlet_open")
    world.faults.put_in("inlet_shut")
    assert list(world.faults.present) == ["inlet_shut"]
    assert world.rig.pneumatics.inlet.stuck is False
    world.faults.take_out("inlet_open")
    assert world.rig.pneumatics.inlet.stuck is False


def test_faults_of_different_parts_are_in_side_by_side(world):
    world.faults.put_in("leak", {"kpa_per_s": 0.5})
    world.faults.put_in("sensor_short")
    assert world.faults.present == {"leak": {"kpa_per_s": 0.5}, "sensor_short": {}}


def test_an_unknown_fault_is_refused_by_the_names_of_those_that_there_are(world):
    for act in (world.faults.put_in, world.faults.take_out):
        with pytest.raises(Refused, match="there is no fault 'gremlin'; pneuforce fault --list shows all"):
            act("gremlin")


def test_taking_out_what_is_not_in_changes_nothing(world):
    world.faults.put_in("sensor_short")
    world.faults.take_out("sensor_open")
    assert world.rig.sensor.stuck_at == 0


# on a schedule


def test_faults_come_and_go_at_their_times():
    plan = [
        Planned(0.10, 0.06, "leak", {"kpa_per_s": 0.5}),
        Planned(0.12, math.inf, "supply_low", {}),
        Planned(0.15, 0.02, "leak", {"kpa_per_s": 0.7}),
        Planned(0.15, math.inf, "board_reset", {}),
    ]
    world = World(Rig(PLANT, Hand(False)), Schedule(plan))
    seen = {}
    for _ in range(100):
        world.step()
        seen[round(world.now_s, 3)] = dict(world.faults.present)
    leaking = {t_s: faults["leak"]["kpa_per_s"] for t_s, faults in seen.items() if "leak" in faults}
    assert set(leaking.values()) == {0.5, 0.7}
    assert min(leaking) == pytest.approx(0.10, abs=0.002)
    assert max(leaking) == pytest.approx(0.168, abs=0.002)
    assert leaking[0.152] == leaking[0.166] == 0.7
    assert "supply_low" in seen[0.2]


def test_a_fault_that_lasts_no_time_comes_and_goes_in_one_step():
    plan = [
        Planned(0.1, 0.0, "leak", {}),
        Planned(0.1, 0.0, "board_reset", {}),
        Planned(0.14, 1e-18, "burst", {}),
        Planned(0.14, 0.02, "leak", {}),
        Planned(0.16, 0.02, "leak", {}),
    ]
    world = World(Rig(PLANT, Hand(False)), Schedule(plan))
    present = {}
    for _ in range(100):
        world.step()
        present[round(world.now_s, 3)] = list(world.faults.present)
    assert present[0.1] == []
    assert present[0.14] == present[0.15] == present[0.162] == present[0.17] == ["leak"]
    assert present[0.182] == []
    assert world.rig.truth.t_s == pytest.approx(world.now_s - 0.1, abs=0.003)


def test_a_plan_with_a_fault_that_cannot_be_is_refused_before_it_begins():
    with pytest.raises(Refused, match="there is no fault 'gremlin'"):
        Schedule([Planned(1.0, 1.0, "gremlin", {})])
    with pytest.raises(Refused, match="kpa_per_s of leak"):
        Schedule([Planned(1.0, 1.0, "leak", {"kpa_per_s": -1.0})])


def test_the_faults_of_one_rig_are_not_those_of_another():
    one, other = (World(Rig(PLANT, Hand(False))) for _ in range(2))
    one.faults.put_in("leak")
    assert other.faults.present == {}
    assert isinstance(other.faults, Faults)
