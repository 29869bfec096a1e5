"""Tests of the login over HTTP: cookies, roles, sessions, floods of wrong passwords, and reports."""

import contextlib
import itertools
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from http.cookies import SimpleCookie

import pytest

from pneuforce.instrument.users.file import User
from pneuforce.instrument.users.password import NO_PASSWORD
from pneuforce.web.login import login_limiter, password_check
from pneuforce.web.login.known_browsers import LIFE_S, MAX_BROWSERS, KnownBrowsers
from pneuforce.web.login.login_events import MAX_FAILURES, OTHERS, LoginEvents
from tests.system.waiting import wait_for
from tests.web.serving import Site
from tests.web.users import OPERATOR, PASSWORD, USERS, VIEWER, users_file, with_password

FLOOD_PER_S = 20
HOLD = {"mode": "hold"}


def try_login(site, password=PASSWORD, name=OPERATOR, **headers):
    """Send a name and a password. Return the HTTP status."""
    return site.log_in(name, password, **headers)[0]


def user_of(site, cookies):
    """Return the name of the user who is logged in; None if no user is."""
    user = site.post("/api/session", {}, **cookies)[2]["user"]
    return user and user["name"]


def exceed_the_limit(site, **headers):
    """Send wrong passwords until the web server compares no more of them. Return how many it compared.

    On a busy machine the comparisons can last longer than the period, and then a further one is permitted.
    """
    begin_s = time.monotonic()
    compared = 0
    while try_login(site, "wrong", **headers) != 429:
        compared += 1
        periods = (time.monotonic() - begin_s) / login_limiter.ATTEMPT_PERIOD_S
        assert compared <= login_limiter.MAX_ATTEMPTS + periods
    return compared


@contextlib.contextmanager
def flood_of_wrong_passwords(site):
    """Send 20 different wrong passwords per second from another thread."""
    end = threading.Event()

    def send():
        for number in itertools.count():
            try_login(site, f"wrong {number}")
            if end.wait(1 / FLOOD_PER_S):
                return

    sender = threading.Thread(target=send, daemon=True)
    sender.start()
    try:
        yield
    finally:
        end.set()
        sender.join(10)


def set_cookies(site, **headers):
    """Log in and return the cookies that the response sets, by name."""
    body = {"name": OPERATOR, "password": PASSWORD}
    _, received, _ = site.post("/api/login", body, **headers)
    jar = SimpleCookie()
    for line in received.get_all("set-cookie"):
        jar.load(line)
    return jar


def test_a_login_sets_cookies_that_scripts_and_other_sites_cannot_use(site):
    jar = set_cookies(site)
    assert set(jar) == {f"pneuforce-session-{site.port}", f"pneuforce-browser-{site.port}"}
    for cookie in jar.values():
        assert cookie["httponly"]
        assert cookie["samesite"] == "strict"
        assert not cookie["secure"]
        assert PASSWORD not in cookie.value
    assert jar[f"pneuforce-session-{site.port}"]["max-age"] == ""  # until the browser is closed
    assert int(jar[f"pneuforce-browser-{site.port}"]["max-age"]) == LIFE_S
    assert site.log_in(password="wrong")[1] == {"Cookie": ""}


def test_the_name_is_accepted_as_a_phone_writes_it(site):
    status, cookies = site.log_in(" Anna ")
    assert (status, user_of(site, cookies)) == (200, OPERATOR)


def test_an_operator_may_write_a_viewer_may_vent_and_nobody_may_use_a_forged_cookie(site, instrument):
    assert site.write(HOLD)[0] == 200
    status, _, answer = site.write(HOLD, VIEWER)
    assert (status, answer["text"]) == (403, "bob is a viewer and may only read and vent.")
    assert site.write({"mode": "vent"}, VIEWER)[0] == 200
    assert site.write(HOLD, None)[0] == 401
    assert site.write(HOLD, None, Cookie=f"pneuforce-session-{site.port}=x")[0] == 401
    assert instrument.requests == [HOLD, {"mode": "vent"}]


def test_a_vent_in_a_request_that_the_role_does_not_permit_is_executed(site, instrument):
    assert site.write({"setpoint_requested": 6.0, "mode": "vent"}, VIEWER)[0] == 403
    assert instrument.requests == [{"mode": "vent"}]


def test_the_peer_of_a_request_is_the_user_at_the_address(site, instrument):
    site.write(HOLD)
    site.post("/api/vent", {}, **site.cookies(VIEWER))
    site.post("/api/vent", {})
    assert instrument.addresses == ["anna@127.0.0.1", "bob@127.0.0.1", "127.0.0.1"]


def test_a_logout_ends_the_session_of_one_browser(site):
    _, first = site.log_in()
    _, second = site.log_in()
    assert (user_of(site, first), user_of(site, second)) == (OPERATOR, OPERATOR)
    assert site.post("/api/logout", {}, **first)[0] == 200
    assert (user_of(site, first), user_of(site, second)) == (None, OPERATOR)
    assert site.write(HOLD, None, **first)[0] == 401
    assert site.write(HOLD, None, **second)[0] == 200


@pytest.mark.parametrize(
    "users",
    [{VIEWER: USERS[VIEWER]}, with_password(OPERATOR, "another-password")],
    ids=["removed", "changed"],
)
def test_a_change_of_the_file_ends_the_sessions_of_the_changed_user_only(site, instrument, users):
    operator, viewer = site.cookies(OPERATOR), site.cookies(VIEWER)
    users_file(instrument.path.parent, users)
    wait_for(lambda: user_of(site, operator), lambda user: user is None)
    assert site.write(HOLD, None, **operator)[0] == 401
    assert user_of(site, viewer) == VIEWER
    assert try_login(site) == 401
    ended = ("logout", "anna@127.0.0.1", "user_changed")
    wait_for(lambda: reported(instrument), lambda events: ended in events)


def test_a_new_user_can_log_in_without_a_restart(site, instrument):
    users_file(instrument.path.parent, with_password(OPERATOR, "another-password"))
    wait_for(lambda: site.services.logins.directory.users, lambda users: users != USERS)
    assert try_login(site, "another-password") == 200


def test_a_damaged_file_ends_all_logins_until_it_is_repaired(site, instrument, caplog):
    path = instrument.path.parent / "users.toml"
    good = path.read_bytes()
    path.write_bytes(good[:-40])
    wait_for(lambda: user_of(site, site.cookies()), lambda user: user is None)
    status, _, answer = site.post("/api/login", {"name": OPERATOR, "password": PASSWORD})
    assert (status, "log of the instrument" in answer["text"]) == (503, True)
    assert site.post("/api/vent", {})[0] == 200
    assert f"{path}: the file of the users is damaged" in caplog.text
    path.write_bytes(good)
    wait_for(lambda: try_login(site), (200).__eq__)


@pytest.mark.parametrize("file", ["", "/nowhere/users.toml"])
def test_without_users_only_vent_is_possible(instrument, file):
    site = Site(instrument.path, users_file=file)
    wait_for(lambda: instrument.subscriptions, bool)
    assert site.post("/api/session", {})[2] == {"user": None, "has_users": False}
    assert try_login(site) == 401
    assert "pneuforce users add" in site.write(HOLD, None)[2]["text"]
    assert site.post("/api/vent", {})[0] == 200
    site.stop()
    assert instrument.requests == [{"mode": "vent"}]


def test_wrong_passwords_of_others_at_the_same_address_do_not_disturb_a_known_browser(site, instrument):
    known = site.cookies()
    exceed_the_limit(site)
    assert try_login(site) == 429
    assert [try_login(site, **known) for _ in range(20)] == [200] * 20
    assert instrument.requests == []


def test_a_known_browser_has_no_further_guesses_after_its_logout(site):
    _, known = site.log_in()
    site.post("/api/logout", {}, **known)
    exceed_the_limit(site, **known)
    assert try_login(site, **known) == 429
    assert try_login(site) == 200


def test_a_new_browser_logs_in_during_a_flood_of_wrong_passwords(site, monkeypatch):
    period_s, place_timeout_s = 0.5, 1.0
    monkeypatch.setattr(login_limiter, "ATTEMPT_PERIOD_S", period_s)
    monkeypatch.setattr(login_limiter, "PLACE_TIMEOUT_S", place_timeout_s)
    monkeypatch.setattr(login_limiter, "CLEANING_PERIOD_S", 0.1)
    with flood_of_wrong_passwords(site):
        wait_for(lambda: try_login(site, "wrong"), (429).__eq__)
        begin_s = time.monotonic()
        wait_for(lambda: try_login(site), (200).__eq__)
        assert time.monotonic() - begin_s < 2 * period_s + place_timeout_s + 2.0


def test_an_unknown_name_and_a_wrong_password_have_the_same_answer_and_the_same_cost(instrument):
    costly = {OPERATOR: User(OPERATOR, "operator", NO_PASSWORD)}
    site = Site(instrument.path, users_file=users_file(instrument.path.parent, costly))
    answers, durations_s = [], {OPERATOR: [], "eve": []}
    for name in (OPERATOR, "eve") * 3:
        begin_s = time.process_time()
        answers.append(site.post("/api/login", {"name": name, "password": "wrong"})[::2])
        durations_s[name].append(time.process_time() - begin_s)
    site.stop()
    assert answers == [(401, {"text": "The name or the password is wrong."})] * 6
    known_s, unknown_s = (min(each) for each in durations_s.values())
    assert known_s == pytest.approx(unknown_s, rel=0.5)


def test_logins_from_many_addresses_delay_neither_a_vent_nor_a_known_browser(instrument, monkeypatch):
    costly = USERS | {OPERATOR: User(OPERATOR, "operator", NO_PASSWORD)}
    monkeypatch.setattr(password_check, "MAX_WAITING", 5)
    addresses = [f"127.0.0.{number}" for number in range(2, 12)]
    file = users_file(instrument.path.parent, costly)
    site = Site(instrument.path, users_file=file, allow=["127.0.0.0/8"])
    wait_for(lambda: instrument.subscriptions, bool)
    known = site.cookies(VIEWER)

    def attempt(address):
        with contextlib.closing(site.connect(address=address)) as connection:
            connection.request("POST", "/api/login", '{"name": "anna", "password": "wrong"}')
            return connection.getresponse().status

    with ThreadPoolExecutor(len(addresses)) as clients:
        attempts = [clients.submit(attempt, address) for address in addresses]
        wait_for(lambda: any(each.done() for each in attempts), bool)
        waiting = sum(not each.done() for each in attempts)
        assert site.post("/api/vent", {})[0] == 200
        done_meanwhile = waiting - sum(not each.done() for each in attempts)
        assert try_login(site, name=VIEWER, **known) == 200
        statuses = {each.result() for each in attempts}
    site.stop()
    assert statuses == {401, 503}
    assert done_meanwhile < waiting  # the vent did not wait for all hashes


def reported(instrument):
    """Return the reported events as (kind, address, result), without their numbers."""
    return {(event["kind"], event["address"], event["result"]) for event in instrument.logins}


def test_logins_logouts_and_failures_are_reported_with_user_and_address(instrument):
    site = Site(instrument.path, allow=["127.0.0.3"])
    wait_for(lambda: instrument.subscriptions, bool)
    with contextlib.closing(site.connect(address="127.0.0.3")) as connection:
        connection.request("POST", "/api/login", '{"name": "eve", "password": "wrong"}')
        assert connection.getresponse().status == 401
    _, cookies = site.log_in()
    site.post("/api/logout", {}, **cookies)
    site.write(HOLD, None)
    site.write(HOLD, VIEWER)
    compared = exceed_the_limit(site, name="<script>")
    expected = {
        ("login", "127.0.0.3", "wrong_password", "eve"): 1,
        ("login", "anna@127.0.0.1", "accepted", ""): 1,
        ("logout", "anna@127.0.0.1", "requested", ""): 1,
        ("login", "127.0.0.1", "not_logged_in", ""): 1,
        ("login", "bob@127.0.0.1", "accepted", ""): 1,
        ("login", "bob@127.0.0.1", "not_permitted", ""): 1,
        ("login", "127.0.0.1", "wrong_password", ""): compared,
        ("login", "127.0.0.1", "too_many_attempts", ""): 1,
    }

    def counts():
        counted = {}
        for event in instrument.logins:
            key = event["kind"], event["address"], event["result"], event["user"]
            counted[key] = counted.get(key, 0) + event["times"]
        return counted

    wait_for(counts, expected.__eq__)
    assert len(instrument.logins) <= 2 * len(expected)
    site.stop()


def test_a_login_is_reported_before_the_first_write_of_the_user(site, instrument):
    _, cookies = site.log_in()
    site.write(HOLD, None, **cookies)
    assert [event["kind"] for event in instrument.logins] == ["login"]


def test_only_names_of_users_are_reported(site, instrument):
    for name in ("my password 123", "<b>", "x\ny", "ä", "x" * 64, ""):
        assert try_login(site, "wrong", name) == 401
    wait_for(lambda: instrument.logins, bool)
    assert {event["user"] for event in instrument.logins} == {""}


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"name": 1, "password": "x"},
        {"name": "a" * 65, "password": "x"},
        {"name": "a", "password": "x" * 129},
    ],
)
def test_a_request_without_name_and_password_is_rejected_and_not_counted(site, body):
    for _ in range(2 * login_limiter.MAX_ATTEMPTS):
        assert site.post("/api/login", body)[0] == 400
    assert try_login(site) == 200


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
    events = LoginEvents()
    for number in range(1000):
        events.add_failure(f"10.0.0.{number}", "wrong_password", f"user{number}")
    counts = {report["address"]: report["times"] for report in events.take()}
    assert len(counts) == MAX_FAILURES + 1
    assert counts[OTHERS] == 1000 - MAX_FAILURES
    assert events.take() == []


@pytest.mark.parametrize("host", ["localhost", "[::1]", "127.0.0.1:99999"])
def test_a_login_is_possible_with_each_host_header(site, host):
    assert try_login(site, Host=host) == 200
