"""Tests of `pneuforce config --check` for several instruments on one computer."""

import json
import tomllib
from itertools import permutations
from pathlib import Path

import pytest

from pneuforce.errors import ConfigurationFileError
from pneuforce.instrument.cli.config_check import check_config
from pneuforce.instrument.config import parse
from pneuforce.instrument.service.checks.instruments_on_one_host import check_instruments
from tests.command_runner import pneuforce


def instrument(number, **tables):
    """Return the configuration of an instrument that shares nothing with others except for `tables`."""
    own = {
        "rig": {"port": f"/dev/serial/by-id/board-{number}"},
        "modbus": {"port": 5020 + number},
        "events": {"file": f"/var/lib/pneuforce/{number}/events.sqlite"},
        "local": {"socket": f"/run/pneuforce/{number}/pneuforce.sock"},
        "can": {"parameter_file": f"/var/lib/pneuforce/{number}/canopen.json"},
        "identity": {"serial_number": number},
    }
    return parse({name: own.get(name, {}) | tables.get(name, {}) for name in own | tables}, "x")


def checked(first, second):
    """Return the message of the check in both orders; they name the same keys. Empty without a collision."""
    messages = []
    for (a, one), (b, other) in permutations((("a.toml", first), ("b.toml", second))):
        try:
            check_instruments({Path(a): one, Path(b): other})
        except ConfigurationFileError as error:
            messages.append(str(error))
    assert len(messages) in (0, 2)
    return messages[0] if messages else ""


CAN = {"enabled": True, "interface": "socketcan", "channel": "can0"}
SOCKETCAND = {"enabled": True, "interface": "socketcand"}


@pytest.mark.parametrize(
    ("shared", "message"),
    [
        (
            {"modbus": {"port": 5020}},
            "a.toml: modbus.port and b.toml: modbus.port are both the TCP port 5020",
        ),
        ({"web": {"enabled": True}}, "a.toml: web.port and b.toml: web.port are both the TCP port 8080"),
        (
            {"rig": {"port": "/dev/pneuforce"}},
            "a.toml: rig.port and b.toml: rig.port are both /dev/pneuforce",
        ),
        ({"rig": {"port": "socket://10.0.0.9:7"}}, "rig.port are both socket://10.0.0.9:7"),
        ({"modbus_rtu": {"enabled": True}}, "modbus_rtu.port are both /dev/ttyUSB0"),
        ({"rdt": {"enabled": True}}, "a.toml: rdt and b.toml: rdt are both the UDP port 49152 of 127.0.0.1"),
        ({"can": CAN}, "can.node_id and b.toml: can.node_id are both node 5 on socketcan can0"),
        ({"can": SOCKETCAND}, "are both node 5 on socketcand can0"),
        ({"events": {"file": "/tmp/e"}}, "events.file and b.toml: events.file are both /tmp/e"),
        ({"local": {"socket": "/tmp/s"}}, "local.socket and b.toml: local.socket are both /tmp/s"),
        (
            {"mqtt": {"enabled": True, "edge_node": "e", "store": "/tmp/m"}},
            "a.toml: mqtt.store and b.toml: mqtt.store are both /tmp/m",
        ),
        (
            {"can": CAN | {"mode": "canopen", "parameter_file": "/tmp/p"}},
            "can.parameter_file and b.toml: can.parameter_file are both /tmp/p",
        ),
        ({"web": {"enabled": True, "recordings": "/tmp/r"}}, "web.recordings are both /tmp/r"),
        ({"identity": {"serial_number": 7}}, "identity.serial_number are both 7"),
        ({"identity": {"serial_number": 0}}, ""),
        ({"measurement": {"calibration": "/tmp/c.toml"}}, ""),
        ({"events": {"file": ""}, "local": {"socket": ""}}, ""),
        ({}, ""),
    ],
)
def test_two_instruments_never_share_a_resource(shared, message):
    found = checked(instrument(1, **shared), instrument(2, **shared))
    assert message in found if message else found == ""


def test_a_file_that_is_only_read_can_be_shared_but_not_written_by_another_instrument():
    web = {"enabled": True, "users_file": "/tmp/u", "recordings": ""}
    second = instrument(2, web=web | {"port": 8081})
    assert checked(instrument(1, web=web), second) == ""
    found = checked(instrument(1, events={"file": "/tmp/u"}), second)
    assert found == "a.toml: events.file and b.toml: web.users_file are both /tmp/u: change one of them"


def test_all_collisions_are_named_at_once():
    shared = {"modbus": {"port": 5020}, "events": {"file": "/tmp/e"}, "identity": {"serial_number": 7}}
    found = checked(instrument(1, **shared), instrument(2, **shared))
    named = [clause.partition(" and ")[0] for clause in found.splitlines()]
    assert named == ["a.toml: modbus.port", "a.toml: identity.serial_number", "a.toml: events.file"]


@pytest.mark.parametrize("change", [{"node_id": 6}, {"channel": "can1"}, {"interface": "virtual"}])
def test_can_nodes_on_different_buses_or_with_different_numbers(change):
    assert checked(instrument(1, can=CAN), instrument(2, can=CAN | change)) == ""


def test_one_board_is_not_modbus_rtu_and_rig_of_two_instruments():
    rtu = {"enabled": True, "port": "/dev/serial/by-id/board-1"}
    assert "modbus_rtu.port are both /dev/serial" in checked(instrument(1), instrument(2, modbus_rtu=rtu))


def test_the_command_checks_all_files_of_a_computer(tmp_path):
    files = [tmp_path / "left.toml", tmp_path / "right.toml"]
    for number, file in enumerate(files):
        file.write_text(
            f'[rig]\nport = "/dev/board{number}"\n[modbus]\nport = {5020 + number}\n'
            f'[events]\nfile = "{number}.sqlite"\n[local]\nsocket = "{number}.sock"\n'
        )
        assert tomllib.loads(file.read_text())
    options = [word for file in files for word in ("--check", file)]
    good = pneuforce("config", *options, "--json")
    assert good.returncode == 0, good.stderr
    assert [each["file"] for each in json.loads(good.stdout)["instruments"]] == [str(file) for file in files]
    files[1].write_text(files[0].read_text())
    bad = pneuforce("config", *options)
    assert (bad.returncode, bad.stdout) == (78, "")
    assert f"{files[0]}: modbus.port and {files[1]}: modbus.port are both" in bad.stderr


def test_each_bad_file_is_reported_even_if_the_first_one_is_bad(tmp_path):
    texts = {
        "bad": "[rig]\nx = 1\n",
        "left": "[events]\nfile = 'absent/e'\n",
        "right": "[rdt]\nport = 70000\n",
    }
    files = [tmp_path / f"{name}.toml" for name in (*texts, "missing")]
    for file, text in zip(files, texts.values(), strict=False):
        file.write_text(text)
    good = tmp_path / "good.toml"
    good.write_text('[modbus]\nport = 5021\n[rig]\nport = "/dev/b"\n[local]\nsocket = "good.sock"\n')
    with pytest.raises(ConfigurationFileError) as caught:
        check_config([good, *files], as_json=False)
    lines = str(caught.value).splitlines()
    assert [line.partition(": ")[0] for line in lines] == list(map(str, files))
