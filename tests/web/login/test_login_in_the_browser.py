"""Tests of the login in a real browser, with a complete instrument on a simulated rig."""

import json
import time
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from pneuforce.web.login.login_limiter import ATTEMPT_PERIOD_S, MAX_ATTEMPTS
from tests.command_runner import pneuforce
from tests.system.waiting import wait_for
from tests.web.browser import NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT
from tests.web.process import request
from tests.web.users import OPERATOR, PASSWORD, USERS, VIEWER, users_file

pytestmark = [NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT]

PHONE = {"width": 360, "height": 740}
VENT_VERIFIED = "#vent-status[data-state=verified]"
#: What a password manager needs to find the fields.
AUTOCOMPLETE = "[...document.querySelectorAll('#log-in input')].map(({ autocomplete }) => autocomplete)"


@pytest.fixture
def page(live, browser):
    """Return a new browser with the page of a vented instrument. No user is logged in."""
    browser("open", url=live.url)
    live.recover()
    browser.wait_for_state("vented")
    yield browser
    live.log_in()


def log_in(page, name=OPERATOR, password=PASSWORD):
    page("fill", on="#user-name", text=name)
    page("fill", on="#password", text=password)
    page("press", key="Enter")


def serious_violations(page):
    return [found for found in page("audit") if found[1] in ("serious", "critical")]


def test_an_outdated_link_of_the_demo_says_so(page, live):
    page("open", url=live.operator_url.replace(PASSWORD, "of-an-earlier-demo"))
    page.wait_for_text("#login-error", "open the latest link of the demo")


def test_everybody_vents_and_only_an_operator_uses_the_controls(page, live):
    page.wait_for_visible("#hold-reason[data-code=logged_out]")
    assert page.evaluate(AUTOCOMPLETE) == ["username", "current-password"]
    assert serious_violations(page) == []
    live.rig.inflate(3.0)
    page("click", on="#vent-button")
    page.wait_for_visible(VENT_VERIFIED)
    log_in(page, VIEWER)
    page.wait_for_text("#logged-in-user", "bob, viewer")
    assert page.data("#hold-reason", "code") == page.data("#record-reason", "code") == "no_right"
    page.wait_for_text("#setpoint-reason", "bob is a viewer")
    live.rig.inflate(3.0)
    page("press", key="Alt+v")
    page.wait_for_visible(VENT_VERIFIED)
    page("click", on="#log-out-button")
    log_in(page)
    page.wait_for_text("#logged-in-user", "anna, operator")
    page("resize", **PHONE)
    assert serious_violations(page) == []
    page.wait_for_visible("#hold-reason[data-code=vent_due]")
    page("click", on="#vent-button")
    page("fill", on="#setpoint-input", text="4")
    page("click", on="#setpoint-button")
    page.wait_for_text("#setpoint-requested", "4.00 kPa")
    page("click", on="#hold-button")
    page("click", on="#confirm-yes")
    page.wait_for_state("holding")
    page("click", on="#log-out-button")
    page.wait_for_visible("#hold-reason[data-code=logged_out]")
    page.wait_for_visible("#log-in")
    assert page.is_hidden("#read-only")


def test_the_event_log_contains_the_user_of_each_write(page, live):
    log_in(page)
    page.wait_for_visible("#logged-in")
    page("fill", on="#limit-input", text="4.5")
    page("press", key="Enter")
    page.wait_for_visible("#result[data-code=limit_accepted]")
    page("click", on="#log-out-button")
    page.wait_for_text("#events", "logout")
    log = live.tables["events"]["file"]
    who = f"web {OPERATOR}@127.0.0.1"

    def kinds():
        shown = pneuforce("log", "show", "--file", log, "--json", "--last", "6").stdout.splitlines()
        records = [json.loads(line) for line in shown]
        return [each["kind"] for each in records if each.get("who") == who]

    wait_for(kinds, lambda found: found[-3:] == ["login", "write", "logout"])
    assert pneuforce("log", "verify", "--file", log).returncode == 0


def test_a_removed_user_becomes_read_only_and_can_still_vent(page, live):
    log_in(page)
    page.wait_for_visible("#logged-in")
    folder = Path(live.tables["web"]["users_file"]).parent
    users_file(folder, {VIEWER: USERS[VIEWER]})
    try:
        page.wait_for_text("#read-only", "READ-ONLY")
        assert page.data("#setpoint-reason", "code") == "login_ended"
        live.rig.inflate(3.0)
        page("click", on="#vent-button")
        page.wait_for_visible(VENT_VERIFIED)
        log_in(page)
        page.wait_for_text("#login-error", "wrong")
    finally:
        users_file(folder)


#: What the page shows after a login: "delayed", "logged in", or "" for neither.
DELAYED_OR_LOGGED_IN = """document.querySelector("#logged-in").checkVisibility() ? "logged in"
  : document.querySelector("#login-message").innerText.includes("again") ? "delayed" : "" """


def test_guesses_at_an_address_delay_a_new_browser_but_not_a_known_one(page, live):
    log_in(page)
    page.wait_for_visible("#logged-in")
    wrong = {"name": OPERATOR, "password": "wrong"}
    port = urlsplit(live.url).port
    begin_s = time.monotonic()
    assert {request(port, "POST", "/api/login", wrong)[0] for _ in range(MAX_ATTEMPTS + 1)} == {401, 429}
    page("click", on="#log-out-button")
    log_in(page)
    page.wait_for_visible("#logged-in")
    page("open", url=live.url)  # a new browser without a cookie
    page.wait_for_state("vented")
    log_in(page)
    shown = page.wait(DELAYED_OR_LOGGED_IN)
    assert shown == "delayed" or time.monotonic() > begin_s + ATTEMPT_PERIOD_S
    page.wait_for_visible("#logged-in")


#: Session of a user whose next answers are held: the body never arrives, or arrives after a login.
LATE_ANSWERS = """import("/static/session.js").then(async ({ Session }) => {
  const anna = { name: "anna", role: "operator", may_write: true };
  const send = window.fetch;
  const answers = [];
  window.fetch = async () => answers.shift()();
  try {
    const session = new Session(() => {});
    answers.push(() => Response.json({ user: anna, has_users: true }));
    await session.update();
    const fail = (stream) => stream.error(new DOMException("", "TimeoutError"));
    const unread = new ReadableStream({ start: fail });
    answers.push(() => new Response(unread));
    await session.update();
    const kept = [session.user?.name, session.hasUsers, session.isEnded];
    await (answers.push(() => Response.json({})), session.logOut());
    let answerLate;
    answers.push(() => Response.json(anna), () => new Promise((resolve) => (answerLate = resolve)));
    const logIn = session.logIn("anna", "secret");
    const update = session.update();
    await logIn;
    answerLate(Response.json({ user: null, has_users: true }));
    await update;
    return [kept, [session.user?.name, session.hasUsers, session.isEnded]];
  } finally {
    window.fetch = send;
  }
})"""


def test_an_answer_without_a_body_or_from_before_the_login_does_not_end_the_login(page):
    assert page.evaluate(LATE_ANSWERS) == [["anna", True, False]] * 2
