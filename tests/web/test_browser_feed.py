"""Tests of the messages that browsers receive for given entries of the instrument."""

import json
import math
import struct

import pytest

from pneuforce.instrument.stream.entry import EntryKind, StreamEntry, StreamError, json_entry
from pneuforce.web.browser_feed import MAX_EVENTS, SNAPSHOT_TIMEOUT_S, BrowserFeed
from pneuforce.web.event_stream import SseMessage
from pneuforce.web.event_texts import event_message
from tests.web.entries import event, header, health, sample, snapshot

STARTED_S = 99.0
UTC_OFFSET_S = 1.7e9


class FeedRun:
    """Browser feed that receives entries and 20 calls of due_messages() per second, as in the web process."""

    def __init__(self):
        self.feed, self.now_s, self.sent = BrowserFeed(), 100.0, []

    def process(self, *entries):
        for entry in entries:
            self.feed.process(entry)
        return self

    def tick(self):
        messages = self.feed.due_messages(self.now_s)
        self.sent += messages
        self.now_s += 0.05
        return messages

    def send_snapshots(self, seconds, **changes):
        for _ in range(round(seconds / 0.05)):
            self.process(snapshot(self.now_s, **changes)).tick()
        return self

    def send_samples(self, seconds, **changes):
        for _ in range(round(seconds / 0.05)):
            self.process(*(sample(self.now_s + i / 500, **changes) for i in range(25))).tick()
        return self

    def all(self, name):
        return [message.data for message in self.sent if message.event == name]


@pytest.fixture
def run():
    return FeedRun().process(header(STARTED_S, utc_us=round((UTC_OFFSET_S + STARTED_S) * 1e6)))


def initial(run, name):
    return [message.data for message in run.feed.initial_messages() if message.event == name]


def history_times_s(run):
    """Return the times of all history messages, earliest first."""
    return [t_s for part in reversed(run.feed.history_messages()) for t_s in part.data["t_s"]]


def test_before_the_instrument_is_reached_only_the_link_is_sent():
    feed = BrowserFeed()
    link, contacts, events = feed.initial_messages()
    assert (link.event, link.data["up"], link.data["started_s"]) == ("link", False, 0.0)
    assert link.data["reason"]
    assert contacts == SseMessage("contacts", {"rows": []})
    assert events == SseMessage("events", {"rows": []})
    assert feed.history_messages() == []


def test_the_link_is_up_with_the_first_snapshot(run):
    assert [m.event for m in run.tick()] == ["contacts"]
    run.process(snapshot(run.now_s))
    assert [m.event for m in run.tick()][:2] == ["link", "state"]
    assert run.all("link") == [
        {"up": True, "reason": "", "started_s": STARTED_S, "utc_offset_s": UTC_OFFSET_S}
    ]


def test_old_values_become_invalid_and_new_values_are_valid_again(run):
    run.send_snapshots(0.1)
    for _ in range(round(SNAPSHOT_TIMEOUT_S / 0.05) + 2):
        run.tick()
    assert run.feed.snapshot is None
    assert initial(run, "state") == []
    assert [link["up"] for link in run.all("link")] == [True, False]
    run.send_snapshots(0.05)
    assert [link["up"] for link in run.all("link")] == [True, False, True]


def test_after_a_disconnection_no_value_is_sent(run):
    run.send_snapshots(0.2).send_samples(0.5).process(health(run.now_s))
    run.feed.disconnected("No power.")
    assert run.feed.snapshot is None
    assert initial(run, "link") == [
        {"up": False, "reason": "No power.", "started_s": STARTED_S, "utc_offset_s": UTC_OFFSET_S}
    ]
    assert run.feed.history_messages() == []
    assert initial(run, "health") == initial(run, "state") == []


def test_the_reason_of_a_normal_end_is_kept_when_the_connection_closes(run):
    run.send_snapshots(0.1).process(json_entry(EntryKind.END, run.now_s, {"why": "stop requested"}))
    run.feed.disconnected("The instrument has closed the connection.")
    run.tick()
    [reason] = [link["reason"] for link in run.all("link")[1:]]
    assert "stop requested" in reason


def test_the_state_is_sent_five_times_per_second(run):
    run.send_snapshots(4.0)
    assert 19 <= len(run.all("state")) <= 21


def test_the_state_contains_the_time_of_the_last_vent_request_of_any_client(run):
    run.send_snapshots(0.5)
    for seconds, mode in ((0.1, "vent"), (0.2, "hold")):
        values = ["modbus_tcp", "10.0.0.7:5000", {"mode": mode}]
        run.process(json_entry(EntryKind.WRITE, run.now_s + seconds, values))
    requested_s = round(run.now_s + 0.1, 4)
    run.send_snapshots(0.5)
    times_s = [state["vent_requested_s"] for state in run.all("state")]
    assert (times_s[0], times_s[-1]) == (0.0, requested_s)


@pytest.mark.parametrize("changed", [{"state": "tripped"}, {"status": ["burst"]}, {"faults": [5]}])
def test_a_change_of_the_state_is_sent_at_once(run, changed):
    run.send_snapshots(1.0).process(snapshot(run.now_s, **changed))
    [state] = [m.data for m in run.tick() if m.event == "state"]
    assert state.items() >= changed.items()


def test_the_same_snapshot_is_not_sent_twice(run):
    run.process(snapshot(run.now_s)).tick()
    assert [m for _ in range(10) for m in run.tick()] == []


def test_a_new_browser_gets_the_last_minute(run):
    run.send_samples(90.0)
    times_s = history_times_s(run)
    assert times_s == sorted(times_s)
    assert 59.9 <= times_s[-1] - times_s[0] <= 60.0


def test_history_messages_are_short(run):
    run.send_samples(90.0)
    for part in run.feed.history_messages():
        assert len({len(column) for column in part.data.values()}) == 1
        assert len(part.encode()) < 3000


def test_each_sample_is_sent_once_and_in_order(run):
    run.send_samples(5.0)
    times_s = [t_s for samples in run.all("samples") for t_s in samples["t_s"]]
    assert times_s == sorted(set(times_s))
    assert times_s == history_times_s(run)


def test_a_value_that_is_not_available_is_null(run):
    run.send_samples(0.2, force_n=math.nan, pressure_kpa=math.inf, baseline_kpa=math.nan)
    [samples, *_] = run.all("samples")
    assert {*samples["force_n"], *samples["pressure_kpa"], *samples["baseline_kpa"]} == {None}


def test_all_messages_are_strict_json(run):
    run.send_snapshots(0.2, force_n=None).send_samples(0.2, in_contact=True, force_n=math.nan)
    run.process(health(run.now_s))
    run.process(event("2027", kind="state", was="venting", **{"is": "vented"})).tick()
    for message in [*run.sent, *run.feed.initial_messages(), *run.feed.history_messages()]:
        body = message.encode().decode().split("data: ")[1]
        assert body.endswith("\n\n")
        assert json.loads(body, parse_constant=pytest.fail) == json.loads(json.dumps(message.data))


def test_a_contact_is_sent_at_its_start_each_second_and_at_its_end(run):
    run.send_samples(1.0)
    run.send_samples(3.0, in_contact=True, rise_kpa=1.0, force_n=2.0)
    run.send_samples(1.0)
    rows = [contacts["rows"] for contacts in run.all("contacts")]
    assert [len(each) for each in rows] == [0, 1, 1, 1, 1]
    assert [each[0]["open"] for each in rows[1:]] == [True, True, True, False]
    assert rows[-1][0]["peak_n"] == 2.0
    assert rows[-1][0]["final_kpa"] == 9.0


def test_only_changed_contacts_are_sent_and_a_new_browser_gets_all(run):
    for force_n in (1.0, 2.0, 3.0):
        run.send_samples(0.5).send_samples(0.5, in_contact=True, rise_kpa=1.0, force_n=force_n)
    numbers = [[row["number"] for row in contacts["rows"]] for contacts in run.all("contacts")]
    assert numbers == [[], [1], [1], [2], [2], [3]]
    assert [row["peak_n"] for row in initial(run, "contacts")[0]["rows"]] == [1.0, 2.0, 3.0]


def test_the_contacts_stay_after_a_disconnection_and_a_connection_to_the_same_run(run):
    run.send_samples(0.5).send_samples(0.5, in_contact=True, rise_kpa=1.0).tick()
    run.feed.disconnected("No power.")
    run.sent.clear()
    run.tick()
    assert run.all("contacts") == []
    run.process(header(STARTED_S)).tick()
    assert [row["open"] for row in initial(run, "contacts")[0]["rows"]] == [True]
    run.now_s += 1.0
    run.send_samples(0.5)
    [row] = initial(run, "contacts")[0]["rows"]
    assert (row["open"], row["interrupted"]) == (False, True)


def test_the_last_fifty_events_are_kept_as_text(run):
    for i in range(70):
        values = {"mode": [i, i + 1]}
        run.process(event(f"{i}", kind="write", who="web", values=values, result="accepted"))
    run.tick()
    assert len(run.all("event")) == 70
    kept = shown_events(run)
    assert len(kept) == MAX_EVENTS
    assert kept[-1] == {"at": "69", "kind": "write", "text": "web page: mode 69 → 70: accepted"}


def logged(*texts):
    """Return events as a reader of the event log returns them."""
    return [event_message(event(text, kind="stop", why=text).json_body) for text in texts]


def shown_events(run):
    (events,) = initial(run, "events")
    return events["rows"]


def test_the_events_of_the_log_precede_the_received_events_without_duplicates(run):
    for text in "def":
        run.process(event(text, kind="stop", why=text))
    run.feed.add_earlier_events(logged(*"abcde"))  # the disk does not have f yet
    assert [each["at"] for each in shown_events(run)] == list("abcdef")
    sent = [message for message in run.tick() if message.event.startswith("event")]
    assert [message.event for message in sent] == [*["event"] * 3, "events"]
    assert sent[-1].data == {"rows": shown_events(run)}
    run.process(event("g", kind="stop", why="g")).tick()
    assert [each["at"] for each in run.all("event")] == list("defg")
    assert [each["at"] for each in shown_events(run)] == list("abcdefg")


def test_an_event_that_only_the_log_has_received_yet_is_shown_once(run):
    run.process(event("a", kind="stop", why="a"))
    run.feed.add_earlier_events(logged("a", "b"))
    assert [each["at"] for each in shown_events(run)] == ["a", "b"]


def test_the_list_of_events_keeps_the_latest_of_a_long_log(run):
    run.process(event("last", kind="stop", why="last"))
    run.feed.add_earlier_events(logged(*map(str, range(MAX_EVENTS))))
    assert [each["at"] for each in shown_events(run)] == [*map(str, range(1, MAX_EVENTS)), "last"]


def test_the_events_start_again_with_each_header(run):
    run.process(event("a", kind="stop", why="a"), header(serial_number=8))
    assert shown_events(run) == []


def test_the_header_of_another_instrument_resets_the_feed(run):
    run.send_samples(1.0, in_contact=True, rise_kpa=1.0).process(header(serial_number=8))
    assert initial(run, "contacts") == [{"rows": []}]
    assert run.feed.history_messages() == []
    assert run.feed.header["serial_number"] == 8


def test_rates_are_increases_per_second_and_unknown_at_first(run):
    client = {"address": "10.0.0.2:4", "requests": 10, "exceptions": 0, "age_s": 0.0}
    server = {"requests": 10, "exceptions": 1, "clients": [client]}
    run.process(health(10.0, rig={"samples": 100}, modbus_tcp=server)).tick()
    later = {"requests": 50, "exceptions": 2, "clients": [client | {"requests": 30}]}
    run.process(health(12.0, rig={"samples": 1100}, modbus_tcp=later)).tick()
    first, second = run.all("health")
    assert set(first["rates"].values()) == {None}
    assert second["rates"]["samples_per_s"] == 500
    assert second["rates"]["modbus_requests_per_s"] == 20
    assert second["rates"]["can_sent_per_s"] is None
    assert second["modbus_tcp"]["clients"][0]["requests_per_s"] == 10


def test_a_counter_that_was_reset_has_no_rate(run):
    run.process(health(10.0, rig={"samples": 9000}), health(11.0, rig={"samples": 5}))
    assert initial(run, "health")[0]["rates"]["samples_per_s"] is None


@pytest.mark.parametrize("kind", [EntryKind.SNAPSHOT, EntryKind.HEALTH, EntryKind.EVENT, EntryKind.HEADER])
def test_an_entry_with_invalid_json_is_an_error(run, kind):
    with pytest.raises(StreamError):
        run.process(StreamEntry(kind, 0.0, b"{"))


def test_a_sample_of_another_version_is_an_error(run):
    with pytest.raises(struct.error):
        run.process(StreamEntry(EntryKind.SAMPLE, 0.0, b"short"))
