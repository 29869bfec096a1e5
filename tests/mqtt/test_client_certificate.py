"""The end of the client certificate of MQTT: in the heartbeat of the process and in `config --check`."""

import json
import subprocess
import sys

import pytest

from pneuforce.instrument.cli.config_check import check_config
from tests.registers.modbus_security.serving import Pki


@pytest.fixture
def pki(tmp_path):
    return Pki(tmp_path / "pki")


def first_heartbeat(tmp_path, certificate):
    """Start the real process with a broker that cannot be reached. Return its first heartbeat."""
    broker = {"host": "127.0.0.1", "port": 1, "tls": False}
    names = {"group": "plant", "edge_node": "node", "device": "rig"}
    options = {"socket": str(tmp_path / "none.sock"), "certificate": str(certificate), **broker, **names}
    with subprocess.Popen(
        [sys.executable, "-P", "-m", "pneuforce.mqtt"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        process.stdin.write(json.dumps(options) + "\n")
        process.stdin.flush()
        assert json.loads(process.stdout.readline()) == {"port": 1}
        heartbeat = json.loads(process.stdout.readline())
        process.stdin.close()
        process.wait(600)
    return heartbeat


def test_the_heartbeat_contains_the_days_until_the_certificate_expires(tmp_path, pki):
    pki.client("mqtt", "operator", days=10)
    days = first_heartbeat(tmp_path, pki.folder / "mqtt.pem")["certificate_days"]
    assert days == pytest.approx(10, abs=0.1)


@pytest.mark.parametrize("name", ["absent.pem", "empty.pem"])
def test_a_certificate_that_cannot_be_read_does_not_end_the_process(tmp_path, name):
    (tmp_path / "empty.pem").touch()
    assert first_heartbeat(tmp_path, tmp_path / name)["certificate_days"] is None


def test_the_configuration_check_warns_before_the_end(tmp_path, pki, capsys):
    file = tmp_path / "instrument.toml"
    names = 'ca = "pki/ca.pem"\ncertificate = "pki/mqtt.pem"\nkey = "pki/mqtt.key"\n'
    file.write_text(f'[local]\nsocket = "i.sock"\n[mqtt]\nenabled = true\nbroker = "mqtts://broker"\n{names}')
    for days, words in ((365, ""), (10, "mqtt: the certificate expires in 10 days")):
        pki.client("mqtt", "operator", days=days)
        check_config([file], as_json=False)
        shown = capsys.readouterr().out
        assert words in shown
        assert ("expires" in shown) == bool(words)
