"""The instrument as a service: what systemd hears of it, and the files that are installed beside it."""

import os
import re
import signal
import subprocess
import tomllib
from contextlib import ExitStack
from pathlib import Path

import pytest
from typer.testing import CliRunner

from instrument.cli.app import app
from instrument.cli.files import FILES, FOLDER
from instrument.config import Configuration, load
from registers.modbus.client import Plc
from tests.notified import Manager
from tests.system.conftest import running
from tests.system.waiting import inflate, wait_for
from tests.tools import needs
from teststand.children import Child
from teststand.stack import free_port, toml

UNIT = (FOLDER / "pneuforce.service").read_text()
CONFIGURATIONS = sorted(name for name in FILES if name.endswith(".toml"))
WATCH_S, MOST_EXPOSURE = 2.0, 2.0


@pytest.fixture
def manager(tmp_path, monkeypatch):
    manager = Manager(f"{tmp_path}/notify")
    monkeypatch.setenv("NOTIFY_SOCKET", manager.address)
    monkeypatch.setenv("WATCHDOG_USEC", str(round(WATCH_S * 1e6)))
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


def beats_in(manager, seconds):
    """How many beats are heard in a time that passes whatever is heard."""
    manager.heard()
    subprocess.run(["sleep", str(seconds)], check=True)
    return manager.heard().count("WATCHDOG=1")


def test_systemd_hears_that_it_serves_beats_and_ends(manager, tmp_path):
    with running(tmp_path / "rig") as stack:
        assert "READY=1" in until_heard(manager, "STATUS=vented")
        with stack.plc() as plc:
            inflate(plc, 6.0)
        until_heard(manager, "STATUS=holding")
        stack.host.send(signal.SIGSTOP)
        assert beats_in(manager, 2 * WATCH_S / 4) == 0
        stack.host.send(signal.SIGCONT)
        until_heard(manager, "WATCHDOG=1")
        stack.host.send(signal.SIGTERM)
        heard = until_heard(manager, "STOPPING=1")
        wait_for(lambda: stack.host.running, lambda runs: not runs)
        heard += manager.heard()
        assert "WATCHDOG=1" not in heard[heard.index("STOPPING=1") :]


def begun(children, rig, modbus_port):
    """An instrument that has been started, whether or not it serves."""
    host = children.enter_context(Child("instrument", ["instrument", "run", "--config", "/dev/stdin"]))
    tables = {"rig": {"port": str(rig)}, "modbus": {"port": modbus_port}}
    host.tell(toml({**tables, "events": {"file": ""}, "local": {"socket": ""}}))
    return host


def test_it_is_not_ready_while_the_board_has_not_answered(manager):
    with ExitStack() as children:
        cable, silent = os.openpty()
        children.callback(os.close, cable)
        children.callback(os.close, silent)
        begun(children, os.ttyname(silent), free_port())
        assert os.read(cable, 1)  # it greets
        assert manager.heard() == []


def test_when_it_is_ready_modbus_is_served_and_what_the_watchdog_aborts_says_where_it_was(manager, tmp_path):
    with ExitStack() as children:
        link, port = tmp_path / "rig", free_port()
        children.enter_context(Child("simulator", ["instrument", "sim", "--link", str(link)])).ready()
        host = begun(children, link, port)
        until_heard(manager, "READY=1")
        Plc.connect(port=port).close()
        host.send(signal.SIGABRT)
        wait_for(lambda: list(host.said), lambda said: any("asyncio" in line for line in said))
        assert any("Aborted" in line for line in host.said)


# ---- the files


def installed_unit(folder):
    """The unit as systemd is to read it, its program one that is there."""
    file = folder / "pneuforce.service"
    file.write_text(re.sub("^ExecStart=[^ ]*", "ExecStart=/bin/true", UNIT, flags=re.M))
    return file


@needs("systemd", "/usr/bin/systemd-analyze")
def test_systemd_understands_every_line_of_the_unit(tmp_path):
    done = subprocess.run(
        ["systemd-analyze", "verify", installed_unit(tmp_path)], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")


@needs("systemd", "/usr/bin/systemd-analyze")
def test_the_service_may_do_little_beside_its_work(tmp_path):
    command = ["systemd-analyze", "security", "--offline=true", f"--threshold={MOST_EXPOSURE * 10:.0f}"]
    done = subprocess.run([*command, installed_unit(tmp_path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_the_watch_of_the_unit_is_the_tested_one():
    assert f"\nWatchdogSec={WATCH_S:.0f}\n" in UNIT


IN_A_PLACE_OF_ITS_OWN = """
mount -t tmpfs none /run && mkdir -p /run/udev/rules.d && cp "$1" /run/udev/rules.d &&
udevadm test /sys/class/net/lo
"""


def read_by_udev(rules):
    """What udev says of a file of rules: it reads it as root, in a name space where /run is empty."""
    shell = ["unshare", "--map-root-user", "--mount", "sh", "-c", IN_A_PLACE_OF_ITS_OWN, "sh", rules]
    done = subprocess.run(shell, capture_output=True, text=True, check=False)
    said = done.stdout + done.stderr
    if f"rules.d/{rules.name}" not in said:
        pytest.skip(f"no mount name space may be made here: {done.stderr.strip()}")
    return [line for line in said.splitlines() if f"{rules.name}:" in line]


@needs("udev", "/usr/bin/udevadm")
def test_udev_understands_every_line_of_the_rule(tmp_path):
    assert read_by_udev(FOLDER / "60-pneuforce.rules") == []
    wrong = tmp_path / "61-wrong.rules"
    wrong.write_text('SUBSYSTM=="tty", GROUP="dialout"\n')
    assert len(read_by_udev(wrong)) == 1


def test_every_file_is_printed_as_it_is_and_no_other():
    assert sorted(FILES) == sorted(path.name for path in FOLDER.iterdir())
    for name in FILES:
        printed = CliRunner().invoke(app, ["files", name])
        assert printed.output == (FOLDER / name).read_text()
    listed = CliRunner().invoke(app, ["files"]).output.splitlines()
    assert [line.split()[0] for line in listed] == list(FILES)


@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_a_configuration_to_start_from_names_only_what_its_use_changes(name):
    configuration, standard = load(FOLDER / name), Configuration()
    assert configuration.doubt == ""
    for section, keys in tomllib.loads((FOLDER / name).read_text()).items():
        for key, value in keys.items():
            assert getattr(getattr(standard, section), key) != value, f"{section}.{key}"


@pytest.mark.parametrize("name", ["plc.toml", "robot.toml"])
def test_what_a_service_writes_lies_where_it_may(name):
    own = load(FOLDER / name)
    places = {Path(own.events.file).parent, Path(own.local.socket).parent}
    assert places == {Path("/var/lib/pneuforce"), Path("/run/pneuforce")}
    assert {"StateDirectory=pneuforce", "RuntimeDirectory=pneuforce"} <= set(UNIT.splitlines())
    assert "SupplementaryGroups=dialout" in UNIT
    assert own.safety.lease_demanded
