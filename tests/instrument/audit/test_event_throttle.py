"""Tests of the event throttle: new events are logged, and repetitions and floods are only counted."""

import pytest

from pneuforce.instrument.audit.event_throttle import (
    BURST,
    MAX_PEERS,
    MAX_REMEMBERED_EVENTS,
    RECORDS_PER_S,
    REPETITION_END_S,
    REPORT_INTERVAL_S,
    AuditEvent,
    EventThrottle,
)
from pneuforce.instrument.audit.record import Timestamp

PLC, ROGUE = ("modbus_tcp", "10.0.0.1"), ("modbus_tcp", "10.0.0.66")
UTC_US = 1_800_000_000_000_000


def timestamp(now_s):
    return Timestamp(UTC_US + round(now_s * 1e6), now_s)


def write_event(
    value=8.0,
    *,
    name="setpoint_requested_kpa",
    result="accepted",
    changed=False,
    grade="accepted",
    who="plc",
):
    fields = {"kind": "write", "who": who, "values": {name: (value, value)}, "result": result}
    return AuditEvent(fields, (name,), (value, result), grade, changed)


def rejected_event(number):
    request = number.to_bytes(4, "big")
    return AuditEvent({"kind": "request", "request": request.hex(), "result": "x"}, request, "x", "rejected")


class FilteredLog:
    """Event throttle and the records that have passed the throttle."""

    def __init__(self):
        self.throttle, self.records = EventThrottle(), []

    def add(self, event, now_s, peer=PLC):
        passed = self.throttle.filter(peer, event, timestamp(now_s))
        self.records += passed
        return [record.fields["kind"] for record in passed]

    def due(self, now_s):
        passed = self.throttle.due(timestamp(now_s))
        self.records += passed
        return [record.fields for record in passed]

    def end(self, now_s):
        return [record.fields for record in self.throttle.flush(timestamp(now_s))]


def test_a_write_is_logged_and_its_repetition_is_not():
    log = FilteredLog()
    assert log.add(write_event(), 0.0) == ["write"]
    assert log.add(write_event(), 0.02) == []


def test_repetitions_are_reported_after_their_end():
    log = FilteredLog()
    for step in range(51):
        log.add(write_event(), step * 0.02)
    assert log.due(1.0 + REPETITION_END_S) == []
    (report,) = log.due(1.1 + REPETITION_END_S)
    assert (report["kind"], report["times"], report["who"]) == ("repeated", 50, "plc")
    assert (report["since"], report["until"]) == (
        "2027-01-15T08:00:00.020000Z",
        "2027-01-15T08:00:01.000000Z",
    )
    assert report["of"]["values"] == {"setpoint_requested_kpa": (8.0, 8.0)}
    assert log.due(200.0) == []


def test_the_same_write_is_logged_again_after_a_pause():
    log = FilteredLog()
    log.add(write_event(), 0.0)
    log.due(REPETITION_END_S + 1)
    assert log.add(write_event(), REPETITION_END_S + 1) == ["write"]


def test_a_new_value_ends_the_count_of_the_previous_value():
    log = FilteredLog()
    for step in range(4):
        log.add(write_event(8.0), step * 0.02)
    assert log.add(write_event(9.0, changed=True), 0.08) == ["repeated", "write"]


def test_the_same_write_with_another_result_is_logged():
    log = FilteredLog()
    log.add(write_event(), 0.0)
    assert log.add(write_event(result="lease", grade="rejected"), 0.02) == ["write"]


def test_an_event_that_changed_a_value_is_not_a_repetition():
    log = FilteredLog()
    log.add(write_event(8.0, changed=True), 0.0)
    log.add(write_event(9.0, changed=True), 0.01, ROGUE)
    assert log.add(write_event(8.0, changed=True), 0.02) == ["write"]


def test_a_plc_that_writes_cyclically_for_hours_makes_few_records():
    log = FilteredLog()
    names = ("setpoint_requested_kpa", "mode", "lease_s")
    hours, cycles = 6, 6 * 3600 * 2  # the length of the cycle, 0.5 s, does not affect the number of records
    for cycle in range(cycles):
        for name in names:
            log.add(write_event(name=name), cycle * 0.5)
        if cycle % 2:
            log.due(cycle * 0.5)
    ended = log.end(hours * 3600)
    assert len(log.records) + len(ended) == 3 + 3 * hours
    counted = sum(fields["times"] for fields in ended) + sum(r.fields.get("times", 0) for r in log.records)
    assert counted == 3 * (cycles - 1)


def test_a_continuing_repetition_is_reported_each_hour():
    log = FilteredLog()
    log.add(write_event(), 0.0)
    log.add(write_event(), 1.0)
    for now_s in range(2, int(REPORT_INTERVAL_S), 30):
        log.add(write_event(), now_s)
    (report,) = log.due(REPORT_INTERVAL_S + 2)
    assert report["times"] == 121


def test_a_flood_is_limited_and_counted():
    log = FilteredLog()
    per_s, seconds = 1000, 30
    for number in range(per_s * seconds):
        log.add(rejected_event(number), number / per_s, ROGUE)
    logged = len(log.records)
    assert BURST <= logged <= BURST + RECORDS_PER_S["rejected"] * seconds + 1
    (report,) = log.due(seconds + REPETITION_END_S + 1)
    assert (report["kind"], report["times"]) == ("held_back", per_s * seconds - logged)
    assert report["of"]["request"] == (per_s * seconds - 1).to_bytes(4, "big").hex()


def test_a_flood_of_rejected_requests_does_not_suppress_other_writes():
    log = FilteredLog()
    for number in range(5000):
        log.add(rejected_event(number), 0.0, ROGUE)
    assert log.add(write_event(changed=True), 0.0, PLC) == ["write"]
    assert log.add(write_event(changed=True), 0.0, ROGUE) == ["write"]
    assert log.add(write_event("vent", name="mode", grade="vent"), 0.0, ROGUE) == ["write"]


def test_pairs_of_rejected_requests_do_not_bypass_the_rate_limit():
    log = FilteredLog()
    for number in range(20_000):
        log.add(rejected_event(number // 2), number / 1000, ROGUE)
    assert len(log.records) <= BURST + RECORDS_PER_S["rejected"] * 20 + 1
    records = [r.fields for r in log.records] + log.end(20.0)
    assert sum(fields.get("times", 1) for fields in records) == 20_000


@pytest.mark.parametrize(
    ("addresses", "silence_s", "until_s"), [(1, REPETITION_END_S + 2.0, 6000.0), (2 * MAX_PEERS, 1.0, 600.0)]
)
def test_pauses_between_bursts_do_not_bypass_the_rate_limit(addresses, silence_s, until_s):
    """The rate limit also applies if each burst comes from another address."""
    log, number, now_s = FilteredLog(), 0, 0.0
    while now_s < until_s:
        for _ in range(200):
            number += 1
            log.add(rejected_event(number), now_s, ("modbus_tcp", str(number // 200 % addresses)))
        for _ in range(int(silence_s)):
            now_s += 1.0
            log.due(now_s)
    logged = sum(record.fields["kind"] == "request" for record in log.records)
    assert logged <= min(addresses, MAX_PEERS + 1) * (BURST + RECORDS_PER_S["rejected"] * now_s)
    assert len(log.records) <= 1.1 * logged


def full_log():
    """Return a log whose table of peers is full, so that all further peers share one history."""
    log = FilteredLog()
    for number in range(MAX_PEERS):
        log.add(write_event(), 0.0, ("modbus_tcp", str(number)))
    return log


def test_equal_writes_of_two_peers_that_share_a_history_are_not_repetitions():
    log = full_log()
    for who in ("first", "second", "first", "second", "second"):
        log.add(write_event(who=who), 1.0, ("modbus_tcp", who))
    assert [record.fields["who"] for record in log.records[MAX_PEERS:]] == ["first", "second"]
    counts = {fields["who"]: fields["times"] for fields in log.end(2.0)}
    assert (counts["first"], counts["second"]) == (1, 2)


def test_suppressed_events_of_peers_that_share_a_history_are_reported_as_others():
    log = full_log()
    for number in range(1000):
        who = f"10.0.1.{number % 250}"
        event = rejected_event(number)
        log.add(event._replace(fields={**event.fields, "who": who}), 1.0, ("modbus_tcp", who))
    (report,) = (fields for fields in log.end(2.0) if fields["kind"] == "held_back")
    assert (report["who"], report["times"], report["of"]["last_who"]) == (
        "others",
        1000 - BURST,
        "10.0.1.249",
    )


def test_the_memory_is_limited_for_many_addresses_and_requests():
    log = FilteredLog()
    for number in range(30_000):
        log.add(rejected_event(number), number / 1000, ("modbus_tcp", f"fd00::{number % 5000:x}"))
    histories = log.throttle._histories
    assert len(histories) <= MAX_PEERS + 1
    assert all(len(history.repeated) <= MAX_REMEMBERED_EVENTS for history in histories.values())


def test_the_history_of_an_inactive_peer_is_deleted():
    log = FilteredLog()
    for number in range(10):
        log.add(write_event(), 0.0, ("modbus_tcp", str(number)))
    log.due(REPETITION_END_S + 1)
    assert log.throttle._histories == {}
