"""The quick part of the exhaustive search. `make prove` runs all searches and plants all errors."""

from dataclasses import fields

import pytest

from pneuforce.instrument.core.controller import Instrument
from tests.rules.explorer import NO_DEAD_END, explore
from tests.rules.mutants import PLANTED_ERRORS, finding_of
from tests.rules.rules import RULES
from tests.rules.searches import SEARCHES
from tests.rules.state_key import INSTRUMENT, NOT_IN_KEY, SAVED_APART, key_of, world_of
from tests.rules.world import EVENTS, PEERS, WRITES, World

PATHS = {value.path for value in INSTRUMENT}
QUICK = [search for search in SEARCHES if search.quick]
#: One error for each rule.
QUICK_ERRORS = list({planted.rule: planted for planted in PLANTED_ERRORS if not planted.slow}.values())


def name_of(item):
    return getattr(item, "name", None) or f"{item.rule}-{item.file}"


@pytest.mark.parametrize("search", QUICK, ids=name_of)
def test_all_rules_hold_in_all_states(search):
    result = explore(search)
    assert result.finding is None
    assert result.states > 1000


@pytest.mark.parametrize("planted", QUICK_ERRORS, ids=name_of)
def test_the_search_finds_a_planted_error(planted):
    assert planted.rule in finding_of(planted)


def test_each_rule_has_a_planted_error():
    assert {planted.rule for planted in PLANTED_ERRORS} == {rule.__name__ for rule in RULES} | {NO_DEAD_END}


def test_each_event_is_a_part_of_a_search():
    assert {event for search in SEARCHES for event in search.others} == set(EVENTS)
    assert {write for search in SEARCHES for write in search.writes} == set(WRITES)
    assert {peer for search in SEARCHES for peer in search.peers} == set(PEERS)


def test_a_world_is_restored_from_its_key():
    world = World()
    for event, peer in (("wait", ""), ("vent", "PLC"), ("hold", "PLC"), ("lease", "PLC"), ("wait", "")):
        world.apply(event, peer)
        assert key_of(world_of(key_of(world))) == key_of(world)
        assert world_of(key_of(world)).seen()._replace(now_s=0) == world.seen()._replace(now_s=0)


def test_each_field_of_the_instrument_is_in_the_key_or_has_a_reason():
    names = {path.split(".")[0] for path in PATHS}
    assert {field.name for field in fields(Instrument)} == names | SAVED_APART | NOT_IN_KEY.keys()


@pytest.mark.parametrize("name", ["lease", "command_monitor", "stalls"])
def test_each_field_of_a_part_is_in_the_key(name):
    part = getattr(World().instrument, name)
    assert {f"{name}.{field.name}" for field in fields(part)} <= PATHS
