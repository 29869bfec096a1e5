"""Tests of `pneuforce doctor`, run as by a user on the port of a simulator."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest

from pneuforce.instrument.cli.rig import doctor as doctor_command
from pneuforce.instrument.cli.rig.doctor import print_checks
from pneuforce.instrument.doctor.check import Check, CheckResult
from pneuforce.instrument.doctor.port import INSTALL_RULES
from pneuforce.instrument.rig.usb_device import UDEV_RULES
from pneuforce.sim.server.client import SimulatorClient
from pneuforce.teststand.child_process import ChildProcess


@pytest.fixture
def rig(tmp_path):
    with ChildProcess(
        "simulator", ["pneuforce", "sim", "run", "--link", str(tmp_path / "rig"), "--no-hand"]
    ) as sim:
        yield str(tmp_path / "rig"), SimulatorClient(sim.ready()["control"])


@contextmanager
def doctor(*arguments):
    command = [sys.executable, "-m", "pneuforce", "doctor", "--json", *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def results(text):
    return {check["name"]: check["result"] for check in json.loads(text)["checks"]}


def test_a_simulated_rig_passes_with_exit_code_0(rig):
    with doctor("--port", rig[0]) as process:
        out, err = process.communicate(timeout=60)
    found = results(out)
    assert (process.returncode, json.loads(out)["ok"], "fail" in found.values()) == (0, True, False), err
    assert err == ""
    assert {found[name] for name in ("port", "board", "sensor zero", "supply", "faults")} == {"pass"}


def test_the_table_ends_with_a_conclusion_that_names_the_failed_checks(rig):
    link, remote = rig
    remote.request(fault={"name": "sensor_open"})
    command = [sys.executable, "-m", "pneuforce", "doctor", "--port", link]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.stdout.endswith("sensor, faults.\n")
    assert "Not fit for use" in done.stdout
    assert len(done.stderr.splitlines()) == 2


def test_a_path_to_copy_is_complete_in_40_columns(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "40")
    port = "/dev/serial/by-id/usb-Arduino__www.arduino.cc__0043_85735313-if00"
    print_checks(
        [Check("USB latency", CheckResult.WARNING, port, INSTALL_RULES), Check("a", CheckResult.PASS, "")]
    )
    shown = capsys.readouterr().out
    assert port in shown
    assert str(UDEV_RULES) in shown
    assert len(shown.splitlines()) == 3


@pytest.mark.parametrize(
    ("result", "inflate_kpa", "exit_code", "conclusion"),
    [
        (CheckResult.PASS, 5.0, 0, "Fit for use: all checks passed."),
        (CheckResult.NOT_APPLICABLE, 5.0, 0, "Fit for use: all checks passed."),
        (CheckResult.WARNING, 5.0, 0, "not yet shown to be fit for use; warning: venting."),
        (CheckResult.NOT_CHECKED, None, 0, "not yet shown to be fit for use; not checked: venting."),
        (CheckResult.NOT_CHECKED, 5.0, 1, "not yet shown to be fit for use; not checked: venting."),
        (CheckResult.FAIL, 5.0, 1, "Not fit for use; failed: venting."),
    ],
)
def test_only_a_rig_without_an_open_check_is_fit_for_use(
    monkeypatch, capsys, result, inflate_kpa, exit_code, conclusion
):
    async def examined(*_):
        return [Check("leak", CheckResult.PASS, "falls"), Check("venting", result, "halved")]

    monkeypatch.setattr(doctor_command, "examine_rig", examined)
    assert doctor_command.run_doctor("socket://192.0.2.1:1", inflate_kpa, as_json=False) == exit_code
    assert capsys.readouterr().out.splitlines()[-1].endswith(conclusion)


def test_ctrl_c_vents_the_inflated_balloon(rig):
    link, remote = rig
    with doctor("--port", link, "--inflate", "5.0") as process:
        until_s = time.monotonic() + 30
        while remote.truth()["balloon_kpa"] < 4.0 and time.monotonic() < until_s:
            time.sleep(0.05)
        os.kill(process.pid, signal.SIGINT)
        out, _ = process.communicate(timeout=60)
    assert process.returncode == 1
    found = results(out)
    assert {found[name] for name in ("filling", "leak", "inlet valve", "venting", "examination")} == {
        "not checked"
    }
    time.sleep(1.5)
    assert remote.truth()["balloon_kpa"] < 2.0


def test_a_board_of_another_version_fails_with_a_reason(rig):
    link, remote = rig
    remote.request(fault={"name": "other_version"})
    with doctor("--port", link) as process:
        out, _ = process.communicate(timeout=60)
    assert process.returncode == json.loads(out)["exit_code"] == 1
    assert "no valve was moved" in out
    assert results(out)["board"] == "fail"
