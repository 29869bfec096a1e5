"""A page and its instrument: one that a test speaks for, or a real one that a browser looks at."""

from contextlib import ExitStack
from dataclasses import dataclass, replace
from signal import SIGKILL

import pytest

from registers.map import COMMAND_KEY
from tests.page.browser import Browser
from tests.page.entries import begin
from tests.page.serving import Site, Station
from tests.system.waiting import wait_for
from teststand.children import Child
from teststand.rig import LiveRig
from teststand.stack import free_port, start, toml

TOKEN = "open-sesame-1"
DESK = {"width": 1280, "height": 800}


@dataclass
class Shown:
    """An instrument on a simulated rig whose hand rests, and the address of its page."""

    rig: LiveRig
    url: str
    stack: object
    tables: dict
    children: ExitStack

    @property
    def operators_url(self):
        """The address that logs an operator in."""
        return f"{self.url}#operator={TOKEN}"

    def recover(self):
        """Let go, vent, and clear what a test or a busy machine has tripped."""
        self.rig.release(wait=False)
        self.rig.vent()
        registers = self.rig.read()
        if registers["first_fault"]:
            self.rig.write("command_key", COMMAND_KEY)
            self.rig.write("command_code", "clear_faults")
            self.rig.write("command_sequence", registers["answer_sequence"] + 1)
            self.rig.wait_for(lambda now: not now["first_fault"])

    def kill(self):
        """End the instrument as a power cut would."""
        self.stack.host.send(SIGKILL)

    def start_again(self):
        """The instrument as it was configured, once more."""
        host = self.children.enter_context(
            Child("instrument", ["instrument", "run", "--config", "/dev/stdin"])
        )
        host.tell(toml(self.tables))
        host.ready()
        self.stack = replace(self.stack, host=host)
        self.rig = LiveRig(self.stack)


@pytest.fixture(scope="package")
def shown(tmp_path_factory, browser):
    """Begun after the browser, whose start keeps a machine busy."""
    folder = tmp_path_factory.mktemp("page")
    tables = {
        "rig": {"port": str(folder / "rig")},
        "modbus": {"port": free_port()},
        "can": {"enabled": False},
        "events": {"file": str(folder / "events.sqlite")},
        "local": {"socket": str(folder / "pneuforce.sock")},
        "page": {"enabled": True, "port": free_port(), "token": TOKEN},
    }
    with ExitStack() as children:
        stack = start(children, folder / "rig", ["--no-hand", "--seed", "1"], tables)
        url = f"http://127.0.0.1:{tables['page']['port']}/"
        shown = Shown(LiveRig(stack), url, stack, tables, children)
        browser("open", url=shown.operators_url)
        yield shown


@pytest.fixture(scope="package")
def browser():
    with Browser() as browser:
        yield browser


@pytest.fixture
def station(tmp_path):
    station = Station(tmp_path / "pneuforce.sock")
    yield station
    station.close()


@pytest.fixture
def site(station):
    site = Site(station.path)
    wait_for(lambda: station.wanted, bool)
    station.say(begin())
    yield site
    site.end()


@pytest.fixture
def page(shown, browser):
    """The page of an instrument that is vented, with the operator's token."""
    shown.recover()
    browser("look", **DESK)
    browser.wait_for_state("vented")
    return browser
