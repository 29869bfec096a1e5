"""Tests of the instrument as a service: notifications to systemd, unit file, udev rule and configurations."""

import os
import re
import signal
import subprocess
import tomllib
from contextlib import ExitStack
from pathlib import Path

import pytest
from typer.testing import CliRunner

from pneuforce.instrument.cli.app import app
from pneuforce.instrument.cli.files import FILES, FOLDER
from pneuforce.instrument.config import Configuration, load
from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.stack import free_port, toml
from tests.notified import Manager
from tests.source_tree import ROOT
from tests.system.conftest import running
from tests.system.waiting import inflate, wait_for
from tests.tools import needs

UNIT = (FOLDER / "pneuforce.service").read_text()
CONFIGURATIONS = sorted(name for name in FILES if name.endswith(".toml"))
WATCHDOG_S, MAX_EXPOSURE = 2.0, 2.0


@pytest.fixture
def manager(tmp_path, monkeypatch):
    manager = Manager(f"{tmp_path}/notify")
    monkeypatch.setenv("NOTIFY_SOCKET", manager.address)
    monkeypatch.setenv("WATCHDOG_USEC", str(round(WATCHDOG_S * 1e6)))
    for assignment in re.findall("^Environment=(.*)$", UNIT, re.M):
        monkeypatch.setenv(*assignment.split("="))
    yield manager
    manager.socket.close()


def until_heard(manager, wanted):
    heard = []

    def more():
        heard.extend(manager.heard())
        return heard

    return wait_for(more, lambda lines: wanted in lines)


def watchdog_messages_in(manager, seconds):
    """Return the number of watchdog messages in some seconds."""
    manager.heard()
    subprocess.run(["sleep", str(seconds)], check=True)
    return manager.heard().count("WATCHDOG=1")


def test_systemd_receives_ready_watchdog_and_stopping(manager, tmp_path):
    with running(tmp_path / "rig") as stack:
        assert "READY=1" in until_heard(manager, "STATUS=vented")
        with stack.plc() as plc:
            inflate(plc, 6.0)
        until_heard(manager, "STATUS=holding")
        stack.host.send(signal.SIGSTOP)
        assert watchdog_messages_in(manager, 2 * WATCHDOG_S / 4) == 0
        stack.host.send(signal.SIGCONT)
        until_heard(manager, "WATCHDOG=1")
        stack.host.send(signal.SIGTERM)
        heard = until_heard(manager, "STOPPING=1")
        wait_for(lambda: stack.host.running, lambda runs: not runs)
        heard += manager.heard()
        assert "WATCHDOG=1" not in heard[heard.index("STOPPING=1") :]


def started(children, rig, modbus_port):
    """Start an instrument and return its process at once, before the buses are served."""
    host = children.enter_context(ChildProcess("instrument", ["pneuforce", "run", "--config", "/dev/stdin"]))
    tables = {"rig": {"port": str(rig)}, "modbus": {"port": modbus_port}}
    host.write_stdin(toml({**tables, "events": {"file": ""}, "local": {"socket": ""}}))
    return host


def test_not_ready_before_the_board_answers(manager):
    with ExitStack() as children:
        cable, silent = os.openpty()
        children.callback(os.close, cable)
        children.callback(os.close, silent)
        started(children, os.ttyname(silent), free_port())
        assert os.read(cable, 1)  # the first request to the board
        assert manager.heard() == []


def test_modbus_is_served_when_ready_and_an_abort_prints_a_traceback(manager, tmp_path):
    with ExitStack() as children:
        link, port = tmp_path / "rig", free_port()
        children.enter_context(
            ChildProcess("simulator", ["pneuforce", "sim", "run", "--link", str(link)])
        ).ready()
        host = started(children, link, port)
        until_heard(manager, "READY=1")
        ModbusClient.connect(port=port).close()
        host.send(signal.SIGABRT)
        wait_for(lambda: list(host.stderr_lines), lambda lines: any("asyncio" in line for line in lines))
        assert any("Aborted" in line for line in host.stderr_lines)


# ---- installed files


def test_the_unit_for_several_instruments_differs_only_in_the_name():
    template = (FOLDER / "pneuforce@.service").read_text()
    assert "--config /etc/pneuforce/%i.toml" in template
    for folder in ("StateDirectory=pneuforce/%i", "RuntimeDirectory=pneuforce/%i"):
        assert folder in template.splitlines()
    same = (
        template.replace("/%i.toml", "/instrument.toml")
        .replace("/%i", "")
        .replace("pneuforce %i", "pneuforce")
    )
    assert same.partition("[Unit]")[2] == UNIT.partition("[Unit]")[2]


def installed_unit(folder, name):
    """Write a unit file with a program that exists on this machine, and return its path."""
    file = folder / name
    unit = (FOLDER / name).read_text()
    file.write_text(re.sub("^ExecStart=[^ ]*", "ExecStart=/bin/true", unit, flags=re.M))
    return file


each_unit = pytest.mark.parametrize("name", ["pneuforce.service", "pneuforce-overview.service"])


@each_unit
@needs("systemd", "/usr/bin/systemd-analyze")
def test_systemd_understands_every_line_of_the_unit(tmp_path, name):
    unit = installed_unit(tmp_path, name)
    done = subprocess.run(["systemd-analyze", "verify", unit], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@each_unit
@needs("systemd", "/usr/bin/systemd-analyze")
def test_the_service_has_few_permissions(tmp_path, name):
    command = ["systemd-analyze", "security", "--offline=true", f"--threshold={MAX_EXPOSURE * 10:.0f}"]
    done = subprocess.run(
        [*command, installed_unit(tmp_path, name)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout


def test_the_unit_of_the_overview_starts_with_the_options_of_the_command(tmp_path):
    """The command accepts the drop-in of the document. systemd divides a variable at its spaces."""
    unit = (FOLDER / "pneuforce-overview.service").read_text()
    [started] = re.findall("^ExecStart=/opt/pneuforce/bin/pneuforce (.*)$", unit, re.M)
    page = (ROOT / "docs/service.md").read_text()
    values = dict(re.findall(r'^Environment="(INSTRUMENTS|OPTIONS)=(.*)"$', page, re.M))
    words = " ".join(values.get(word.removeprefix("$"), word) for word in started.split()).split()
    missing = CliRunner().invoke(app, words)
    assert (type(missing.exception).__name__, "left.toml" in str(missing.exception)) == (
        "ConfigurationFileError",
        True,
    )


def test_the_watchdog_time_of_the_unit_is_the_tested_one():
    assert f"\nWatchdogSec={WATCHDOG_S:.0f}\n" in UNIT


IN_A_NAME_SPACE = """
mount -t tmpfs none /run && mkdir -p /run/udev/rules.d && cp "$1" /run/udev/rules.d &&
udevadm test /sys/class/net/lo
"""


def udev_messages_of(rules):
    """Let udev read a file of rules, in a namespace with an empty /run. Return its messages."""
    shell = ["unshare", "--map-root-user", "--mount", "sh", "-c", IN_A_NAME_SPACE, "sh", rules]
    done = subprocess.run(shell, capture_output=True, text=True, check=False)
    output = done.stdout + done.stderr
    if f"rules.d/{rules.name}" not in output:
        pytest.skip(f"this machine does not allow mount name spaces: {done.stderr.strip()}")
    return [line for line in output.splitlines() if f"{rules.name}:" in line]


@needs("udev", "/usr/bin/udevadm")
def test_udev_understands_every_line_of_the_rule(tmp_path):
    assert udev_messages_of(FOLDER / "60-pneuforce.rules") == []
    wrong = tmp_path / "61-wrong.rules"
    wrong.write_text('SUBSYSTM=="tty", GROUP="dialout"\n')
    assert len(udev_messages_of(wrong)) == 1


def test_every_file_is_listed_and_printed_unchanged():
    assert sorted(FILES) == sorted(path.name for path in FOLDER.iterdir())
    for name in FILES:
        printed = CliRunner().invoke(app, ["files", name])
        assert printed.output == (FOLDER / name).read_text()
    listed = CliRunner().invoke(app, ["files"]).output.splitlines()
    assert [line.split()[0] for line in listed] == list(FILES)


@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_an_example_configuration_contains_only_changed_keys(name):
    configuration, standard = load(FOLDER / name), Configuration()
    assert configuration.warning == ""
    for section, keys in tomllib.loads((FOLDER / name).read_text()).items():
        for key, value in keys.items():
            assert getattr(getattr(standard, section), key) != value, f"{section}.{key}"


@pytest.mark.parametrize("name", ["service.toml", "plc.toml", "robot.toml"])
def test_a_service_writes_only_into_its_own_folders(name):
    configuration = load(FOLDER / name)
    places = {Path(configuration.events.file).parent, Path(configuration.local.socket).parent}
    assert places == {Path("/var/lib/pneuforce"), Path("/run/pneuforce")}
    assert {"StateDirectory=pneuforce", "RuntimeDirectory=pneuforce"} <= set(UNIT.splitlines())
    assert "SupplementaryGroups=dialout" in UNIT
    assert configuration.safety.lease_required
