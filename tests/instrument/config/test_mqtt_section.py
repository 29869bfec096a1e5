"""Tests of the section for MQTT: what stops the start, and the names that follow from other keys."""

import socket

import pytest

from pneuforce.errors import ConfigurationFileError
from pneuforce.instrument.config import parse
from pneuforce.instrument.service.checks.instruments_on_one_host import check_instruments
from pneuforce.instrument.service.checks.start_checks import load_checked
from pneuforce.instrument.service.processes.mqtt_process import edge_node_of, mqtt_process_of
from pneuforce.support.broker_url import BrokerAddress, broker_address

ENABLED = "[mqtt]\nenabled = true\n"
REJECTED = [
    ("mqtt.broker", 'broker = "broker.local"\n'),
    ("mqtt.broker", 'broker = "http://broker.local"\n'),
    ("mqtt.broker", 'broker = "mqtt://user:secret@broker.local"\n'),
    ("mqtt.broker", 'broker = "mqtt://broker.local:70000"\n'),
    ("mqtt.broker", 'broker = "mqtt://broker.local/path"\n'),
    ("mqtt.group", 'group = "a/b"\n'),
    ("mqtt.group", 'group = ""\n'),
    ("mqtt.edge_node", 'edge_node = "+"\n'),
    ("mqtt.device", 'device = "#"\n'),
    ("mqtt.primary_host", 'primary_host = "a\\u0000"\n'),
    ("mqtt.period_s", "period_s = 0\n"),
    ("certificate and key", 'broker = "mqtts://b"\ncertificate = "c.pem"\n'),
    ("mqtts", 'ca = "ca.pem"\n'),
    ("absent.pem", 'broker = "mqtts://b"\nca = "absent.pem"\n'),
    ("empty.pem", 'broker = "mqtts://b"\nca = "empty.pem"\n'),
    ("empty.pem", 'broker = "mqtts://b"\ncertificate = "empty.pem"\nkey = "empty.pem"\n'),
    ("user", 'password_file = "empty.pem"\n'),
    ("absent.txt", 'user = "a"\npassword_file = "absent.txt"\n'),
    ("local.socket", '[local]\nsocket = ""\n'),
    ("mqtt.store", 'store = "events.sqlite"\n'),
]


@pytest.mark.parametrize(("words", "text"), REJECTED, ids=range(len(REJECTED)))
def test_settings_that_cannot_work_are_rejected_with_the_key(tmp_path, words, text):
    (tmp_path / "empty.pem").touch()
    file = tmp_path / "instrument.toml"
    file.write_text(ENABLED + text)
    with pytest.raises(ConfigurationFileError) as caught:
        load_checked(file)
    assert words in str(caught.value)
    assert str(caught.value).startswith(str(file))


def test_the_default_is_disabled_and_valid_when_enabled(tmp_path):
    file = tmp_path / "instrument.toml"
    file.write_text(ENABLED)
    configuration = load_checked(file)
    assert mqtt_process_of(configuration, tmp_path / "socket", {"ca": ""}) is not None
    assert mqtt_process_of(configuration, tmp_path / "socket", {}) is None
    assert parse({}, "x").mqtt.enabled is False


ADDRESSES = [
    ("mqtt://broker", BrokerAddress("broker", 1883, False)),
    ("mqtts://broker", BrokerAddress("broker", 8883, True)),
    ("mqtts://broker:1234/", BrokerAddress("broker", 1234, True)),
    ("mqtt://[fd00::1]:5", BrokerAddress("fd00::1", 5, False)),
]


@pytest.mark.parametrize(("url", "address"), ADDRESSES)
def test_the_url_has_the_usual_ports(url, address):
    assert broker_address(url) == address


def test_the_name_of_the_edge_node_is_configured_or_follows_from_the_instrument():
    def name(**tables):
        return edge_node_of(parse(tables, "x"))

    assert name(mqtt={"edge_node": "a"}, identity={"serial_number": 7}) == "a"
    assert name(identity={"serial_number": 7}) == "pneuforce-7"
    assert name() == f"pneuforce-{socket.gethostname()}"


def test_two_instruments_with_one_edge_node_are_rejected(tmp_path):
    def instrument(name, port, **mqtt):
        tables = {
            "mqtt": {"enabled": True, "store": f"{name}.sqlite", **mqtt},
            "rig": {"port": f"/dev/{name}"},
        }
        files = {"events": {"file": f"{name}-events"}, "local": {"socket": f"{name}.sock"}}
        return parse(tables | files | {"modbus": {"port": port}}, name)

    first, second = tmp_path / "a.toml", tmp_path / "b.toml"
    with pytest.raises(ConfigurationFileError, match=r"mqtt\.edge_node"):
        check_instruments({first: instrument("a", 5020), second: instrument("b", 5021)})
    check_instruments({first: instrument("a", 5020), second: instrument("b", 5021, edge_node="b")})


OPEN = {"enabled": True, "user": "a", "password_file": "p"}


@pytest.mark.parametrize(
    ("broker", "warned"),
    [("mqtt://10.0.0.1", True), ("mqtts://10.0.0.1", False), ("mqtt://localhost", False)],
)
def test_a_password_without_encryption_gives_a_warning(broker, warned):
    assert ("encryption" in parse({"mqtt": OPEN | {"broker": broker}}, "x").warning) is warned
