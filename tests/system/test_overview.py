"""System test of the overview: two instruments, one of them ends."""

import json
import signal
import ssl
import urllib.request
from contextlib import ExitStack

import pytest

from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.stack import free_port, start
from tests.command_runner import pneuforce
from tests.registers.modbus_security.serving import Pki
from tests.system.waiting import wait_for


def read(port, authority, path="/"):
    context = ssl.create_default_context(cafile=authority)
    with urllib.request.urlopen(f"https://127.0.0.1:{port}{path}", timeout=60, context=context) as answer:
        return answer.read().decode()


def test_the_overview_shows_each_instrument_and_notices_its_end(tmp_path):
    files, pki = [], Pki(tmp_path / "pki")
    authority = pki.folder / "ca.pem"
    with ExitStack() as children:
        for name in ("left", "right"):
            folder = tmp_path / name
            folder.mkdir()
            file = tmp_path / f"{name}.toml"
            file.write_text(f'[local]\nsocket = "{folder}/pneuforce.sock"\n')
            files.append(str(file))
        stacks = [start(children, tmp_path / name / "rig", ["--no-hand"]) for name in ("left", "right")]
        command = ["pneuforce", "overview", *files, "--port", str(free_port())]
        command += ["--certificate", pki.own["certificate"], "--key", pki.own["key"]]
        page = children.enter_context(ChildProcess("overview", command))
        port = page.ready()["overview"]

        def rows():
            return {
                each["name"]: each
                for each in json.loads(read(port, authority, "/api/instruments"))["instruments"]
            }

        wait_for(rows, lambda found: all(each["reachable"] for each in found.values()))
        assert "2 instruments" in read(port, authority)
        stacks[0].host.send(signal.SIGKILL)
        found = wait_for(rows, lambda found: not found["left"]["reachable"])
        assert found["right"]["reachable"]
        assert "2 instruments, 1 with a latched fault or without data" in read(port, authority)


@pytest.mark.parametrize(
    ("words", "code", "sentence"),
    [
        (["--host", "0.0.0.0"], 2, "name the clients with --allow"),
        (["--certificate", "page.pem"], 2, "--certificate and --key belong together"),
        (["--certificate", "absent.pem", "--key", "absent.key"], 2, "absent.pem: no such file"),
        (["--allow", "nonsense"], 2, "--allow: 'nonsense' does not appear to be"),
        (["--host", "203.0.113.1", "--allow", "203.0.113.0/24"], 69, "the overview cannot listen"),
    ],
)
def test_wrong_options_are_explained(tmp_path, words, code, sentence):
    file = tmp_path / "left.toml"
    file.write_text("[local]\n")
    done = pneuforce("overview", file, "--port", "0", *words)
    assert (done.returncode, done.stderr.count("\n")) == (code, 1)
    assert sentence in done.stderr
