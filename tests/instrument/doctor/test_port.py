"""Tests of the checks of a serial port, with real pseudo-terminals and imitated device folders of Linux."""

import os
import subprocess
import time
from pathlib import Path

import pytest

from pneuforce.instrument.doctor.check import CheckResult
from pneuforce.instrument.doctor.port import INSTALL_RULES, port_checks
from pneuforce.instrument.rig.usb_device import UDEV_RULES, processes_using, stable_name, usb_latency_ms


@pytest.fixture
def pty():
    ends = os.openpty()
    yield os.ttyname(ends[1])
    for end in ends:
        os.close(end)


def test_a_missing_port_fails_and_nothing_else_is_checked(tmp_path):
    first, *others = port_checks(str(tmp_path / "absent"))
    assert first.result is CheckResult.FAIL
    assert {check.result for check in others} == {CheckResult.NOT_CHECKED}


@pytest.mark.parametrize("other", ["/dev/null", "/dev/zero", "/etc/passwd", "/tmp"])
def test_another_kind_of_file_fails_as_not_a_serial_port(other):
    first, *others = port_checks(other)
    assert (first.result, first.finding) == (CheckResult.FAIL, f"{other} is not a serial port")
    assert {check.result for check in others} == {CheckResult.NOT_CHECKED}


def test_the_udev_rules_of_the_advice_exist():
    assert UDEV_RULES.is_file()
    assert str(UDEV_RULES) in INSTALL_RULES


def test_the_checks_do_not_apply_to_a_port_behind_the_network():
    assert {check.result for check in port_checks("socket://10.0.0.1:4000")} == {CheckResult.NOT_APPLICABLE}


def test_a_free_pty_passes(pty):
    results = {check.name: check.result for check in port_checks(pty)}
    assert [results[name] for name in ("port", "permission", "exclusive access")] == [CheckResult.PASS] * 3


@pytest.fixture
def processes(tmp_path, pty):
    def process(pid, name, *opened):
        folder = tmp_path / str(pid)
        (folder / "fd").mkdir(parents=True)
        (folder / "comm").write_text(name + "\n")
        for number, path in enumerate(opened):
            (folder / "fd" / str(number)).symlink_to(path)

    process(77, "ModemManager", "/dev/null", pty)
    process(78, "simulator", "/dev/ptmx", pty)
    process(79, "other", "/dev/null")
    process(os.getpid(), "ourselves", pty)
    (tmp_path / "80").mkdir()  # a process that ended during the check: its folder is empty
    return tmp_path


def test_processes_with_the_port_open_are_listed_except_this_one_and_the_far_end_of_a_pty(processes, pty):
    assert processes_using(pty, processes) == ["ModemManager (77)"]


def test_the_stable_name_is_found_from_any_other_name_of_the_port(tmp_path, pty):
    (tmp_path / "usb-Arduino_Uno-if00").symlink_to(pty)
    (tmp_path / "usb-Another-if00").symlink_to("/dev/null")
    assert stable_name(pty, tmp_path) == tmp_path / "usb-Arduino_Uno-if00"
    assert stable_name("/dev/zero", tmp_path) is None
    assert stable_name(pty, tmp_path / "absent") is None


@pytest.mark.parametrize(("text", "latency_ms"), [("16\n", 16), ("1\n", 1), ("none", None)])
def test_the_latency_timer_is_read_if_the_adapter_has_one(tmp_path, pty, text, latency_ms):
    folder = tmp_path / os.path.basename(pty)
    folder.mkdir()
    (folder / "latency_timer").write_text(text)
    assert usb_latency_ms(pty, tmp_path) == latency_ms
    assert usb_latency_ms("/dev/ttyACM0", tmp_path) is None


@pytest.mark.parametrize(
    ("name", "remedy"),
    [("pneuforce", "systemctl stop pneuforce"), ("ModemManager", INSTALL_RULES), ("cat", "end that process")],
)
def test_the_remedy_for_a_port_in_use_depends_on_the_process(pty, tmp_path, name, remedy):
    program = tmp_path / name
    program.symlink_to("/usr/bin/tail")
    with open(pty, "rb") as port, subprocess.Popen([program, "-f", "/dev/null"], stdin=port) as other:
        try:
            while name not in Path(f"/proc/{other.pid}/comm").read_text():
                time.sleep(0.01)
            [check] = [check for check in port_checks(pty) if check.name == "exclusive access"]
            assert (check.result, check.finding) == (CheckResult.FAIL, f"open in {name} ({other.pid})")
            assert remedy in check.advice
        finally:
            other.kill()
