"""Tests of a running instrument whose configuration and calibration are signed."""

import json
from contextlib import ExitStack

import pytest

from pneuforce.instrument.calibration import file as calibration_file
from pneuforce.instrument.signing.signed_file import signature_path
from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.stack import reserve_port, toml
from tests.command_runner import pneuforce
from tests.instrument.signing.keys import make_key, sign, trusted_line
from tests.tools import needs

pytestmark = needs("openssh-client", "/usr/bin/ssh-keygen")


def write_signed(file, content, key):
    file.write_bytes(content)
    signature_path(file).write_bytes(sign(content, key))


@pytest.fixture
def folder(tmp_path):
    """Return a folder with a signed calibration, a key and its file of trusted keys."""
    key = make_key(tmp_path / "lab")
    (tmp_path / "trusted-keys").write_text(trusted_line(key, "calibration-lab"))
    calibration = calibration_file.to_toml(calibration_file.empty(0)).encode()
    write_signed(tmp_path / "calibration.toml", calibration, key)
    return tmp_path


def test_buses_status_and_event_log_show_who_has_signed_the_files(folder):
    file = folder / "instrument.toml"
    with ExitStack() as children:
        port = reserve_port(children)
        tables = {
            "rig": {"port": str(folder / "rig")},
            "modbus": {"port": port},
            "measurement": {"calibration": "calibration.toml"},
        }
        write_signed(file, toml(tables).encode(), folder / "lab")
        with (folder / "calibration.toml").open("a") as calibration:
            calibration.write("# altered\n")
        link = ["--link", str(folder / "rig"), "--no-hand"]
        children.enter_context(ChildProcess("simulator", ["pneuforce", "sim", "run", *link])).ready()
        host = ["pneuforce", "run", "--config", str(file)]
        children.enter_context(ChildProcess("instrument", host)).ready()
        with ModbusClient.connect(port=port) as plc:
            registers = plc.read_block(range(798, 800))
        shown = pneuforce("status", "--port", port, "--json")
        assert shown.returncode == 0, shown.stderr
        status = json.loads(shown.stdout)["versions"]
    assert registers == {"configuration_signature": "signed", "calibration_signature": "altered"}
    assert [status[f"{name}_signature"] for name in ("configuration", "calibration")] == ["signed", "altered"]
    shown = pneuforce("log", "show", "--config", file, "--json", "--last", "0")
    start = json.loads(shown.stdout.splitlines()[0])
    assert start["configuration_signature"].startswith("signed by calibration-lab (SHA256:")
    assert start["calibration_signature"].startswith("altered")


@pytest.mark.parametrize("command", [("run", "--config"), ("config", "--check")])
def test_required_signatures_refuse_an_altered_file_with_exit_code_78(folder, command):
    file = folder / "instrument.toml"
    write_signed(file, b'[measurement]\ncalibration = "calibration.toml"\n', folder / "lab")
    with (folder / "calibration.toml").open("a") as calibration:
        calibration.write("# altered\n")
    refused = pneuforce(*command, file, "--require-signed-by", folder / "trusted-keys")
    assert (refused.returncode, len(refused.stderr.splitlines())) == (78, 1)
    assert all(word in refused.stderr for word in ("calibration.toml", "altered", "pneuforce sign file"))
