"""Fixtures: a web server with a fake instrument, and a browser with a real instrument on a simulated rig."""

from contextlib import ExitStack
from dataclasses import dataclass, replace
from math import nan
from signal import SIGKILL

import pytest

from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.rig import LiveRig
from pneuforce.teststand.stack import free_port, start, toml
from tests.system.waiting import wait_for
from tests.web.browser import Browser
from tests.web.entries import header
from tests.web.recovery import recover
from tests.web.serving import FakeInstrument, Site
from tests.web.shown_state import ShownState
from tests.web.users import OPERATOR, PASSWORD, users_file

LOGGED_IN_WITHIN_15_S = """new Promise((done) => {
  const until_ms = Date.now() + 15000;
  const check = () => {
    const isLoggedIn = document.querySelector("#logged-in").checkVisibility();
    return isLoggedIn || Date.now() > until_ms ? done(isLoggedIn) : setTimeout(check, 50);
  };
  check();
})"""
DESKTOP = {"width": 1280, "height": 800}


@dataclass
class LiveInstrument:
    """Instrument on a simulated rig without a moving hand, and the address of its web page."""

    rig: LiveRig
    url: str
    stack: object
    tables: dict
    children: ExitStack
    browser: Browser
    lower_limit_n: float = nan  #: lower limit of the force at the last press of a test of the plots

    @property
    def operator_url(self):
        """Return the address of the page that logs an operator in, as the demo prints it."""
        return f"{self.url}#user={OPERATOR}&password={PASSWORD}"

    def log_in(self):
        """Open the page until the operator is logged in.

        One attempt is not enough if the web server has not yet read the file of the users again.
        """

        def attempt():
            self.browser("open", url=self.operator_url)
            return self.browser.evaluate(LOGGED_IN_WITHIN_15_S)

        wait_for(attempt, bool, 60.0)

    def recover(self):
        """End a contact, vent, and clear faults that the previous test or a busy machine caused."""
        recover(self.rig)

    def kill(self):
        """Kill the instrument, which has the same effect as a power failure."""
        self.stack.host.send(SIGKILL)

    def restart(self):
        """Start the instrument again with the same configuration. This ends all logins."""
        host = self.children.enter_context(
            ChildProcess("instrument", ["pneuforce", "run", "--config", "/dev/stdin"])
        )
        host.write_stdin(toml(self.tables))
        host.ready()
        self.stack = replace(self.stack, host=host)
        self.rig = LiveRig(self.stack)


@pytest.fixture(scope="package")
def live(tmp_path_factory, browser):
    """Start an instrument. The browser starts first, because its start loads the machine."""
    folder = tmp_path_factory.mktemp("web")
    tables = {
        "rig": {"port": str(folder / "rig")},
        "modbus": {"port": free_port()},
        "can": {"enabled": False},
        "events": {"file": str(folder / "events.sqlite")},
        "local": {"socket": str(folder / "pneuforce.sock")},
        "web": {
            "enabled": True,
            "port": free_port(),
            "users_file": users_file(folder),
            "recordings": str(folder / "recordings"),
        },
    }
    with ExitStack() as children:
        stack = start(children, folder / "rig", ["--no-hand", "--seed", "1"], tables)
        url = f"http://127.0.0.1:{tables['web']['port']}/"
        live = LiveInstrument(LiveRig(stack), url, stack, tables, children, browser)
        live.log_in()
        yield live


@pytest.fixture(scope="package")
def browser():
    with Browser() as browser:
        yield browser


@pytest.fixture(scope="module")
def shown(tmp_path_factory, browser):
    shown = ShownState(tmp_path_factory.mktemp("shown") / "pneuforce.sock", browser)
    yield shown
    shown.close()


@pytest.fixture
def instrument(tmp_path):
    instrument = FakeInstrument(tmp_path / "pneuforce.sock")
    yield instrument
    instrument.close()


@pytest.fixture
def site(instrument):
    site = Site(instrument.path)
    wait_for(lambda: instrument.subscriptions, bool)
    instrument.send(header())
    yield site
    site.stop()


@pytest.fixture
def page(live, browser):
    """Return the browser with the web page of a vented instrument. The operator is logged in."""
    if not browser.evaluate("location.href").startswith(live.url):
        live.log_in()
    live.recover()
    browser("resize", **DESKTOP)
    browser.wait_for_state("vented")
    return browser
