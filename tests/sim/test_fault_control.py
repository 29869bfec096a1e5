"""Faults put into a running simulator, by control port and by command, and what a real host makes of them."""

import asyncio
import json
import os
import re
import time
from contextlib import closing
from pathlib import Path

import pytest

from instrument.core import Instrument
from instrument.coupling import Coupling
from instrument.errors import RigSilent
from instrument.host import Host as Instrumentalist
from instrument.rig.frames import Fault, Identify
from instrument.settings import Settings
from sim.faults import CATALOGUE, Refused
from sim.faults.document import markdown, renewed
from sim.hand import Hand
from sim.orders import ORDERS, obey
from sim.published import PublishedPlant
from sim.rig import Rig
from sim.world import World
from tests.sim.test_sim_server import Control, Host, simulator
from tests.typed import pneuforce

DOCUMENT = (Path(__file__).parents[2] / "docs" / "simulator.md").read_text(encoding="utf-8")
PATIENCE_S = 15.0


@pytest.fixture
def rig(tmp_path):
    with simulator(tmp_path / "rig", hand=False) as (_, told):
        yield told


@pytest.fixture
def control(rig):
    with closing(Control(rig["control"])) as control:
        yield control


def present(control):
    control.ask({"faults": True})
    return control.line()["faults"]


def eventually(fact):
    deadline_s = time.monotonic() + PATIENCE_S
    while not fact():
        assert time.monotonic() < deadline_s, "what was waited for did not come"
        time.sleep(0.005)


# the control port


def test_a_fault_is_put_in_listed_seen_by_the_board_and_taken_out(rig, control):
    host = Host(rig["link"])
    host.send(Identify())
    assert host.run(2, lambda: host.samples)
    assert present(control) == []
    control.ask({"fault": {"name": "supply_low", "mv": 4100}})
    assert host.run(2, lambda: host.samples[-1].message.fault == Fault.SUPPLY_VOLTAGE)
    assert host.samples[-1].message.supply_mv == 4100
    assert present(control) == [{"name": "supply_low", "mv": 4100}]
    control.ask({"fault": {"name": "supply_low", "on": False}})
    assert present(control) == []
    assert host.run(2, lambda: host.samples[-1].message.supply_mv == 5000)
    host.port.close()


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ({}, 'fault expects an object with "name"'),
        ("leak", 'fault expects an object with "name"'),
        ({"name": 1}, 'fault expects an object with "name"'),
        ({"name": "leak", "on": 0}, 'fault expects an object with "name"'),
        ({"name": "gremlin"}, "there is no fault 'gremlin'; pneuforce fault --list shows all"),
        ({"name": "gremlin", "on": False}, "there is no fault 'gremlin'; pneuforce fault --list shows all"),
        ({"name": "leak", "colour": 1}, "leak takes kpa_per_s, not 'colour'"),
        ({"name": "leak", "kpa_per_s": "1"}, "kpa_per_s of leak is a number from 0 to 5 kPa/s at 8 kPa"),
        ({"name": "leak", "kpa_per_s": float("nan")}, "kpa_per_s of leak is a number from 0 to 5"),
        ({"name": "leak", "kpa_per_s": 10**400}, "kpa_per_s of leak is a number from 0 to 5"),
        ({"name": "burst", "n": 1}, "burst takes no arguments, not 'n'"),
    ],
)
def test_a_fault_that_cannot_be_is_refused_with_a_sentence(fault, said):
    world = World(Rig(PublishedPlant(), Hand(False)))
    with pytest.raises(Refused, match=f"^{re.escape(said)}"):
        obey(world, "fault", fault)
    assert obey(world, "faults", True) == {"faults": []}


def test_a_refusal_is_answered_and_the_next_request_too(control):
    control.ask({"fault": {"name": "gremlin"}})
    assert control.line()["error"].startswith("there is no fault 'gremlin'")
    assert present(control) == []


# a pulled cable and a real host


async def until(condition):
    deadline_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline_s, "what was waited for did not come"
        await asyncio.sleep(0.01)


def test_a_cable_that_is_pulled_takes_its_link_and_the_host_finds_it_under_another_name(rig, control):
    async def story():
        host, stop = Instrumentalist(Coupling(Instrument(Settings())), rig["link"]), asyncio.Event()
        await host.connect(stop)
        running = asyncio.create_task(host.run(stop))
        await until(lambda: host.instrument.sample_counter > 100)
        control.ask({"fault": {"name": "cable_pulled"}})
        await until(lambda: host.instrument.link_lost(time.monotonic()))
        assert not os.path.lexists(rig["link"])
        control.ask({"fault": {"name": "cable_pulled", "on": False}})
        await until(lambda: not host.instrument.link_lost(time.monotonic()))
        assert os.readlink(rig["link"]) != rig["port"]
        assert host.reconnects == 1
        stop.set()
        await running

    asyncio.run(story())


def test_another_device_on_the_port_is_refused_in_a_sentence_that_says_so(rig, control, monkeypatch):
    monkeypatch.setattr("instrument.host.GREETING_S", 1.0)
    control.ask({"fault": {"name": "other_device"}})
    host = Instrumentalist(Coupling(Instrument(Settings())), rig["link"])
    with pytest.raises(RigSilent, match="none of them a pneuforce board's: is another device on that port"):
        asyncio.run(host.connect(asyncio.Event()))


# the command


@pytest.fixture(scope="module")
def lasting_rig(tmp_path_factory):
    with simulator(tmp_path_factory.mktemp("simulator") / "rig", hand=False) as (_, told):
        yield told


@pytest.fixture
def sound_rig(lasting_rig):
    """Without faults, before and after."""
    yield lasting_rig
    with closing(Control(lasting_rig["control"])) as control:
        for fault in present(control):
            control.ask({"fault": {"name": fault["name"], "on": False}})
        assert present(control) == []


@pytest.fixture
def sound_control(sound_rig):
    with closing(Control(sound_rig["control"])) as control:
        yield control


def pneuforce_fault(*arguments):
    return pneuforce("fault", *arguments)


def test_the_command_puts_in_lists_and_takes_out(sound_rig, sound_control):
    port = ("--control", sound_rig["control"])
    assert pneuforce_fault("leak", "kpa-per-s=0.02", *port).stdout == "leak kpa_per_s=0.02\n"
    assert present(sound_control) == [{"name": "leak", "kpa_per_s": 0.02}]
    assert json.loads(pneuforce_fault(*port, "--json").stdout) == [{"name": "leak", "kpa_per_s": 0.02}]
    assert pneuforce_fault("leak", "--off", *port).stdout == "no fault is in\n"
    assert present(sound_control) == []


def test_the_control_port_stands_beside_the_link_while_the_simulator_runs(tmp_path):
    with simulator(tmp_path / "rig", hand=False) as (_, told):
        assert (tmp_path / "rig.control").read_text() == f"{told['control']}\n"
    assert list(tmp_path.iterdir()) == []


def test_the_command_finds_a_simulator_by_the_link_to_its_port(sound_rig):
    beside = ("--link", sound_rig["link"])
    assert pneuforce_fault("leak", *beside).stdout == "leak kpa_per_s=0.05\n"
    assert pneuforce_fault("leak", "--off", *beside).stdout == "no fault is in\n"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("leak", "--link", "/nowhere/rig"), "no simulator has its port at /nowhere/rig"),
        (("leak", "--control", "1"), "no simulator answers on control port 1"),
        (("leak", "much", "--control", "1"), "much: an argument is name=number, as kpa_per_s=0.02"),
    ],
)
def test_what_the_command_cannot_do_is_one_sentence(arguments, said):
    done = pneuforce_fault(*arguments)
    assert done.returncode == 2
    assert done.stderr.startswith(f"pneuforce: {said}")
    assert len(done.stderr.splitlines()) == 1


def test_what_the_simulator_refuses_the_command_says(sound_rig):
    done = pneuforce_fault("leak", "kpa_per_s=99", "--control", sound_rig["control"])
    assert (done.returncode, done.stderr) == (
        2,
        "pneuforce: kpa_per_s of leak is a number from 0 to 5 kPa/s at 8 kPa\n",
    )


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("leak", "--off"), "leak was not in: supply_low mv=4600"),
        (("leek",), "there is no fault 'leek' (near: leak); pneuforce fault --list shows all"),
        (("leek", "--off"), "there is no fault 'leek' (near: leak); pneuforce fault --list shows all"),
        (("--off",), "--off takes the name of one fault alone, as pneuforce fault leak --off"),
        (
            ("supply_low", "mv=4600", "--off"),
            "--off takes the name of one fault alone, as pneuforce fault leak",
        ),
    ],
)
def test_taking_out_what_is_not_in_is_an_error_that_says_what_is(sound_rig, sound_control, arguments, said):
    sound_control.ask({"fault": {"name": "supply_low"}})
    done = pneuforce_fault(*arguments, "--link", sound_rig["link"])
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"pneuforce: {said}")
    assert len(done.stderr.splitlines()) == 1
    assert present(sound_control) == [{"name": "supply_low", "mv": 4600}]


def test_the_list_has_every_fault():
    listed = json.loads(pneuforce_fault("--list", "--json").stdout)
    assert [fault["name"] for fault in listed] == list(CATALOGUE)
    table = pneuforce_fault("--list").stdout
    assert all(name in table for name in CATALOGUE)


# the document


def test_the_catalogue_in_the_document_is_that_of_the_code():
    assert markdown() in DOCUMENT
    assert renewed(DOCUMENT) == DOCUMENT


def test_the_document_names_every_key_of_the_control_port():
    assert [key for key in ("truth", *ORDERS) if f'`{{"{key}": ' not in DOCUMENT] == []
