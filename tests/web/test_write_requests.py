"""What browsers order: a vent for everybody, writes for who has the token, a sentence for what cannot be."""

import pytest

from tests.page.serving import Site
from tests.system.waiting import wait_for


def test_a_vent_needs_no_token(site, station):
    assert site.post("/api/vent", {})[2]["refusal"] == "none"
    assert station.asked == [{"mode": "vent"}]


@pytest.mark.parametrize("body", ["", "{", "x" * 100_000])
def test_a_vent_is_a_vent_whatever_comes_with_it(site, station, body):
    assert site.post("/api/vent", body)[0] == 200
    assert station.asked == [{"mode": "vent"}]


def test_a_vent_that_is_not_answered_is_said_to_have_failed(site, station):
    station.answers = False
    status, _, answer = site.post("/api/vent", {})
    assert status == 503
    assert "stop switch" in answer["text"]


def test_a_vent_without_an_instrument_fails_at_once_and_says_so(tmp_path):
    site = Site(tmp_path / "nobody.sock")
    status, _, answer = site.post("/api/vent", {})
    site.end()
    assert status == 503
    assert "stop switch" in answer["text"]


def test_a_write_reaches_the_instrument_in_its_own_units(site, station):
    status, _, answer = site.write({"setpoint_requested": 6.5, "mode": "hold"})
    assert (status, answer) == (200, {"refusal": "none", "text": "Accepted."})
    assert station.asked == [{"setpoint_requested": 6.5, "mode": "hold"}]


def test_a_write_says_what_it_was_decided_upon_and_a_vent_need_not(site, station):
    site.write({"setpoint_requested": 6.5}, seen_s=12.5)
    site.post("/api/write", {"token": "correct-horse-battery", "values": {"mode": "vent"}})
    site.post("/api/vent", {})
    assert station.seen_s == [12.5, None, None]


@pytest.mark.parametrize("seen_s", [None, True, "1.0", [1.0], 10**400])
def test_what_was_decided_upon_nothing_is_not_asked(site, station, seen_s):
    status, _, answer = site.write({"mode": "hold"}, seen_s=seen_s)
    assert (status, station.asked) == (400, [])
    assert "seen_s" in answer["text"]


def test_a_refusal_is_said_in_a_sentence(site, station):
    station.refusal = "not_zeroed"
    status, _, answer = site.write({"mode": "hold"})
    assert (status, answer["refusal"]) == (200, "not_zeroed")
    assert answer["text"].startswith("The sensor has no zero")


def test_a_wrong_token_writes_nothing_and_is_soon_not_looked_at(site, station):
    stati = [site.write({"mode": "hold"}, token="wrong")[0] for _ in range(12)]
    assert stati == sorted(stati)
    assert set(stati) == {401, 429}
    assert site.write({"mode": "hold"})[0] == 429
    assert station.asked == []
    assert site.post("/api/vent", {})[0] == 200


def test_a_token_can_be_tried_without_writing(site, station):
    assert site.post("/api/token", {"token": "correct-horse-battery"})[0] == 200
    assert site.post("/api/token", {"token": "wrong"})[0] == 401
    assert station.asked == []


def test_without_a_configured_token_nobody_writes_and_everybody_vents(station):
    site = Site(station.path, token="")
    wait_for(lambda: station.wanted, bool)
    assert site.get("/api/about")[2]["writable"] is False
    assert site.write({"mode": "hold"}, token="")[0] == 401
    assert site.post("/api/vent", {})[0] == 200
    site.end()
    assert station.asked == [{"mode": "vent"}]


TOKEN = '"token": "correct-horse-battery"'


@pytest.mark.parametrize(
    ("body", "status"),
    [
        ("", 400),
        ("[]", 400),
        ("null", 400),
        ("{", 400),
        ("\xff\xfe", 400),
        ("[" * 10_000, 400),
        ("{" + TOKEN + "}", 400),
        ("{" + TOKEN + ', "values": []}', 400),
        ("{" + TOKEN + ', "values": {}}', 400),
        ("{" + TOKEN + ', "values": {"no_such": 1}}', 400),
        ("{" + TOKEN + ', "values": {"\\ud800": 1}}', 400),
        ("{" + TOKEN + ', "values": {"force": 1}}', 400),
        ("{" + TOKEN + ', "values": {"mode": NaN}}', 400),
        ("{" + TOKEN + ', "values": {"setpoint_requested": NaN}}', 400),
        ("{" + TOKEN + ', "values": {"setpoint_requested": 1e999}}', 400),
        ("{" + TOKEN + ', "values": {"setpoint_requested": 1' + "0" * 400 + "}}", 400),
        ("{" + TOKEN + ', "values": {"setpoint_requested": 1' + "0" * 5000 + "}}", 400),
        ("{" + TOKEN + ', "values": {"setpoint_requested": 13}}', 400),
        ("{" + TOKEN + ', "values": {"setpoint_requested": "8"}}', 400),
        ("{" + TOKEN + ', "values": {"setpoint_requested": true}}', 400),
        ("{" + TOKEN + ', "values": {"setpoint_requested": [8]}}', 400),
        ("{" + TOKEN + ', "values": {"mode": "inflate"}}', 400),
        ("{" + TOKEN + ', "values": {"mode": {"a": 1}}}', 400),
        ("{" + TOKEN + ', "values": {"mode": "hold"}, "seen_s": 1e999}', 400),
        ('{"values": {"mode": "hold"}}', 401),
        ('{"token": "\\ud800", "values": {"mode": "hold"}}', 401),
        ('{"token": 5, "values": {"mode": "hold"}}', 401),
        ("x" * 10_000_000, 413),
    ],
    ids=lambda value: str(value)[:40],
)
def test_what_cannot_be_asked_is_refused_in_a_sentence_and_asks_nothing(site, station, body, status):
    told, _, answer = site.post("/api/write", body)
    assert told == status
    assert answer["text"].endswith(".")
    assert len(answer["text"]) < 300
    assert "Traceback" not in answer["text"]
    assert station.asked == []
