"""Tests of the Debian package on a minimal Debian with systemd: install, run, upgrade, remove, purge."""

import re
import shutil
import subprocess
import tomllib

import pytest

from tests.release.machine import booted
from tests.source_tree import ROOT
from tests.system.waiting import wait_for

pytestmark = pytest.mark.slow
CONFIGURATION = "/etc/pneuforce/instrument.toml"
RIG = "/run/rig/port"
INSTALL = ("apt-get", "install", "--yes", "--quiet", "-o", "Dpkg::Options::=--force-confold")
#: Services that the unit protects most: the page with a user, and a publisher whose broker does not answer.
WEB_AND_MQTT = """
[mqtt]
enabled = true
broker = "mqtt://127.0.0.1:1"
store = "/var/lib/pneuforce/mqtt.sqlite"
"""
ADD_USER = (
    "echo 'correct horse battery' | "
    f"/usr/bin/pneuforce users add anna --role operator --config {CONFIGURATION}"
)
LOG_IN = """\
import json
from urllib.request import Request, urlopen
login = json.dumps({"name": "anna", "password": "correct horse battery"}).encode()
print(urlopen(Request("http://127.0.0.1:8080/api/login", login, {"Content-Type": "application/json"})).status)
"""
READ_METRICS = (
    "from urllib.request import urlopen\nprint(urlopen('http://127.0.0.1:8080/metrics').read().decode())"
)
READ_FORCE = "import pneuforce\nwith pneuforce.connect('tcp://127.0.0.1:5020') as force: print(force.read())"


@pytest.fixture(scope="module")
def package():
    return max((ROOT / "dist").glob("pneuforce_*.deb"), key=lambda path: path.stat().st_mtime)


@pytest.fixture(scope="module")
def machine(package, tmp_path_factory):
    """Return a machine on which the package is installed."""
    with booted(tmp_path_factory.mktemp("machine")) as machine:
        shutil.copy(package, machine.path("/pneuforce.deb"))
        machine.run(*INSTALL, "/pneuforce.deb")
        yield machine


def started_simulator(machine):
    """Start a simulated rig as the user of the service, who may then open the port."""
    folder = ("--property=RuntimeDirectory=rig", "--property=User=pneuforce")
    simulator = ("/usr/bin/pneuforce", "sim", "run", "--link", RIG)
    machine.run("systemd-run", "--unit=rig", *folder, *simulator)
    wait_for(lambda: machine.call("test", "-e", RIG).returncode, lambda code: code == 0)


def property_of(machine, name, unit="pneuforce"):
    return machine.run("systemctl", "show", "--value", f"--property={name}", unit)


def rebuilt(package, folder, changed):
    """Return a copy of a package with a higher version and another text at the end of some files."""
    tree = folder / "tree"
    subprocess.run(["dpkg-deb", "--raw-extract", package, tree], check=True)
    control = tree / "DEBIAN/control"
    control.write_text(re.sub(r"(?m)^(Version: .*)$", r"\1+rebuilt", control.read_text()))
    for name in changed:
        (tree / name).write_text((tree / name).read_text() + "# a later version\n")
    newer = folder / "newer.deb"
    subprocess.run(
        ["dpkg-deb", "-Zgzip", "-z1", "--build", tree, newer], check=True, stdout=subprocess.DEVNULL
    )
    return newer


def test_the_user_of_the_service_may_open_the_port_of_the_board(machine):
    assert "dialout" in machine.run("id", "--name", "--groups", "pneuforce").split()


def test_the_program_runs_and_the_configuration_is_valid(machine):
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert machine.run("pneuforce", "--version").split()[-1] == version
    machine.run("pneuforce", "config", "--check", CONFIGURATION)


def test_all_files_are_unchanged_and_all_shared_libraries_are_found(machine):
    assert machine.run("dpkg", "--verify", "pneuforce") == ""
    names = r"find /opt/pneuforce \( -name '*.cpython-*.so' -o -name '*.abi3.so' \) -exec ldd {} +"
    script = f"{names} | grep 'not found' | sort -u"
    assert machine.run("sh", "-c", script) == ""
    assert machine.run("/opt/pneuforce/bin/python", "-c", "import numpy, scipy.sparse.linalg, can") == ""


def test_only_the_service_can_read_the_configuration_and_the_state(machine):
    names = machine.run("stat", "-c", "%A %U:%G", "/etc/pneuforce", CONFIGURATION, "/var/lib/pneuforce")
    assert names.splitlines() == [
        "drwxr-x--- root:pneuforce",
        "-rw-r----- root:pneuforce",
        "drwx------ pneuforce:pneuforce",
    ]


def test_the_service_is_not_enabled_by_the_installation(machine):
    assert machine.call("systemctl", "is-enabled", "pneuforce").stdout.strip() == "disabled"
    assert property_of(machine, "ActiveState") == "inactive"
    for unit in ("pneuforce.service", "pneuforce@one.service", "pneuforce-overview.service"):
        done = machine.call("systemd-analyze", "verify", unit)
        assert (done.returncode, done.stdout) == (0, "")


def test_the_service_starts_and_an_upgrade_restarts_it_with_its_configuration(machine, package, tmp_path):
    file = machine.path(CONFIGURATION)
    configured = file.read_text().replace("/dev/pneuforce", RIG).replace("[web] ", "[web]\nenabled = true")
    configured += WEB_AND_MQTT
    file.write_text(configured)
    machine.run("sh", "-c", ADD_USER)
    started_simulator(machine)
    machine.run("systemctl", "enable", "--now", "pneuforce")
    assert property_of(machine, "ActiveState") == "active"
    wait_for(lambda: property_of(machine, "StatusText"), lambda text: "vented" in text)
    check_page_and_publisher(machine)
    assert "Measurement" in machine.run("/opt/pneuforce/bin/python", "-c", READ_FORCE)
    old_process = property_of(machine, "MainPID")

    newer = rebuilt(
        package, tmp_path, ["etc/pneuforce/instrument.toml", "usr/lib/systemd/system/pneuforce.service"]
    )
    shutil.copy(newer, machine.path("/newer.deb"))
    machine.run(*INSTALL, "/newer.deb")
    assert file.read_text() == configured
    assert machine.path(f"{CONFIGURATION}.dpkg-dist").is_file()
    wait_for(lambda: property_of(machine, "ActiveState"), lambda state: state == "active")
    assert property_of(machine, "MainPID") not in ("0", old_process)
    assert property_of(machine, "NeedDaemonReload") == "no"
    assert machine.path("/var/lib/pneuforce/events.sqlite").is_file()


def check_page_and_publisher(machine):
    """Check inside the limits of the unit that a user can log in and that values wait for the broker."""

    def python(program):
        done = machine.call("/opt/pneuforce/bin/python", "-c", program)
        return done.stdout if done.returncode == 0 else ""

    wait_for(lambda: python(READ_METRICS), lambda text: "pneuforce_instrument_up 1.0" in text)
    assert python(LOG_IN).strip() == "200"
    store = ("test", "-s", "/var/lib/pneuforce/mqtt.sqlite")
    wait_for(lambda: machine.call(*store).returncode, lambda code: code == 0)
    assert "mqtt" in machine.run("journalctl", "--unit=pneuforce", "--output=cat").lower()


def test_remove_keeps_and_purge_deletes_configuration_and_state(machine):
    machine.run("apt-get", "remove", "--yes", "--quiet", "pneuforce")
    assert property_of(machine, "MainPID") == "0"
    assert not machine.path("/opt/pneuforce").exists()
    assert machine.path(CONFIGURATION).is_file()
    assert machine.path("/var/lib/pneuforce/events.sqlite").is_file()

    calibration = machine.path("/etc/pneuforce/calibration.toml")
    calibration.write_text("# of the operator\n")
    machine.run("apt-get", "purge", "--yes", "--quiet", "pneuforce")
    left = machine.run(
        "sh", "-c", "find / -xdev -path /proc -prune -o -name '*pneuforce*' -print"
    ).splitlines()
    assert sorted(path for path in left if not path.startswith(("/var/lib/apt", "/var/log"))) == [
        "/etc/pneuforce",
        "/pneuforce.deb",
    ]
    assert [path.name for path in machine.path("/etc/pneuforce").iterdir()] == [calibration.name]


def test_an_environment_that_was_installed_by_hand_is_not_overwritten(machine):
    machine.path("/opt").mkdir(exist_ok=True)
    machine.path("/opt/pneuforce").symlink_to("pneuforce-0.1.0")
    done = machine.call(*INSTALL, "/pneuforce.deb")
    assert done.returncode != 0
    assert "/opt/pneuforce is a symbolic link" in done.stdout
    assert not machine.path("/opt/pneuforce-0.1.0").exists()
