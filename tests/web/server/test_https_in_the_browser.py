"""Chromium opens the page over HTTPS, with an authority and certificates that the command has made."""

import shutil
import socket
import ssl
import subprocess
from contextlib import ExitStack

import pytest

from pneuforce.teststand.rig import LiveRig
from pneuforce.teststand.stack import free_port, start
from tests.command_runner import pneuforce
from tests.system.waiting import wait_for
from tests.tools import needs
from tests.web.browser import NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT, Browser
from tests.web.recovery import recover
from tests.web.users import OPERATOR, PASSWORD, users_file

pytestmark = [NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT, needs("libnss3-tools", "/usr/bin/certutil")]

INFLATED_KPA = 8.0


def made(*words):
    done = pneuforce("certificates", *words)
    assert done.returncode == 0, done.stderr


def make_instrument(folder, name, days):
    made(
        "instrument",
        folder,
        "--name",
        name,
        "--host",
        "localhost",
        "--host",
        "127.0.0.1",
        "--days",
        str(days),
    )


def use(folder, name):
    """Put the files where the configuration names them, as a program that renews certificates does."""
    for end in ("pem", "key"):
        shutil.copy(folder / f"{name}.{end}", folder / f"page.{end}")


def trust(home, authority):
    """Make Chromium with this home trust an authority."""
    database = home / ".pki/nssdb"
    database.mkdir(parents=True)
    certutil = ["certutil", "-d", f"sql:{database}"]
    subprocess.run([*certutil, "-N", "--empty-password"], check=True)
    subprocess.run([*certutil, "-A", "-n", "authority", "-t", "C,,", "-i", authority], check=True)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pki")
    made("authority", folder)
    make_instrument(folder, "old", days=20)
    make_instrument(folder, "new", days=400)
    use(folder, "old")
    return folder


@pytest.fixture(scope="module")
def browser(folder):
    trust(folder / "home", folder / "ca.pem")
    with Browser(HOME=str(folder / "home")) as browser:
        yield browser


@pytest.fixture
def children():
    with ExitStack() as children:
        yield children


def days_of_certificate(folder, port):
    """Return the days for which the certificate that the page sends was made."""
    with socket.create_connection(("127.0.0.1", port), 5) as raw:
        context = ssl.create_default_context(cafile=folder / "ca.pem")
        certificate = context.wrap_socket(raw, server_hostname="localhost").getpeercert()
    begin_s, end_s = (ssl.cert_time_to_seconds(certificate[key]) for key in ("notBefore", "notAfter"))
    return (end_s - begin_s) // 86_400


def test_an_operator_vents_before_and_after_the_renewal_of_the_certificate(folder, browser, children):
    port = free_port()
    web = {"enabled": True, "port": port, "users_file": users_file(folder), "recordings": ""}
    web |= {"certificate": str(folder / "page.pem"), "key": str(folder / "page.key")}
    rig = LiveRig(start(children, folder / "rig", ["--no-hand", "--seed", "1"], {"web": web}))
    rig.wait_for(lambda registers: "maintenance_required" in registers["status"])

    browser("open", url=f"http://localhost:{port}/#user={OPERATOR}&password={PASSWORD}")
    recover(rig)  # the start of a browser can delay the simulator, so that the rig trips
    browser.wait_for_state("vented")
    assert browser.evaluate("location.href").startswith(f"https://localhost:{port}/")
    rig.inflate(INFLATED_KPA)
    browser("click", on="#vent-button")
    rig.wait_for(lambda registers: registers["state"] in ("venting", "vented"))

    assert days_of_certificate(folder, port) == 20
    use(folder, "new")
    wait_for(lambda: days_of_certificate(folder, port), lambda days: days == 400)
    rig.wait_for(lambda registers: "maintenance_required" not in registers["status"])
    browser.wait_for_state("vented")  # the event stream of the earlier certificate is still open
    rig.inflate(INFLATED_KPA)
    browser("press", key="Alt+v")
    rig.wait_for(lambda registers: registers["state"] in ("venting", "vented"))
    browser("reload")
    browser.wait_for_state("vented")
    assert browser("errors") == []
