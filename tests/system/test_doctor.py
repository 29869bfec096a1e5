"""`pneuforce doctor` as its users run it, on the simulator's port."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest

from instrument.cli.doctor import _show
from instrument.doctor.check import Check, Verdict
from instrument.doctor.port import INSTALL_RULES
from instrument.rig.device import RULES
from sim.remote import Remote
from teststand.children import Child


@pytest.fixture
def rig(tmp_path):
    with Child("simulator", ["instrument", "sim", "--link", str(tmp_path / "rig"), "--no-hand"]) as sim:
        yield str(tmp_path / "rig"), Remote(sim.ready()["control"])


@contextmanager
def doctor(*arguments):
    command = [sys.executable, "-m", "instrument", "doctor", "--json", *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def verdicts(text):
    return {check["name"]: check["verdict"] for check in json.loads(text)}


def test_a_simulated_rig_is_found_good_and_so_is_the_exit_code(rig):
    with doctor("--port", rig[0]) as process:
        out, err = process.communicate(timeout=60)
    found = verdicts(out)
    assert (process.returncode, "bad" in found.values()) == (0, False), err
    assert {found[name] for name in ("port", "board", "sensor zero", "supply", "faults")} == {"good"}


def test_the_table_ends_in_a_sentence_that_says_whether_the_rig_is_fit_for_use(rig):
    link, remote = rig
    remote.order(fault={"name": "sensor_open"})
    command = [sys.executable, "-m", "instrument", "doctor", "--port", link]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.stdout.endswith("Not fit for use; bad: sensor, faults.\n")
    assert done.stderr == "listening\n"


def test_a_path_that_is_to_be_copied_is_whole_in_80_columns(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    _show([Check("USB latency", Verdict.DOUBTFUL, "16 ms", INSTALL_RULES)])
    assert str(RULES) in "".join(capsys.readouterr().out.split())


def test_ctrl_c_vents_a_balloon_that_it_has_inflated(rig):
    link, remote = rig
    with doctor("--port", link, "--inflate", "5.0") as process:
        until_s = time.monotonic() + 30
        while remote.truth()["balloon_kpa"] < 4.0 and time.monotonic() < until_s:
            time.sleep(0.05)
        os.kill(process.pid, signal.SIGINT)
        out, _ = process.communicate(timeout=10)
    assert process.returncode == 1
    found = verdicts(out)
    assert {found[name] for name in ("filling", "settling", "leak", "venting", "examination")} == {
        "not checked"
    }
    time.sleep(1.5)
    assert remote.truth()["balloon_kpa"] < 2.0


def test_a_board_of_another_version_is_bad_in_a_sentence(rig):
    link, remote = rig
    remote.order(fault={"name": "other_version"})
    with doctor("--port", link) as process:
        out, _ = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "no valve was moved" in out
    assert verdicts(out)["board"] == "bad"
