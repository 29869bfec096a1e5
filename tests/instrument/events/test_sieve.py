"""What is new gets a record; repetitions and floods are counted, in virtual time."""

import pytest

from instrument.events.record import Moment
from instrument.events.sieve import BURST, LONG_S, MOST_LINES, MOST_PEERS, PER_S, SILENT_S, Deed, Sieve

PLC, ROGUE = ("modbus_tcp", "10.0.0.1"), ("modbus_tcp", "10.0.0.66")
UTC_US = 1_800_000_000_000_000


def moment(now_s):
    return Moment(UTC_US + round(now_s * 1e6), now_s)


def a_write(
    value=8.0,
    *,
    name="setpoint_requested_kpa",
    verdict="accepted",
    changed=False,
    grade="accepted",
    who="plc",
):
    facts = {"kind": "write", "who": who, "values": {name: (value, value)}, "verdict": verdict}
    return Deed(facts, (name,), (value, verdict), grade, changed)


def a_bad_request(number):
    request = number.to_bytes(4, "big")
    return Deed({"kind": "request", "request": request.hex(), "verdict": "x"}, request, "x", "refused")


class Log:
    """A sieve, and all that it let pass."""

    def __init__(self):
        self.sieve, self.records = Sieve(), []

    def did(self, deed, now_s, peer=PLC):
        passed = self.sieve.sift(peer, deed, moment(now_s))
        self.records += passed
        return [record.facts["kind"] for record in passed]

    def due(self, now_s):
        passed = self.sieve.due(moment(now_s))
        self.records += passed
        return [record.facts for record in passed]

    def end(self, now_s):
        return [record.facts for record in self.sieve.rest(moment(now_s))]


def test_the_first_write_has_a_record_and_its_repetition_none():
    log = Log()
    assert log.did(a_write(), 0.0) == ["write"]
    assert log.did(a_write(), 0.02) == []


def test_repetitions_are_told_when_they_have_ended():
    log = Log()
    for step in range(51):
        log.did(a_write(), step * 0.02)
    assert log.due(1.0 + SILENT_S) == []
    (told,) = log.due(1.1 + SILENT_S)
    assert (told["kind"], told["times"], told["who"]) == ("repeated", 50, "plc")
    assert (told["since"], told["until"]) == ("2027-01-15T08:00:00.020000Z", "2027-01-15T08:00:01.000000Z")
    assert told["of"]["values"] == {"setpoint_requested_kpa": (8.0, 8.0)}
    assert log.due(200.0) == []


def test_the_same_write_is_new_again_after_a_silence():
    log = Log()
    log.did(a_write(), 0.0)
    log.due(SILENT_S + 1)
    assert log.did(a_write(), SILENT_S + 1) == ["write"]


def test_another_value_first_tells_how_often_the_one_before_came():
    log = Log()
    for step in range(4):
        log.did(a_write(8.0), step * 0.02)
    assert log.did(a_write(9.0, changed=True), 0.08) == ["repeated", "write"]


def test_another_verdict_on_the_same_write_is_a_record():
    log = Log()
    log.did(a_write(), 0.0)
    assert log.did(a_write(verdict="lease", grade="refused"), 0.02) == ["write"]


def test_what_changes_something_is_no_repetition_though_the_words_are_the_same():
    log = Log()
    log.did(a_write(8.0, changed=True), 0.0)
    log.did(a_write(9.0, changed=True), 0.01, ROGUE)
    assert log.did(a_write(8.0, changed=True), 0.02) == ["write"]


def test_a_plc_that_writes_three_requests_a_cycle_for_hours_makes_few_records():
    log = Log()
    names = ("setpoint_requested_kpa", "mode", "lease_s")
    hours, cycles = 6, 6 * 3600 * 2  # a cycle of 0.5 s; its length does not matter to what is kept
    for cycle in range(cycles):
        for name in names:
            log.did(a_write(name=name), cycle * 0.5)
        if cycle % 2:
            log.due(cycle * 0.5)
    ended = log.end(hours * 3600)
    assert len(log.records) + len(ended) == 3 + 3 * hours
    counted = sum(facts["times"] for facts in ended) + sum(r.facts.get("times", 0) for r in log.records)
    assert counted == 3 * (cycles - 1)


def test_what_goes_on_is_told_each_hour():
    log = Log()
    log.did(a_write(), 0.0)
    log.did(a_write(), 1.0)
    for now_s in range(2, int(LONG_S), 30):
        log.did(a_write(), now_s)
    (told,) = log.due(LONG_S + 2)
    assert told["times"] == 121


def test_a_hostile_peer_is_held_back_and_what_it_did_is_counted():
    log = Log()
    floods, seconds = 1000, 30
    for number in range(floods * seconds):
        log.did(a_bad_request(number), number / floods, ROGUE)
    kept = len(log.records)
    assert BURST <= kept <= BURST + PER_S["refused"] * seconds + 1
    (told,) = log.due(seconds + SILENT_S + 1)
    assert (told["kind"], told["times"]) == ("held_back", floods * seconds - kept)
    assert told["of"]["request"] == (floods * seconds - 1).to_bytes(4, "big").hex()


def test_a_flood_holds_back_neither_others_nor_accepted_writes_nor_vents_of_the_same_address():
    log = Log()
    for number in range(5000):
        log.did(a_bad_request(number), 0.0, ROGUE)
    assert log.did(a_write(changed=True), 0.0, PLC) == ["write"]
    assert log.did(a_write(changed=True), 0.0, ROGUE) == ["write"]
    assert log.did(a_write("vent", name="mode", grade="vent"), 0.0, ROGUE) == ["write"]


def test_pairs_of_bad_requests_do_not_get_round_the_budget():
    log = Log()
    for number in range(20_000):
        log.did(a_bad_request(number // 2), number / 1000, ROGUE)
    assert len(log.records) <= BURST + PER_S["refused"] * 20 + 1
    told = [r.facts for r in log.records] + log.end(20.0)
    assert sum(facts.get("times", 1) for facts in told) == 20_000


@pytest.mark.parametrize(
    ("addresses", "silence_s", "until_s"), [(1, SILENT_S + 2.0, 6000.0), (2 * MOST_PEERS, 1.0, 600.0)]
)
def test_pauses_between_bursts_do_not_get_round_the_budget(addresses, silence_s, until_s):
    """Nor do they where each burst comes from another address."""
    log, number, now_s = Log(), 0, 0.0
    while now_s < until_s:
        for _ in range(200):
            number += 1
            log.did(a_bad_request(number), now_s, ("modbus_tcp", str(number // 200 % addresses)))
        for _ in range(int(silence_s)):
            now_s += 1.0
            log.due(now_s)
    kept = sum(record.facts["kind"] == "request" for record in log.records)
    assert kept <= min(addresses, MOST_PEERS + 1) * (BURST + PER_S["refused"] * now_s)
    assert len(log.records) <= 1.1 * kept


def crowded():
    """A log to which so many addresses have written that the next ones share a memory."""
    log = Log()
    for number in range(MOST_PEERS):
        log.did(a_write(), 0.0, ("modbus_tcp", str(number)))
    return log


def test_of_those_that_share_a_memory_each_ones_write_is_its_own():
    log = crowded()
    for who in ("first", "second", "first", "second", "second"):
        log.did(a_write(who=who), 1.0, ("modbus_tcp", who))
    assert [record.facts["who"] for record in log.records[MOST_PEERS:]] == ["first", "second"]
    told = {facts["who"]: facts["times"] for facts in log.end(2.0)}
    assert (told["first"], told["second"]) == (1, 2)


def test_what_is_held_back_of_those_that_share_a_memory_is_laid_on_none_of_them():
    log = crowded()
    for number in range(1000):
        who = f"10.0.1.{number % 250}"
        deed = a_bad_request(number)
        log.did(deed._replace(facts={**deed.facts, "who": who}), 1.0, ("modbus_tcp", who))
    (told,) = (facts for facts in log.end(2.0) if facts["kind"] == "held_back")
    assert (told["who"], told["times"], told["of"]["last_who"]) == ("others", 1000 - BURST, "10.0.1.249")


def test_memory_stays_bounded_under_ever_new_addresses_and_requests():
    log = Log()
    for number in range(30_000):
        log.did(a_bad_request(number), number / 1000, ("modbus_tcp", f"fd00::{number % 5000:x}"))
    memories = log.sieve._memories
    assert len(memories) <= MOST_PEERS + 1
    assert all(len(memory.lines) <= MOST_LINES for memory in memories.values())


def test_peers_that_fell_silent_are_forgotten():
    log = Log()
    for number in range(10):
        log.did(a_write(), 0.0, ("modbus_tcp", str(number)))
    log.due(SILENT_S + 1)
    assert log.sieve._memories == {}
