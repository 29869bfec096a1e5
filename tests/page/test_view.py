"""What the browsers are told, out of what the instrument gives."""

import json
import math
import struct

import pytest

from instrument.tape.entry import Entry, Kind, TapeError, told
from page.streams import Message
from page.view import MOST_EVENTS, SILENT_S, View
from tests.page.entries import begin, event, health, measured, snapshot

BEGUN_S = 99.0


class Run:
    """A view that is fed as the process does it: entries, and 20 looks a second."""

    def __init__(self):
        self.view, self.now_s, self.seen = View(), 100.0, []

    def take(self, *entries):
        for entry in entries:
            self.view.take(entry)
        return self

    def look(self):
        messages = self.view.due(self.now_s)
        self.seen += messages
        self.now_s += 0.05
        return messages

    def hold(self, seconds, **changes):
        for _ in range(round(seconds / 0.05)):
            self.take(snapshot(self.now_s, **changes)).look()
        return self

    def sample(self, seconds, **changes):
        for _ in range(round(seconds / 0.05)):
            self.take(*(measured(self.now_s + i / 500, **changes) for i in range(25))).look()
        return self

    def all(self, name):
        return [message.data for message in self.seen if message.event == name]


@pytest.fixture
def run():
    return Run().take(begin(BEGUN_S))


def greeted(run, name):
    return [message.data for message in run.view.greeting() if message.event == name]


def history_s(run):
    """The times of all pieces, the earliest first."""
    return [t_s for piece in reversed(run.view.history()) for t_s in piece.data["t_s"]]


def test_nothing_is_known_before_the_instrument_was_reached():
    view = View()
    link = {"up": False, "why": "The instrument was not reached yet.", "begun_s": 0.0}
    assert view.greeting() == [Message("link", link), Message("contacts", {"rows": []})]
    assert view.history() == []


def test_the_link_is_up_with_the_first_values_and_not_before(run):
    assert [m.event for m in run.look()] == ["contacts"]
    run.take(snapshot(run.now_s))
    assert [m.event for m in run.look()][:2] == ["link", "state"]
    assert run.all("link") == [{"up": True, "why": "", "begun_s": BEGUN_S}]


def test_values_that_grow_old_are_void_and_come_back(run):
    run.hold(0.1)
    for _ in range(round(SILENT_S / 0.05) + 2):
        run.look()
    assert run.view.snapshot is None
    assert greeted(run, "state") == []
    assert [link["up"] for link in run.all("link")] == [True, False]
    run.hold(0.05)
    assert [link["up"] for link in run.all("link")] == [True, False, True]


def test_of_an_instrument_that_is_gone_nothing_is_shown(run):
    run.hold(0.2).sample(0.5).take(health(run.now_s))
    run.view.lose("It is gone.")
    assert run.view.snapshot is None
    assert greeted(run, "link") == [{"up": False, "why": "It is gone.", "begun_s": BEGUN_S}]
    assert run.view.history() == []
    assert greeted(run, "health") == greeted(run, "state") == []


def test_why_it_ended_is_not_forgotten_when_its_connection_closes(run):
    run.hold(0.1).take(told(Kind.END, run.now_s, {"why": "asked to stop"}))
    run.view.lose("The instrument has closed the connection.")
    run.look()
    assert [link["why"] for link in run.all("link")[1:]] == ["The instrument has ended: asked to stop."]


def test_the_state_comes_five_times_a_second(run):
    run.hold(4.0)
    assert 19 <= len(run.all("state")) <= 21


@pytest.mark.parametrize("changed", [{"state": "tripped"}, {"status": ["burst"]}, {"faults": [5]}])
def test_a_change_of_state_is_told_at_once(run, changed):
    run.hold(1.0).take(snapshot(run.now_s, **changed))
    [state] = [m.data for m in run.look() if m.event == "state"]
    assert state.items() >= changed.items()


def test_the_same_state_is_not_told_twice(run):
    run.take(snapshot(run.now_s)).look()
    assert [m for _ in range(10) for m in run.look()] == []


def test_who_comes_late_sees_the_last_minute(run):
    run.sample(90.0)
    past_s = history_s(run)
    assert past_s == sorted(past_s)
    assert 59.9 <= past_s[-1] - past_s[0] <= 60.0


def test_the_past_comes_in_pieces_that_hold_up_nothing_new(run):
    run.sample(90.0)
    for piece in run.view.history():
        assert len({len(column) for column in piece.data.values()}) == 1
        assert len(piece.encode()) < 3000


def test_samples_are_told_once_each_and_in_order(run):
    run.sample(5.0)
    told_s = [t_s for samples in run.all("samples") for t_s in samples["t_s"]]
    assert told_s == sorted(set(told_s))
    assert told_s == history_s(run)


def test_not_available_is_null_and_never_another_number(run):
    run.sample(0.2, force_n=math.nan, pressure_kpa=math.inf, initial_kpa=math.nan)
    [samples, *_] = run.all("samples")
    assert {*samples["force_n"], *samples["pressure_kpa"], *samples["initial_kpa"]} == {None}


def test_all_that_is_told_is_strict_json(run):
    run.hold(0.2, force_n=None).sample(0.2, in_contact=True, force_n=math.nan).take(health(run.now_s))
    run.take(event("2027", kind="state", was="venting", **{"is": "vented"})).look()
    for message in [*run.seen, *run.view.greeting(), *run.view.history()]:
        body = message.encode().decode().split("data: ")[1]
        assert body.endswith("\n\n")
        assert json.loads(body, parse_constant=pytest.fail) == json.loads(json.dumps(message.data))


def test_a_contact_is_told_when_it_begins_while_it_goes_on_and_when_it_ends(run):
    run.sample(1.0)
    run.sample(3.0, in_contact=True, rise_kpa=1.0, force_n=2.0)
    run.sample(1.0)
    rows = [contacts["rows"] for contacts in run.all("contacts")]
    assert [len(each) for each in rows] == [0, 1, 1, 1, 1]
    assert [each[0]["open"] for each in rows[1:]] == [True, True, True, False]
    assert rows[-1][0]["peak_n"] == 2.0
    assert rows[-1][0]["final_kpa"] == 9.0


def test_of_contacts_only_what_is_new_is_told_and_all_to_who_comes_late(run):
    for force_n in (1.0, 2.0, 3.0):
        run.sample(0.5).sample(0.5, in_contact=True, rise_kpa=1.0, force_n=force_n)
    numbers = [[row["number"] for row in contacts["rows"]] for contacts in run.all("contacts")]
    assert numbers == [[], [1], [1], [1, 2], [2], [2, 3]]
    assert [row["peak_n"] for row in greeted(run, "contacts")[0]["rows"]] == [1.0, 2.0, 3.0]


def test_the_last_fifty_events_are_kept_in_plain_words(run):
    for i in range(70):
        values = {"mode": [i, i + 1]}
        run.take(event(f"{i}", kind="write", who="page", values=values, verdict="accepted"))
    run.look()
    assert len(run.all("event")) == 70
    kept = greeted(run, "event")
    assert len(kept) == MOST_EVENTS
    assert kept[-1] == {"at": "69", "kind": "write", "text": "page: mode 69 → 70: accepted"}


def test_another_instrument_begins_anew(run):
    run.sample(1.0, in_contact=True, rise_kpa=1.0).take(begin(serial_number=8))
    assert greeted(run, "contacts") == [{"rows": []}]
    assert run.view.history() == []
    assert run.view.begun["serial_number"] == 8


def test_rates_are_differences_and_unknown_at_first(run):
    client = {"address": "10.0.0.2:4", "requests": 10, "exceptions": 0, "age_s": 0.0}
    server = {"requests": 10, "exceptions": 1, "clients": [client]}
    run.take(health(10.0, rig={"samples": 100}, modbus_tcp=server)).look()
    more = {"requests": 50, "exceptions": 2, "clients": [client | {"requests": 30}]}
    run.take(health(12.0, rig={"samples": 1100}, modbus_tcp=more)).look()
    first, second = run.all("health")
    assert set(first["rates"].values()) == {None}
    assert second["rates"]["samples_per_s"] == 500
    assert second["rates"]["modbus_requests_per_s"] == 20
    assert second["rates"]["can_sent_per_s"] is None
    assert second["modbus_tcp"]["clients"][0]["requests_per_s"] == 10


def test_counters_that_begin_anew_have_no_rate(run):
    run.take(health(10.0, rig={"samples": 9000}), health(11.0, rig={"samples": 5}))
    assert greeted(run, "health")[0]["rates"]["samples_per_s"] is None


@pytest.mark.parametrize("kind", [Kind.SNAPSHOT, Kind.HEALTH, Kind.EVENT, Kind.BEGIN])
def test_what_is_no_json_is_said_to_be_none(run, kind):
    with pytest.raises(TapeError):
        run.take(Entry(kind, 0.0, b"{"))


def test_a_sample_of_another_version_is_said_to_be_none(run):
    with pytest.raises(struct.error):
        run.take(Entry(Kind.MEASURED, 0.0, b"short"))
