"""Tests of the login with the operator's token over HTTP: cookie, floods of wrong tokens, and reports."""

import contextlib
import itertools
import threading
import time
from http.cookies import SimpleCookie

import pytest

from pneuforce.web import operator_token
from pneuforce.web.failed_logins import MAX_ADDRESSES, OTHERS, FailedLogins
from pneuforce.web.known_browsers import LIFE_S, MAX_BROWSERS, KnownBrowsers
from tests.system.waiting import wait_for
from tests.web.serving import TOKEN, Site

FLOOD_PER_S = 20


def log_in(site, token=TOKEN, **headers):
    """Send a token. Return the HTTP status."""
    return site.post("/api/token", {"token": token}, **headers)[0]


def cookie_of(site):
    """Log in and return the headers with the cookie of the browser."""
    _, headers, _ = site.post("/api/token", {"token": TOKEN})
    ((name, morsel),) = SimpleCookie(headers["set-cookie"]).items()
    return {"Cookie": f"{name}={morsel.value}"}


def exceed_the_limit(site, **headers):
    """Send wrong tokens until the web server compares no further token."""
    assert 429 in {log_in(site, "wrong", **headers) for _ in range(operator_token.MAX_ATTEMPTS + 1)}


@contextlib.contextmanager
def flood_of_wrong_tokens(site):
    """Send 20 different wrong tokens per second from another thread."""
    end = threading.Event()

    def send():
        for number in itertools.count():
            log_in(site, f"wrong {number}")
            if end.wait(1 / FLOOD_PER_S):
                return

    sender = threading.Thread(target=send, daemon=True)
    sender.start()
    try:
        yield
    finally:
        end.set()
        sender.join(10)


def test_a_login_sets_a_cookie_that_scripts_and_other_sites_cannot_use(site):
    _, headers, _ = site.post("/api/token", {"token": TOKEN})
    ((name, cookie),) = SimpleCookie(headers["set-cookie"]).items()
    assert str(site.port) in name
    assert cookie["httponly"]
    assert cookie["samesite"] == "strict"
    assert int(cookie["max-age"]) == LIFE_S
    assert TOKEN not in cookie.value
    assert site.post("/api/token", {"token": "wrong"})[1]["set-cookie"] is None


def test_wrong_tokens_of_others_at_the_same_address_do_not_disturb_a_known_browser(site, instrument):
    cookie = cookie_of(site)
    exceed_the_limit(site)
    assert log_in(site) == 429
    assert [log_in(site, **cookie) for _ in range(20)] == [200] * 20
    assert site.write({"mode": "hold"}, **cookie)[0] == 200
    assert instrument.requests == [{"mode": "hold"}]


def test_the_cookie_alone_permits_no_write_and_no_further_guesses(site, instrument):
    cookie = cookie_of(site)
    assert site.write({"mode": "hold"}, token="wrong", **cookie)[0] == 401
    exceed_the_limit(site, **cookie)
    assert log_in(site, **cookie) == 429
    assert log_in(site) == 200
    assert instrument.requests == []


def test_a_forged_cookie_has_no_effect(site):
    (name_and_key,) = cookie_of(site).values()
    name = name_and_key.partition("=")[0]
    exceed_the_limit(site)
    statuses = [log_in(site, Cookie=f"{name}={'x' * length}") for length in range(10)]
    assert statuses == [429] * 10


def test_a_new_browser_logs_in_during_a_flood_of_wrong_tokens(site, monkeypatch):
    period_s, place_timeout_s = 0.5, 1.0
    monkeypatch.setattr(operator_token, "ATTEMPT_PERIOD_S", period_s)
    monkeypatch.setattr(operator_token, "PLACE_TIMEOUT_S", place_timeout_s)
    monkeypatch.setattr(operator_token, "CLEANING_PERIOD_S", 0.1)
    with flood_of_wrong_tokens(site):
        wait_for(lambda: log_in(site, "wrong"), (429).__eq__)
        begin_s = time.monotonic()
        wait_for(lambda: log_in(site), (200).__eq__)
        assert time.monotonic() - begin_s < 2 * period_s + place_timeout_s + 2.0


def test_failed_logins_are_reported_to_the_instrument_with_the_address(instrument):
    site = Site(instrument.path, allow=["127.0.0.3"])
    with contextlib.closing(site.connect(address="127.0.0.3")) as connection:
        connection.request("POST", "/api/token", '{"token": "wrong"}')
        assert connection.getresponse().status == 401
    exceed_the_limit(site)
    log_in(site)

    def counts():
        counted = {}
        for report in instrument.failed_logins:
            key = report["address"], report["reason"]
            counted[key] = counted.get(key, 0) + report["times"]
        return counted

    expected = {
        ("127.0.0.3", "wrong_token"): 1,
        ("127.0.0.1", "wrong_token"): operator_token.MAX_ATTEMPTS,
        ("127.0.0.1", "too_many_attempts"): 2,
    }
    wait_for(counts, expected.__eq__)
    assert len(instrument.failed_logins) <= 2 * len(expected)
    site.stop()


def test_write_requests_contain_the_address_of_the_browser(instrument):
    site = Site(instrument.path, allow=["127.0.0.3"])
    wait_for(lambda: instrument.subscriptions, bool)
    site.write({"mode": "hold"})
    with contextlib.closing(site.connect(address="127.0.0.3")) as connection:
        connection.request("POST", "/api/vent")
        connection.getresponse().read()
    site.stop()
    assert instrument.addresses == ["127.0.0.1", "127.0.0.3"]


def test_the_number_and_the_life_of_known_browsers_are_limited():
    browsers = KnownBrowsers()
    first = browsers.remember("", 0.0)
    assert browsers.remember(first, 1.0) == first
    assert browsers.contains(first, 1.0 + LIFE_S)
    assert not browsers.contains(first, 2.0 + LIFE_S)
    keys = {browsers.remember("", 2.0) for _ in range(MAX_BROWSERS)}
    assert len(keys) == MAX_BROWSERS
    assert not browsers.contains(first, 2.0)
    assert all(browsers.contains(key, 2.0) for key in keys)


def test_the_size_of_a_report_is_limited():
    failed = FailedLogins()
    for number in range(1000):
        failed.add(f"10.0.0.{number}", "wrong_token")
    counts = {report["address"]: report["times"] for report in failed.take()}
    assert len(counts) == MAX_ADDRESSES + 1
    assert counts[OTHERS] == 1000 - MAX_ADDRESSES
    assert failed.take() == []


@pytest.mark.parametrize("host", ["localhost", "[::1]", "127.0.0.1:99999"])
def test_a_login_is_possible_with_each_host_header(site, host):
    assert log_in(site, Host=host) == 200
