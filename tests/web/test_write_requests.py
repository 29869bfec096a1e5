"""Tests of write requests of browsers: a vent without a login, and writes of users."""

import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from pneuforce.web.operator_texts import REJECT_TEXTS
from tests.system.waiting import wait_for
from tests.web.serving import Site, send_until_received


def test_a_vent_needs_no_login(site, instrument):
    assert site.post("/api/vent", {})[2]["reject_reason"] == "none"
    assert instrument.requests == [{"mode": "vent"}]


def test_the_answer_to_a_vent_contains_its_time(site):
    before_s = time.monotonic()
    t_s = site.post("/api/vent", {})[2]["t_s"]
    assert before_s - 1e-3 <= t_s <= time.monotonic() + 1e-3


@pytest.mark.parametrize("body", ["", "{", "x" * 100_000])
def test_a_vent_ignores_the_body(site, instrument, body):
    assert site.post("/api/vent", body)[0] == 200
    assert instrument.requests == [{"mode": "vent"}]


def test_many_vents_at_once_are_sent_as_few_requests_and_all_are_answered(site, instrument):
    instrument.delay_s = 0.02
    with ThreadPoolExecutor(100) as clients:
        statuses = list(clients.map(lambda _: site.post("/api/vent", {})[0], range(200)))
    assert statuses == [200] * 200
    assert len(instrument.requests) < 200
    assert all(request == {"mode": "vent"} for request in instrument.requests)


def test_a_vent_that_arrives_during_another_vent_is_sent_too(site, instrument):
    """Another client could have inflated the balloon after the first vent."""
    instrument.delay_s = 0.3
    with ThreadPoolExecutor(10) as clients:
        for count in range(1, 5):
            clients.submit(site.post, "/api/vent", {})
            wait_for(lambda: len(instrument.requests), lambda sent, count=count: sent >= count)


def test_a_vent_without_an_answer_is_reported_as_failed(site, instrument):
    instrument.answers = False
    status, _, answer = site.post("/api/vent", {})
    assert status == 503
    assert "stop switch" in answer["text"]


def test_a_vent_without_an_instrument_is_reported_as_failed(tmp_path):
    site = Site(tmp_path / "missing.sock")
    status, _, answer = site.post("/api/vent", {})
    site.stop()
    assert status == 503
    assert "stop switch" in answer["text"]


FORM = {"Content-Type": "application/x-www-form-urlencoded", "Accept": "text/html,*/*;q=0.8"}


def vent_by_form(site, **headers):
    """Vent as a browser without scripts. Return status, headers and page."""
    status, received, page = site.post("/api/vent", "", **FORM, **headers)
    assert received["content-type"].startswith("text/html")
    assert b'<a href="/">' in page
    return status, received, page.decode()


def test_a_browser_without_scripts_follows_a_vent_on_plain_pages(site, instrument):
    status, headers, page = vent_by_form(site)
    assert (status, "Vent accepted" in page) == (200, True)
    assert instrument.requests == [{"mode": "vent"}]
    path = headers["refresh"].partition("url=")[2]
    for bits, causes, title, is_final in [
        ([], [], "Not vented yet: venting", False),
        (["vent_fault"], [], "NOT VENTED", False),
        (["vented"], ["tube_unproven"], "NOT VERIFIED", False),
        (["vented"], ["zero_old"], "Vented", True),
    ]:
        state = {"state": "venting", "status": bits, "maintenance_causes": causes}
        send_until_received(instrument, site, state)
        wait_for(lambda: site.get(path)[2].decode(), lambda page, title=title: f">{title}</h1>" in page)
        assert ('class="alarm"' in site.get(path)[2].decode()) == title.startswith("NOT ")
        assert ("refresh" not in site.get(path)[1]) == is_final


def test_a_browser_without_scripts_reads_at_once_that_an_earlier_vent_has_failed(site, instrument):
    send_until_received(instrument, site, {"state": "tripped", "status": ["vent_fault"]})
    page = vent_by_form(site)[2]
    assert ">NOT VENTED</h1>" in page
    assert "do not pull it out" in page
    assert instrument.requests == [{"mode": "vent"}]


def test_a_browser_without_scripts_reads_why_a_vent_failed(site, instrument):
    instrument.reject_reason = "link_lost"
    assert "NOT VENTED" in (page := vent_by_form(site)[2])
    assert REJECT_TEXTS["link_lost"] in page
    status, _, page = vent_by_form(site, Origin="http://other.example")
    assert (status, "NOT VENTED" in page) == (403, True)
    instrument.answers = False
    status, _, page = vent_by_form(site)
    assert (status, "NOT VENTED" in page, "stop switch" in page) == (503, True, True)


def test_a_write_request_is_passed_to_the_instrument_unchanged(site, instrument):
    status, _, answer = site.write({"setpoint_requested": 6.5, "mode": "hold"})
    assert (status, answer["reject_reason"]) == (200, "none")
    assert instrument.requests == [{"setpoint_requested": 6.5, "mode": "hold"}]


def test_a_write_request_contains_the_time_of_the_shown_state_and_a_vent_does_not(site, instrument):
    site.write({"setpoint_requested": 6.5}, seen_s=12.5)
    site.post("/api/write", {"values": {"mode": "vent"}})
    site.post("/api/vent", {})
    assert instrument.seen_s == [12.5, None, None]


@pytest.mark.parametrize("seen_s", [None, True, "1.0", [1.0], 10**400])
def test_a_write_request_without_a_valid_time_is_rejected(site, instrument, seen_s):
    status, _, answer = site.write({"mode": "hold"}, seen_s=seen_s)
    assert (status, instrument.requests) == (400, [])
    assert "seen_s" in answer["text"]


def test_a_reject_reason_is_returned_with_its_advice(site, instrument):
    instrument.reject_reason = "not_zeroed"
    status, _, answer = site.write({"mode": "hold"})
    assert (status, answer["reject_reason"]) == (200, "not_zeroed")
    assert answer["text"] == REJECT_TEXTS["not_zeroed"]


@pytest.mark.parametrize(
    ("body", "status"),
    [
        ("", 400),
        ("[]", 400),
        ("null", 400),
        ("{", 400),
        ("\xff\xfe", 400),
        ("[" * 10_000, 400),
        ("{}", 400),
        ('{"values": []}', 400),
        ('{"values": {}}', 400),
        ('{"values": {"no_such": 1}}', 400),
        ('{"values": {"\\ud800": 1}}', 400),
        ('{"values": {"force": 1}}', 400),
        ('{"values": {"mode": NaN}}', 400),
        ('{"values": {"setpoint_requested": NaN}}', 400),
        ('{"values": {"setpoint_requested": 1e999}}', 400),
        ('{"values": {"setpoint_requested": 1' + "0" * 400 + "}}", 400),
        ('{"values": {"setpoint_requested": 1' + "0" * 5000 + "}}", 400),
        ('{"values": {"setpoint_requested": 13}}', 400),
        ('{"values": {"setpoint_requested": "8"}}', 400),
        ('{"values": {"setpoint_requested": true}}', 400),
        ('{"values": {"setpoint_requested": [8]}}', 400),
        ('{"values": {"mode": "inflate"}}', 400),
        ('{"values": {"mode": {"a": 1}}}', 400),
        ('{"values": {"mode": "hold"}, "seen_s": 1e999}', 400),
        ("x" * 10_000_000, 413),
    ],
    ids=lambda value: str(value)[:40],
)
def test_an_invalid_write_request_is_rejected_with_one_short_text(site, instrument, body, status):
    actual, _, answer = site.post("/api/write", body, **site.cookies())
    assert actual == status
    assert answer["text"].endswith(".")
    assert len(answer["text"]) < 300
    assert "Traceback" not in answer["text"]
    assert instrument.requests == []
