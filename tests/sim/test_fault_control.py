"""Tests of fault injection into a running simulator by control port and by command, with a real host."""

import asyncio
import json
import os
import time
from contextlib import closing
from pathlib import Path

import pytest

from pneuforce.errors import RigNotResponding
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.service.host.host import Host as InstrumentHost
from pneuforce.protocol.frames import Fault, Identify
from pneuforce.sim.faults import CATALOGUE, SimulatorRequestError
from pneuforce.sim.faults.document import markdown, updated
from pneuforce.sim.hand import Hand
from pneuforce.sim.plants.published import PublishedPlant
from pneuforce.sim.rig import Rig
from pneuforce.sim.server.control_requests import REQUESTS, execute_request
from pneuforce.sim.world import World
from tests.command_runner import pneuforce
from tests.sim.server.test_sim_server import ControlClient, MinimalHost, simulator

DOCUMENT = (Path(__file__).parents[2] / "docs" / "simulator.md").read_text(encoding="utf-8")
TIMEOUT_S = 15.0


@pytest.fixture
def rig(tmp_path):
    with simulator(tmp_path / "rig", hand=False) as (_, ready):
        yield ready


@pytest.fixture
def control(rig):
    with closing(ControlClient(rig["control"])) as control:
        yield control


def active_faults(control):
    control.send({"faults": True})
    return control.read()["faults"]


# faults injected through the control port


def test_a_fault_is_injected_listed_detected_by_the_board_and_removed(rig, control):
    host = MinimalHost(rig["link"])
    host.send(Identify())
    assert host.run(2, lambda: host.samples)
    assert active_faults(control) == []
    control.send({"fault": {"name": "supply_low", "mv": 4100}})
    assert host.run(2, lambda: host.samples[-1].message.fault == Fault.SUPPLY_VOLTAGE)
    assert host.samples[-1].message.supply_mv == 4100
    assert active_faults(control) == [{"name": "supply_low", "mv": 4100}]
    control.send({"fault": {"name": "supply_low", "on": False}})
    assert active_faults(control) == []
    assert host.run(2, lambda: host.samples[-1].message.supply_mv == 5000)
    host.port.close()


@pytest.mark.parametrize(
    ("fault", "facts"),
    [
        ({}, ["fault", '"name"']),
        ("leak", ["fault", '"name"']),
        ({"name": 1}, ["fault", '"name"']),
        ({"name": "leak", "on": 0}, ["fault", '"name"']),
        ({"name": "gremlin"}, ["'gremlin'", "pneuforce sim fault --list"]),
        ({"name": "gremlin", "on": False}, ["'gremlin'", "pneuforce sim fault --list"]),
        ({"name": "leak", "on": False}, ["leak was not active", "no fault"]),
        ({"name": "leak", "colour": 1}, ["leak takes kpa_per_s", "'colour'"]),
        ({"name": "leak", "kpa_per_s": "1"}, ["kpa_per_s of leak", "0 to 5 kPa/s at 8 kPa"]),
        ({"name": "leak", "kpa_per_s": float("nan")}, ["kpa_per_s of leak", "0 to 5"]),
        ({"name": "leak", "kpa_per_s": 10**400}, ["kpa_per_s of leak", "0 to 5"]),
        ({"name": "burst", "n": 1}, ["burst takes no arguments", "'n'"]),
    ],
)
def test_an_invalid_fault_is_rejected_with_the_reason(fault, facts):
    world = World(Rig(PublishedPlant(), Hand(False)))
    with pytest.raises(SimulatorRequestError) as error:
        execute_request(world, "fault", fault)
    assert all(fact in str(error.value) for fact in facts)
    assert execute_request(world, "faults", True) == {"faults": []}


def test_a_rejected_request_is_answered_and_so_is_the_next_request(control):
    control.send({"fault": {"name": "gremlin"}})
    assert control.read()["error"].startswith("there is no fault 'gremlin'")
    assert active_faults(control) == []


# an unplugged cable and a real host


async def until(condition):
    deadline_s = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < deadline_s, "the condition did not become true in time"
        await asyncio.sleep(0.01)


def test_an_unplugged_cable_removes_the_symlink_and_the_host_finds_the_port_under_another_name(rig, control):
    async def unplug_and_plug_in():
        host, stop = InstrumentHost(Session(Instrument(Settings())), rig["link"]), asyncio.Event()
        await host.connect(stop)
        running = asyncio.create_task(host.run(stop))
        await until(lambda: host.instrument.sample_counter > 100)
        control.send({"fault": {"name": "cable_pulled"}})
        await until(lambda: host.instrument.link_lost(time.monotonic()))
        assert not os.path.lexists(rig["link"])
        control.send({"fault": {"name": "cable_pulled", "on": False}})
        await until(lambda: not host.instrument.link_lost(time.monotonic()))
        assert os.readlink(rig["link"]) != rig["port"]
        assert host.reconnects == 1
        stop.set()
        await running

    asyncio.run(unplug_and_plug_in())


def test_another_device_on_the_port_is_reported_as_another_device(rig, control, monkeypatch):
    monkeypatch.setattr("pneuforce.instrument.service.host.host.HANDSHAKE_S", 1.0)
    control.send({"fault": {"name": "other_device"}})
    assert active_faults(control) == [{"name": "other_device"}]
    host = InstrumentHost(Session(Instrument(Settings())), rig["link"])
    with pytest.raises(RigNotResponding, match="is another device connected to that port"):
        asyncio.run(host.connect(asyncio.Event()))


# faults injected with the command


@pytest.fixture(scope="module")
def module_rig(tmp_path_factory):
    with simulator(tmp_path_factory.mktemp("simulator") / "rig", hand=False) as (_, ready):
        yield ready


@pytest.fixture
def healthy_rig(module_rig):
    """Yield a simulator without faults, and remove all faults afterwards."""
    yield module_rig
    with closing(ControlClient(module_rig["control"])) as control:
        for fault in active_faults(control):
            control.send({"fault": {"name": fault["name"], "on": False}})
        assert active_faults(control) == []


@pytest.fixture
def healthy_control(healthy_rig):
    with closing(ControlClient(healthy_rig["control"])) as control:
        yield control


def pneuforce_fault(*arguments):
    return pneuforce("sim", "fault", *arguments)


def test_the_command_injects_lists_and_removes_a_fault(healthy_rig, healthy_control):
    port = ("--control", healthy_rig["control"])
    assert pneuforce_fault("leak", "kpa-per-s=0.02", *port).stdout == "leak kpa_per_s=0.02\n"
    assert active_faults(healthy_control) == [{"name": "leak", "kpa_per_s": 0.02}]
    assert json.loads(pneuforce_fault(*port, "--json").stdout)["active"] == [
        {"name": "leak", "kpa_per_s": 0.02}
    ]
    assert pneuforce_fault("leak", "--off", *port).stdout == "no fault is active\n"
    assert active_faults(healthy_control) == []


def test_the_file_with_the_control_port_exists_while_the_simulator_runs(tmp_path):
    with simulator(tmp_path / "rig", hand=False) as (_, ready):
        assert (tmp_path / "rig.control").read_text() == f"{ready['control']}\n"
    assert list(tmp_path.iterdir()) == []


def test_the_command_finds_a_simulator_by_the_link_to_its_port(healthy_rig):
    by_link = ("--link", healthy_rig["link"])
    assert pneuforce_fault("leak", *by_link).stdout == "leak kpa_per_s=0.05\n"
    assert pneuforce_fault("leak", "--off", *by_link).stdout == "no fault is active\n"


@pytest.mark.parametrize(
    ("arguments", "facts"),
    [
        (("leak", "--link", "/nowhere/rig"), ["no simulator", "/nowhere/rig"]),
        (("leak", "--control", "1"), ["no simulator", "control port 1"]),
        (("leak", "much", "--control", "1"), ["much", "name=number"]),
    ],
)
def test_an_error_of_the_command_is_one_line(arguments, facts):
    done = pneuforce_fault(*arguments)
    assert done.returncode == (69 if "no simulator" in facts else 2)
    assert done.stderr.startswith("pneuforce: ")
    assert all(fact in done.stderr for fact in facts)
    assert len(done.stderr.splitlines()) == 1


def test_the_command_prints_the_reason_if_the_simulator_rejects_a_request(healthy_rig):
    done = pneuforce_fault("leak", "kpa_per_s=99", "--control", healthy_rig["control"])
    assert done.returncode == 2
    assert done.stderr.startswith("pneuforce: kpa_per_s of leak")
    assert "0 to 5 kPa/s at 8 kPa" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "facts"),
    [
        (("leak", "--off"), ["leak", "supply_low mv=4600"]),
        (("leek",), ["'leek' (similar: leak)", "pneuforce sim fault --list"]),
        (("leek", "--off"), ["'leek' (similar: leak)", "pneuforce sim fault --list"]),
        (("--off",), ["--off", "name of one fault"]),
        (("supply_low", "mv=4600", "--off"), ["--off", "name of one fault"]),
    ],
)
def test_an_invalid_name_or_a_removal_of_an_inactive_fault_is_an_error(
    healthy_rig, healthy_control, arguments, facts
):
    healthy_control.send({"fault": {"name": "supply_low"}})
    done = pneuforce_fault(*arguments, "--link", healthy_rig["link"])
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("pneuforce: ")
    assert all(fact in done.stderr for fact in facts)
    assert len(done.stderr.splitlines()) == 1
    assert active_faults(healthy_control) == [{"name": "supply_low", "mv": 4600}]


def test_the_list_has_every_fault():
    listed = json.loads(pneuforce_fault("--list", "--json").stdout)["faults"]
    assert [fault["name"] for fault in listed] == list(CATALOGUE)
    table = pneuforce_fault("--list").stdout
    assert all(name in table for name in CATALOGUE)


# faults in the document


def test_the_catalogue_in_the_document_is_the_generated_table():
    assert markdown() in DOCUMENT
    assert updated(DOCUMENT) == DOCUMENT


def test_the_document_names_every_key_of_the_control_port():
    assert [key for key in ("truth", *REQUESTS) if f'`{{"{key}": ' not in DOCUMENT] == []
