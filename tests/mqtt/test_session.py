"""Tests of the messages of an edge node: births, deaths, sequence numbers, and the primary host."""

import json
import math

import pytest

from pneuforce.mqtt.payload import encode_metrics
from pneuforce.mqtt.session import EdgeSession, metrics_of
from pneuforce.mqtt.topics import SparkplugTopics, host_topic
from pneuforce.registers.map import BY_NAME
from pneuforce.registers.sparkplug import METRICS, unavailable_values, values_of
from tests.mqtt.sparkplug import decoded, summary
from tests.web.entries import real_snapshot

TOPICS = SparkplugTopics("group", "node", "device")
HEADER = {"version": "1.2"}
SNAPSHOT = real_snapshot()[1]
VALUES = values_of({"header": HEADER, "snapshot": SNAPSHOT})


def values(**changes):
    return values_of({"header": HEADER, "snapshot": SNAPSHOT | changes})


def test_births_have_all_metrics_and_will_and_birth_the_same_number():
    session = EdgeSession(TOPICS, 7)
    will = session.death(5)
    node, device = session.birth(VALUES, None, 5)
    assert [m.topic for m in (will, node, device)] == [
        "spBv1.0/group/NDEATH/node",
        "spBv1.0/group/NBIRTH/node",
        "spBv1.0/group/DBIRTH/node/device",
    ]
    assert (will.qos, node.qos, device.qos) == (1, 0, 0)
    message, node_values = decoded(node.payload)
    assert decoded(will.payload)[1] == {"bdSeq": 7}
    assert not decoded(will.payload)[0].HasField("seq")
    assert (message.seq, node_values["bdSeq"]) == (0, 7)
    assert node_values.keys() == {"bdSeq", "Node Control/Rebirth", "Vent", "Vent Result"}
    assert decoded(device.payload)[1].keys() == {"Vent", *(metric.name for metric in METRICS)}


def test_the_birth_states_unit_range_and_meaning_of_the_register_map():
    message, _ = decoded(EdgeSession(TOPICS, 0).device_birth(VALUES, 5)[0].payload)
    force = message.metrics[0]
    properties = {k: v.string_value or v.double_value for k, v in zip(*columns(force), strict=True)}
    register = BY_NAME["force"]
    expected = {"engUnit": "N", "engLow": -20, "engHigh": 20, "documentation": register.doc}
    assert (force.name, properties) == ("force", expected)


def columns(metric):
    return metric.properties.keys, metric.properties.values


def test_sequence_numbers_continue_through_all_messages_and_wrap_to_0():
    session = EdgeSession(TOPICS, 0)
    messages = session.birth(VALUES, None, 5)
    messages += [
        session.vent_result("accepted", 6),
        *session.device_death(7),
        *session.device_birth(VALUES, 8),
    ]
    messages += [session.data(b"", 9) for _ in range(252)]
    assert [seq for _, seq in summary(messages)] == [*range(256), 0]
    assert summary(session.birth(VALUES, None, 9))[0] == ("NBIRTH", 0)


def test_a_dead_device_dies_only_once():
    session = EdgeSession(TOPICS, 0)
    assert session.device_death(1) == []
    session.birth(VALUES, None, 1)
    assert [name for name, _ in summary(session.device_death(2))] == ["DDEATH"]
    assert session.device_death(3) == []


INVALID = [
    pytest.param({"force_n": None}, id="no force"),
    pytest.param({"force_std_n": None}, id="no uncertainty"),
    pytest.param({"force_n": math.nan}, id="NaN"),
    pytest.param({"force_n": math.inf}, id="infinity"),
    pytest.param({"force_n": "1.5"}, id="text"),
    pytest.param({"force_n": True}, id="boolean"),
    pytest.param({"status": ["holding"]}, id="not valid"),
    pytest.param({"status": None}, id="no status"),
]


@pytest.mark.parametrize("changes", INVALID)
def test_a_force_that_is_not_valid_is_null_with_its_uncertainty(changes):
    found = decoded(encode_metrics(metrics_of(values(**changes), 5)))[1]
    assert (found["force"], found["force_uncertainty"], found["force_valid"]) == (None, None, False)


def test_an_unreachable_instrument_has_no_values():
    found = decoded(encode_metrics(metrics_of(unavailable_values(), 5)))[1]
    assert found.pop("force_valid") is False
    assert set(found.values()) == {None}


def test_a_fault_is_shown_with_its_code_and_in_words():
    assert values(first_out_fault=1)["first_out_fault_text"].startswith("The pressure sensor is open")
    assert values(first_out_fault=250)["first_out_fault_text"] == "unknown fault 250"


STATES = [
    ({"online": True, "timestamp": 10}, True),
    ({"online": False, "timestamp": 5}, True),  # older
    ({"online": False, "timestamp": 10}, False),
    ({"online": 1, "timestamp": 20}, False),
    ([], False),
    ({"online": True}, False),
]


def test_an_older_or_invalid_state_of_the_host_is_ignored():
    session = EdgeSession(TOPICS, 0, "scada")
    assert (session.host_online, host_topic("scada")) == (False, "spBv1.0/STATE/scada")
    for state, online in STATES:
        session.on_host_state(json.dumps(state).encode())
        assert session.host_online is online
    session.on_host_state(b"OFFLINE")
    session.on_host_state(b"[" * 100_000)
    assert session.host_online is False
