"""Tests of the MQTT process with Mosquitto and with a host application that uses other libraries."""

import json
import time
from contextlib import ExitStack, closing
from itertools import count

import pytest
from paho.mqtt import publish

from pneuforce.registers.sparkplug import METRICS
from tests.mqtt.site import Broker, Edge, FedInstrument, HostApplication, eventually, values_in
from tests.peers.clients.client import NEEDS_NODE
from tests.registers.modbus_security.serving import Pki
from tests.tools import needs

pytestmark = [needs("mosquitto", "/usr/sbin/mosquitto"), NEEDS_NODE]
HUGE_BYTES = 100_000_000
TRUE = {"type": "Boolean", "value": True}
numbers = count()


@pytest.fixture(scope="module")
def broker(tmp_path_factory):
    broker = Broker(tmp_path_factory.mktemp("broker"), "allow_anonymous true")
    yield broker
    broker.kill()


@pytest.fixture(scope="module")
def host(broker):
    with closing(HostApplication(broker.port)) as host:
        yield host


@pytest.fixture
def instrument(tmp_path):
    instrument = FedInstrument(tmp_path / "socket")
    yield instrument
    if instrument.running:
        instrument.close()


@pytest.fixture
def start(broker, instrument):
    """Return a function that starts the MQTT process of the instrument with an edge node of its own."""
    with ExitStack() as processes:

        def start(**options):
            port = options.pop("port", broker.port)
            edge = Edge(instrument.path, port, f"node{next(numbers)}", **options)
            return processes.enter_context(closing(edge))

        yield start


def test_a_host_reads_births_values_and_deaths(start, host, instrument, tmp_path):
    edge = start()
    node, device = host.next("NBIRTH", edge.node), host.next("DBIRTH", edge.node)
    assert (node["seq"], device["seq"]) == (0, 1)
    found = {metric["name"]: metric for metric in device["metrics"]}
    assert found.keys() == {"Vent", *(metric.name for metric in METRICS)}
    assert (found["force"]["type"], found["force"]["value"]) == ("Float", 0.0)
    assert found["status"]["value"] == 0x8004
    assert set(found["pressure"]["properties"]) == {"engUnit", "engLow", "engHigh", "documentation"}
    assert abs(found["force"]["utc_ms"] / 1e3 - time.time()) < 10
    instrument.changes = {"force_n": None, "status": ["failure"], "first_out_fault": 34, "state": "tripped"}
    # before it, stored values can arrive, if the instrument was reached before the broker
    message = host.next("DDATA", edge.node, lambda m: values_in(m).get("state") == "tripped")
    tripped = values_in(message)
    assert (tripped["force"], tripped["force_uncertainty"], tripped["force_valid"]) == (None, None, False)
    assert (tripped["state"], tripped["first_out_fault"]) == ("tripped", 34)
    instrument.close()
    host.next("DDEATH", edge.node)
    again = FedInstrument(tmp_path / "socket")
    with closing(again):
        host.next("DBIRTH", edge.node)
        assert edge.end() == 0
        death = host.next("NDEATH", edge.node)
    assert values_in(death)["bdSeq"] == values_in(node)["bdSeq"]
    data = [m["seq"] for m in host.messages if m.get("node") == edge.node and m["kind"] != "NDEATH"]
    assert data == [number % 256 for number in range(len(data))]


def test_only_a_vent_is_executed_and_answered(start, host, instrument):
    edge = start()
    host.next("DBIRTH", edge.node)
    command = edge.topic.format("DCMD") + "/sensor"
    host.publish(command, metrics=[{"name": "Vent", **TRUE}])
    assert values_in(host.next("NDATA", edge.node)) == {"Vent Result": "accepted"}
    instrument.reject_reason = "state"
    host.publish(edge.topic.format("NCMD"), metrics=[{"name": "Vent", **TRUE}])
    assert values_in(host.next("NDATA", edge.node)) == {"Vent Result": "rejected: state"}
    assert instrument.requests == [{"mode": "vent"}] * 2
    for content in (
        {"metrics": [{"name": "setpoint", "type": "Float", "value": 5.0}]},
        {"metrics": [{"name": "Vent", "type": "Float", "value": 1.0}]},
        {"hex": "ff" * 40},
    ):
        host.publish(command, **content)
    edge.logged("a write of setpoint is rejected")
    edge.logged("must be the Boolean true")
    edge.logged("40 bytes are no payload")
    host.publish(command, metrics=[{"name": "Node Control/Rebirth", **TRUE}])
    assert host.next("NBIRTH", edge.node)["seq"] == 0
    assert values_in(host.next("DBIRTH", edge.node))["force_valid"] is True
    assert len(instrument.requests) == 2


def test_a_retained_vent_is_not_executed(start, host, instrument):
    topic = f"spBv1.0/group/NCMD/node{next(numbers) + 1}"
    host.publish(topic, metrics=[{"name": "Vent", **TRUE}], retain=True)
    host.next("NCMD")
    edge = start()
    assert topic == edge.topic.format("NCMD")
    edge.logged("retained")
    assert instrument.requests == []


def test_the_broker_publishes_the_death_of_a_killed_process(start, host):
    edge = start()
    birth = host.next("NBIRTH", edge.node)
    edge.process.kill()
    assert values_in(host.next("NDEATH", edge.node)) == {"bdSeq": values_in(birth)["bdSeq"]}


@pytest.mark.parametrize("wait_s", [0.0, 0.02, 0.05])
def test_an_end_while_the_connection_is_opened_writes_no_traceback(broker, tmp_path, wait_s):
    with closing(Edge(tmp_path / "none.sock", broker.port, "early")) as edge:
        assert edge.process.stdout.readline()
        time.sleep(wait_s)
        assert edge.end() == 0
        assert [line for line in edge.log if not line.startswith("MQTT: ")] == []


def test_a_huge_message_ends_only_the_connection(start, broker, host):
    edge = start()
    host.next("DBIRTH", edge.node)
    publish.single(edge.topic.format("NCMD"), bytes(HUGE_BYTES), port=broker.port)
    edge.logged("no connection")
    host.next("DBIRTH", edge.node)
    assert edge.process.poll() is None


def contacts(messages, node):
    """Return the number of contacts in each metric of the data messages, and its time."""
    data = [
        m
        for each in messages
        if each["kind"] in ("DDATA", "DBIRTH") and each["node"] == node
        for m in each["metrics"]
    ]
    return [(m["value"], m["utc_ms"], m["historical"]) for m in data if m["name"] == "contact_counter"]


def test_no_value_is_lost_when_the_broker_is_killed(instrument, tmp_path):
    broker = Broker(tmp_path, "allow_anonymous true")
    with (
        closing(HostApplication(broker.port)) as host,
        closing(Edge(instrument.path, broker.port, "killed", store=str(tmp_path / "store.sqlite"))) as edge,
    ):
        host.next("DBIRTH")
        host.next("DDATA", condition=lambda m: values_in(m).get("contact_counter", 0) > 20)
        broker.kill()
        missed = instrument.number
        eventually(lambda: instrument.number > missed + 40)
        broker.start()
        host.next("connected")
        host.next("DDATA", condition=lambda m: any(each["historical"] for each in m["metrics"]))
        last = instrument.number
        host.next("DDATA", condition=lambda m: values_in(m).get("contact_counter", 0) > last + 5)
        broker.kill()
        edge.logged("stored records to send")
        found = contacts(host.messages, "killed")
    stored = [(value, utc_ms) for value, utc_ms, historical in found if historical]
    assert stored == sorted(stored)  # in order
    values = {value for value, _, _ in found}
    assert values >= set(range(min(values), last))  # without gaps
    assert len(stored) >= 40


def test_values_are_stored_while_the_primary_host_is_offline(start, host, instrument, tmp_path):
    def set_state(online):
        state = {"online": online, "timestamp": round(time.time() * 1e3)}
        host.publish("spBv1.0/STATE/scada", text=json.dumps(state), retain=True)

    set_state(True)
    edge = start(primary_host="scada", store=str(tmp_path / "store.sqlite"))
    host.next("DBIRTH", edge.node)
    set_state(False)
    host.next("NDEATH", edge.node)
    missed = instrument.number
    eventually(lambda: instrument.number > missed + 20)
    set_state(True)
    host.next("DDATA", edge.node, lambda m: any(each["historical"] for each in m["metrics"]))
    last = instrument.number
    host.next("DDATA", edge.node, lambda m: values_in(m).get("contact_counter", 0) > last)
    values = {value for value, _, _ in contacts(host.messages, edge.node)}
    assert values >= set(range(min(values), last))


def test_tls_needs_the_right_certificates(instrument, tmp_path):
    pki, other = Pki(tmp_path / "pki"), Pki(tmp_path / "other")
    pki.client("edge", "viewer")
    (tmp_path / "password").write_text("secret-12345\n")
    own = {"certificate": str(pki.folder / "edge.pem"), "key": str(pki.folder / "edge.key")}
    own |= {"user": "edge", "password_file": str(tmp_path / "password"), "tls": True}
    broker = Broker(
        tmp_path,
        f"cafile {pki.folder / 'ca.pem'}",
        f"certfile {pki.folder / 'instrument.pem'}",
        f"keyfile {pki.folder / 'instrument.key'}",
        "require_certificate true",
        "allow_anonymous true",
    )
    with ExitStack() as processes:
        processes.callback(broker.kill)

        def start(node, authority, **options):
            edge = Edge(instrument.path, broker.port, node, ca=str(authority.folder / "ca.pem"), **options)
            return processes.enter_context(closing(edge))

        trusted, distrustful = start("a", pki, **own), start("b", other, **own)
        unknown = start("c", pki, tls=True)
        eventually(lambda: json.loads(trusted.process.stdout.readline()).get("connected"))
        distrustful.logged("certificate verify failed")
        unknown.logged("rejects the client certificate")
        assert "secret" not in "".join(distrustful.log)
